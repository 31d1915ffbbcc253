"""What a robot can do besides driving, by name: the port of a skill, and what comes of one."""

from mapspeak.skills.skill import (
    JsonValue,
    OnProgress,
    ParameterKind,
    Precondition,
    PreconditionKind,
    Skill,
    SkillApproval,
    SkillCode,
    SkillEffect,
    SkillOutcome,
    SkillParameter,
    SkillProgress,
    SkillSpec,
    SkillState,
)

__all__ = [
    "JsonValue",
    "OnProgress",
    "ParameterKind",
    "Precondition",
    "PreconditionKind",
    "Skill",
    "SkillApproval",
    "SkillCode",
    "SkillEffect",
    "SkillOutcome",
    "SkillParameter",
    "SkillProgress",
    "SkillSpec",
    "SkillState",
]
