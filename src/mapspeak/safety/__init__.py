"""Limits that are on: a policy, a guard in front of the robot, a hold, an audit log."""

from mapspeak.hold import Hold
from mapspeak.safety.approvals import (
    Approvals,
    ApprovalScope,
    WaitingRoom,
    covered_by,
    within_scope,
)
from mapspeak.safety.audit import (
    NOBODY,
    AuditLine,
    AuditLog,
    Caller,
    calling,
    current_caller,
    read_audit,
)
from mapspeak.safety.commands import (
    Act,
    Call,
    Command,
    CommandKind,
    DriveCommand,
    Publish,
    RunSkill,
    SetParameter,
    say_command,
)
from mapspeak.safety.connection import GuardedConnection
from mapspeak.safety.deciding import (
    Allowed,
    Decision,
    NeedsApproval,
    Refused,
    Situation,
    decide,
)
from mapspeak.safety.guard import ApprovalNeededError, Guard, MapReviser, Permit
from mapspeak.safety.guardedrobot import GuardedRobot
from mapspeak.safety.policy import (
    Approval,
    AreaRule,
    Hours,
    Otherwise,
    Patterns,
    Policy,
    Speeds,
    WhenBusy,
)
from mapspeak.safety.policyfile import load_policy
from mapspeak.safety.teleop import Teleop, publishing_for, zero_velocity_of

__all__ = [
    "NOBODY",
    "Act",
    "Allowed",
    "Approval",
    "ApprovalNeededError",
    "ApprovalScope",
    "Approvals",
    "AreaRule",
    "AuditLine",
    "AuditLog",
    "Call",
    "Caller",
    "Command",
    "CommandKind",
    "Decision",
    "DriveCommand",
    "Guard",
    "GuardedConnection",
    "GuardedRobot",
    "Hold",
    "Hours",
    "MapReviser",
    "NeedsApproval",
    "Otherwise",
    "Patterns",
    "Permit",
    "Policy",
    "Publish",
    "Refused",
    "RunSkill",
    "SetParameter",
    "Situation",
    "Speeds",
    "Teleop",
    "WaitingRoom",
    "WhenBusy",
    "calling",
    "covered_by",
    "current_caller",
    "decide",
    "load_policy",
    "publishing_for",
    "read_audit",
    "say_command",
    "within_scope",
    "zero_velocity_of",
]
