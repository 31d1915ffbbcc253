"""skills.yaml, in which the owner declares a robot's skills; saved missions are such files too."""

import io
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from mapspeak.errors import ConfigError, SkillError, say_cause
from mapspeak.settings import read_settings
from mapspeak.skill import (
    JsonValue,
    ParameterKind,
    Precondition,
    PreconditionKind,
    SkillApproval,
    SkillEffect,
    SkillParameter,
    SkillSpec,
)
from mapspeak.skills.arguments import check_value
from mapspeak.skills.comparing import Comparison
from mapspeak.skills.missions.reading import read_tree
from mapspeak.skills.missions.tree import Step

NAME = r"^[a-z][a-z0-9_]{0,39}$"
READY_MADE = ("nav2", "move_base")
ADVICE = "docs/howto/skills.md explains every key."
USUAL_MISSION_MIN = 30.0
MOST_MISSION_MIN = 24 * 60.0
USUAL_TIMEOUT_S = 60.0


class Called(StrEnum):
    """The kinds of things that a skill calls."""

    SERVICE = "service"
    ACTION = "action"
    PUBLISH = "publish"
    READ = "read"
    ROBOT_SKILL = "robot_skill"
    MISSION = "mission"


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnersEntry:
    """One skill as its owner wrote it.

    Attributes:
        calls: The kind of thing it calls.
        target: Its name at the robot; empty for a mission.
        type: Given by the owner, where the robot does not tell it; else empty.
        fixed: Arguments of what it calls that are always the same.
        renamed: The called interface's argument for each of its own parameters.
        success: Conditions on the result; None where the robot's own report decides.
        judge: The skill whose result is looked at in place of its own; else empty.
        remember: Remarks of people about it since.
        tree: Of a mission.
    """

    spec: SkillSpec
    calls: Called
    target: str = ""
    type: str = ""
    fixed: Mapping[str, JsonValue]
    renamed: Mapping[str, str]
    success: Comparison | None = None
    judge: str = ""
    remember: tuple[str, ...] = ()
    tree: Step | None = None


_Name = Annotated[str, Field(pattern=NAME)]
_Words = Annotated[str, Field(max_length=300)]
_Target = Annotated[str, Field(min_length=1, max_length=200)]
_Plain = str | float | int | bool
_Kind = Literal["number", "whole", "text", "flag", "list"]


class _Written(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class _Argument(_Written):
    name: _Name
    about: _Words = ""
    sets: _Target | None = None
    kind: _Kind | None = None
    unit: Annotated[str, Field(max_length=20)] = ""
    least: float | None = None
    most: float | None = None
    choices: Annotated[list[_Plain], Field(max_length=50)] = []
    default: _Plain | list[Any] | None = None

    @model_validator(mode="after")
    def _fits(self) -> Self:
        """Refuse a default that the argument would not take."""
        if self.least is not None and self.most is not None and self.least > self.most:
            message = f"{self.name!r} has least above most"
            raise ValueError(message)
        if self.default is not None:
            try:
                check_value(self.parameter(), self.default, where="default", what=self.name)
            except SkillError as error:
                raise ValueError(str(error)) from error
        return self

    def parameter(self) -> SkillParameter:
        return SkillParameter(
            name=self.name,
            kind=ParameterKind(self.kind) if self.kind else self._guess(),
            description=self.about,
            unit=self.unit,
            least=self.least,
            most=self.most,
            choices=tuple(self.choices),
            is_required=self.default is None,
            default=self.default,
        )

    def _guess(self) -> ParameterKind:
        """Return the kind that its bounds, its default or its choices show."""
        shown = self.default if self.default is not None else next(iter(self.choices), None)
        match shown:
            case bool():
                return ParameterKind.FLAG
            case str():
                return ParameterKind.TEXT
            case list():
                return ParameterKind.LIST
        is_number = shown is not None or (self.least, self.most, self.unit) != (None, None, "")
        return ParameterKind.NUMBER if is_number else ParameterKind.TEXT


class _Needs(_Written):
    battery_above: Annotated[float, Field(ge=0, le=1)] | None = None
    standing: Literal[True] | None = None
    in_room: _Target | None = None

    def preconditions(self) -> tuple[Precondition, ...]:
        found = []
        if self.battery_above is not None:
            found.append(Precondition(PreconditionKind.BATTERY_ABOVE, ratio=self.battery_above))
        if self.standing:
            found.append(Precondition(PreconditionKind.STANDING))
        if self.in_room is not None:
            found.append(Precondition(PreconditionKind.IN_ROOM, room=self.in_room))
        return tuple(found)


class _Success(_Written):
    field: _Target
    by: _Name | None = None
    equals: _Plain | None = Field(default=None, alias="is")
    above: float | None = None
    below: float | None = None

    @model_validator(mode="after")
    def _says_something(self) -> Self:
        if (self.equals, self.above, self.below) == (None, None, None):
            message = "it needs one of: is, above, below"
            raise ValueError(message)
        return self


class _Skill(_Written):
    name: _Name
    sentence: _Words = ""
    service: _Target | None = None
    action: _Target | None = None
    publish: _Target | None = None
    read: _Target | None = None
    robot_skill: _Target | None = None
    mission: Any = None
    type: _Target | None = None
    fixed: dict[str, Any] = {}
    arguments: Annotated[list[_Argument], Field(max_length=40)] = []
    succeeded_when: _Success | None = None
    timeout_s: Annotated[float, Field(gt=0, le=86_400)] = USUAL_TIMEOUT_S
    within_min: Annotated[float, Field(gt=0, le=MOST_MISSION_MIN)] = USUAL_MISSION_MIN
    needs: _Needs = _Needs()
    effect: Literal["reads", "moves", "changes"] | None = None
    approval: Literal["as_policy", "always"] = "as_policy"
    remember: list[_Words] = []

    @model_validator(mode="after")
    def _calls_one_thing(self) -> Self:
        named = [each for each in Called if getattr(self, each) is not None]
        if len(named) != 1:
            message = f"{self.name!r} needs one of: {', '.join(Called)}"
            raise ValueError(message)
        names = [each.name for each in self.arguments]
        if len(set(names)) != len(names):
            message = f"{self.name!r} has two arguments of one name"
            raise ValueError(message)
        return self

    def entry(self) -> OwnersEntry:
        calls = next(each for each in Called if getattr(self, each) is not None)
        is_mission = calls is Called.MISSION
        usual = {Called.READ: SkillEffect.READS, Called.MISSION: SkillEffect.MOVES}
        success = self.succeeded_when
        return OwnersEntry(
            spec=SkillSpec(
                name=self.name,
                description=self.sentence,
                effect=SkillEffect(self.effect)
                if self.effect
                else usual.get(calls, SkillEffect.CHANGES),
                timeout_s=self.within_min * 60 if is_mission else self.timeout_s,
                parameters=tuple(each.parameter() for each in self.arguments),
                preconditions=self.needs.preconditions(),
                approval=SkillApproval(self.approval),
            ),
            calls=calls,
            target="" if is_mission else str(getattr(self, calls)),
            type=self.type or "",
            fixed=dict(self.fixed),
            renamed={each.name: each.sets or each.name for each in self.arguments},
            success=None
            if success is None
            else Comparison(success.field, success.equals, success.above, success.below),
            judge="" if success is None else success.by or "",
            remember=tuple(self.remember),
            tree=read_tree(self.mission) if is_mission else None,
        )


class _SkillsFile(_Written):
    skills: Annotated[list[_Skill], Field(max_length=200)] = []


def load_skills(path: Path) -> tuple[OwnersEntry, ...]:
    """Read skills.yaml, or a file that ships, by its name: nav2, move_base.

    Raises:
        ConfigError: It cannot be read, or has a mistake; says the line and the reason.
    """
    if str(path) in READY_MADE and not path.exists():
        path = Path(__file__).with_name("data") / f"{path}.yaml"
    read = read_settings(path, _SkillsFile, name="skills.yaml", advice=ADVICE)
    entries = []
    for each in read.skills:
        try:
            entries.append(each.entry())
        except SkillError as error:
            raise ConfigError(
                f"{path}, skill {each.name}: {error.message}", hint=error.hint
            ) from error
    names = [each.spec.name for each in entries]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ConfigError(f"{path}: two skills are called {twice}.", hint="Rename one of them.")
    return tuple(entries)


def write_mission(path: Path, written: Mapping[str, Any]) -> None:
    """Write a file with one mission, as its owner would have.

    Raises:
        ConfigError: It could not be written.
    """
    _write(path, {"skills": [dict(written)]})


def add_correction(path: Path, name: str, correction: str) -> None:
    """Keep a person's remark about a skill in its file, and leave the rest as it is written there.

    Raises:
        ConfigError: The file cannot be read or written.
    """
    try:
        tree = YAML(typ="rt").load(path.read_text(encoding="utf-8"))
    except (OSError, YAMLError) as error:
        raise ConfigError(f"{path} cannot be read: {error}.", hint="Check the file.") from error
    for each in tree["skills"]:
        if each["name"] == name:
            each.setdefault("remember", []).append(correction)
    _write(path, tree)


def _write(path: Path, tree: Any) -> None:  # noqa: ANN401 - YAML
    text = io.StringIO()
    YAML(typ="rt").dump(tree, text)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text.getvalue(), encoding="utf-8")
    except OSError as error:
        raise ConfigError(
            f"{path} could not be written: {say_cause(error)}.", hint="Check disk and permissions."
        ) from error
