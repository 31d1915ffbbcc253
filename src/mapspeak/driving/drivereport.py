"""A drive that was sent to the robot, and how it stands."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import NoReturn

from mapspeak.errors import GoalError, NextStep
from mapspeak.geometry import Point, Pose
from mapspeak.places.relations.choosing import GoalPurpose
from mapspeak.robot import GoalState, GoalStatus, PoseDoubt
from mapspeak.safety import NOBODY, Caller
from mapspeak.worldmodel.remembered import RememberedThing

JUST_SENT = GoalStatus(state=GoalState.ACCEPTED)
FRONTIER = re.compile(r"F\d+")


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """A drive that was sent to the robot.

    Attributes:
        goal_id: The name it goes by: G1, G2, ...
        place: What the goal was called when it was asked for.
        robot_goal_id: What the robot's navigation calls it; None before it was sent there.
        caller: Who asked for it.
        ticket: What it was started with; a stop since then ends also what was to follow it.
        purpose: What the robot comes for.
        thing: The remembered thing that it goes to see; None for other goals.
        part_of: The drive that was asked for and that this one ends; None for one of its own.
        begun_at: Where the robot was when it was sent; None where it waited its turn.
        begun_m: What the odometer of the drives showed then.
        ended_s: Robot time when it was heard that the drive had ended; None while it goes on.
        ended_at: Where the robot was then; None where that is not known.
        ended_m: What the odometer showed then; None while it goes on.
        heard: How it stood when the robot was heard last.
    """

    goal_id: str
    goal: Pose
    place: str
    robot_goal_id: str | None
    started_s: float
    caller: Caller = NOBODY
    ticket: int = 0
    purpose: GoalPurpose = GoalPurpose.ARRIVE
    thing: RememberedThing | None = None
    part_of: "Drive | None" = None
    begun_at: Point | None = None
    begun_m: float = 0.0
    ended_s: float | None = None
    ended_at: Point | None = None
    ended_m: float | None = None
    heard: GoalStatus = JUST_SENT
    final: GoalStatus | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveReport:
    """A drive and how it stands.

    Attributes:
        status: How it stands, or stood when the robot was heard last.
        pose: Where the robot is now, or was last seen.
        pose_age_s: How old that pose is.
        pose_doubt: Why the robot may be elsewhere; None for a fresh pose on the map.
        silence: What is missing of the robot, in words; empty where nothing is.
        is_stop_owed: It has to be stopped, and the robot could not be told so yet.
        driven_m: How far the robot has come on it, by its own poses.
    """

    drive: Drive
    status: GoalStatus
    pose: Pose
    pose_age_s: float
    pose_doubt: PoseDoubt | None
    silence: str
    is_stop_owed: bool
    elapsed_s: float
    driven_m: float

    @property
    def as_asked(self) -> "DriveReport":
        """The same told of the drive that was asked for, where this one only ends it."""
        asked, drive = self.drive.part_of, self.drive
        if asked is None:
            return self
        told = replace(
            drive,
            goal_id=asked.goal_id,
            place=asked.place,
            purpose=asked.purpose,
            started_s=asked.started_s,
            begun_m=asked.begun_m,
            part_of=asked.part_of,
        )
        before_s = drive.started_s - asked.started_s
        return replace(
            self,
            drive=told,
            elapsed_s=self.elapsed_s + max(before_s, 0.0),
            driven_m=self.driven_m + drive.begun_m - asked.begun_m,
        )


def find_drive(drives: Mapping[str, Drive], goal_id: str | None) -> Drive:
    """Return a drive, or the one that goes on for it where it did not get there.

    Args:
        drives: By their ids, the oldest first.
        goal_id: None for the latest.

    Raises:
        GoalError: No drive has that id.
    """
    latest = next(reversed(list(drives.values())), None)
    drive = latest if goal_id is None else drives.get(goal_id.strip().upper())
    if drive is None and not drives:
        raise GoalError(
            "The robot was sent nowhere yet.",
            hint="Send it somewhere first.",
            step=NextStep.DRIVE_FIRST,
        )
    if drive is None:
        raise GoalError(
            f"There is no goal {str(goal_id)[:40]!r}.",
            hint=f"Known goals are {', '.join(list(drives)[-5:])}.",
        )
    if drive.final is None or drive.final.state is GoalState.ARRIVED:
        return drive
    parts = [
        each for each in drives.values() if each.part_of and each.part_of.goal_id == drive.goal_id
    ]
    return parts[-1] if parts else drive


def refuse_beside(busy: Drive) -> NoReturn:
    """Refuse a drive while another one is under way that must not be replaced.

    Raises:
        GoalError: Always.
    """
    raise GoalError(
        f"{busy.goal_id} to {busy.place} is under way.",
        hint="Wait for its end, or end it.",
        step=NextStep.WAIT_OR_CANCEL,
    )


SAME_GOAL_M = 0.5
FAILED = (GoalState.BLOCKED, GoalState.REJECTED, GoalState.TIMED_OUT, GoalState.LOST)


def find_failed(drives: Iterable[Drive]) -> tuple[Drive, ...]:
    """Return the drives that failed, the latest first, but none where a later one ended otherwise.

    Args:
        drives: The oldest first.
    """
    failed: list[Drive] = []
    for drive in drives:
        state = None if drive.final is None else drive.final.state
        if state is GoalState.ARRIVED or state in FAILED:
            at = drive.goal.point
            failed = [each for each in failed if each.goal.point.distance_to(at) > SAME_GOAL_M]
        if state in FAILED:
            failed.insert(0, drive)
    return tuple(failed)
