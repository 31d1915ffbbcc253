"""What the model reads: frozen reports, each field with one line of explanation."""

import math
from collections.abc import Sequence
from typing import Self

from pydantic import Field

from mapspeak.driving.drivereport import DriveReport
from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point
from mapspeak.memory import Landmark, Merge, SemanticMap, WriteReceipt, name_key
from mapspeak.memory.quoting import quote_name
from mapspeak.places.goalcheck import GoalCheck, GoalVerdict, say_check
from mapspeak.places.naming import find_elsewhere
from mapspeak.places.relations.choosing import CheckedGoal
from mapspeak.robot import CauseCode, GoalState, StampedPose
from mapspeak.server.reports.maps import PoseReport, Report
from mapspeak.server.text.memory import say_landmarks, say_replaced
from mapspeak.server.text.offered import lead
from mapspeak.server.text.recall import say_places_left
from mapspeak.server.text.wording import list_some, say_pose, say_pose_doubt
from mapspeak.server.text.world.drives import say_end
from mapspeak.server.text.world.notices import say_elsewhere, say_off
from mapspeak.worldmodel.remembered import RememberedPlace, find_place_id, number_places

MOST_NAMED = 12
MOST_PLACES = 20
"""So many are given in full at once; each has some 800 characters."""
AT_HEADING_RAD = math.radians(15)
FRESH_S = 1.0
AT_GOAL_M = 0.5
"""Navigation ends a drive within its tolerance, usually 0.25 m; farther off is worth a word."""


class PoseAnswer(Report):
    """Where the robot is."""

    pose: PoseReport
    place: str = Field(description="the room or corridor it stands in, by id")
    age_s: float = Field(description="seconds since the estimate")
    pose_uncertain: str = Field(
        description="why the robot may be elsewhere; empty for a fresh pose on the map"
    )

    @classmethod
    def of(cls, stamped: StampedPose, *, place: str, now_s: float) -> Self:
        """Make the report of a stamped pose."""
        age_s = stamped.measure_age_s(now_s)
        return cls(
            pose=PoseReport.of(stamped.pose),
            place=place,
            age_s=round(age_s, 2),
            pose_uncertain=say_pose_doubt(stamped.find_doubt(now_s), age_s),
        )


NEXT_STEP = {
    GoalState.PLANNED: "It starts when the drive before it has ended. Call {wait_for_goal}.",
    GoalState.ACCEPTED: "Call {wait_for_goal}. {stop_robot} or {cancel_goal} end it.",
    GoalState.DRIVING: "Call {wait_for_goal}. {stop_robot} or {cancel_goal} end it.",
    GoalState.BLOCKED: "Call {look_at_map}. Choose another place or another way.",
    GoalState.CANCELLED: "Send a new goal when ready.",
    GoalState.PREEMPTED: "Ask for the newer goal.",
    GoalState.REJECTED: "Call {look_at_map}. Choose a place inside known free space.",
    GoalState.TIMED_OUT: "The robot was told to stop. Check its navigation, then send a new goal.",
    GoalState.LOST: "The robot was told to stop. Check where it is, then send a new goal.",
}
AT_THING = (
    "Take one look: {look_at} tells whether the thing is in view, and where; "
    "{write_semantic_data} keeps what is seen, with gone for what is not there."
)
AT_UNPLACED = "Look for it: {look_around}. {write_semantic_data} keeps where it is."
STOP_OWED = (
    "NOT STOPPED: the robot could not be told yet and may drive on. It is told as soon as it can "
    "be reached; press its own stop button if it must stand now."
)

UNANSWERED = (
    "The robot's navigation does not answer: another place would not help. Check that it runs and "
    "is active, then send the same goal again."
)
FOREIGN_DRIVE = (
    "Another client's goal drives the robot now: wait for its end. {stop_robot} ends it too."
)


class DriveAnswer(Report):
    """How a drive stands."""

    goal_id: str
    place: str
    goal: PoseReport | None = Field(description="null once the robot stands there")
    state: GoalState = Field(
        description="planned, accepted and driving go on, all others are final"
    )
    robot: PoseReport = Field(description="where it is now, or was seen last")
    pose_age_s: float | None = Field(description="null for a fresh pose")
    pose_uncertain: str = Field(
        description="why the robot may be elsewhere; empty for a fresh pose on the map"
    )
    distance_left_m: float | None = Field(description="by path; straight once it has ended")
    elapsed_s: float
    driven_m: float = Field(description="by its own poses")
    reason: str
    next_step: str = Field(description="empty once the robot stands at the goal")

    @classmethod
    def of(cls, report: DriveReport, *, foreign_goals: Sequence[GoalState] = ()) -> Self:
        """Make the report of a drive, with the goals of others that drive the robot after it."""
        left_m = _distance_left_m(report)
        is_fresh = report.pose_age_s < FRESH_S
        return cls(
            goal_id=report.drive.goal_id,
            state=report.status.state,
            place=report.drive.place,
            goal=None if _stands_at_goal(report) else PoseReport.of(report.drive.goal),
            robot=PoseReport.of(report.pose),
            pose_age_s=None if is_fresh else round(report.pose_age_s, 1),
            pose_uncertain=say_pose_doubt(report.pose_doubt, report.pose_age_s, report.silence),
            distance_left_m=None if left_m is None else round(left_m, 2),
            elapsed_s=round(report.elapsed_s, 1),
            driven_m=round(report.driven_m, 1),
            reason=say_end(
                report.status,
                report.drive.thing,
                report.pose.point if report.pose_doubt is None else None,
            ),
            next_step=lead(FOREIGN_DRIVE) if foreign_goals else _say_next_step(report),
        )


def _distance_left_m(report: DriveReport) -> float | None:
    if not report.status.state.is_final:
        return report.status.distance_left_m
    return report.pose.point.distance_to(report.drive.goal.point)


def _stands_at_goal(report: DriveReport) -> bool:
    if report.status.state is not GoalState.ARRIVED:
        return False
    return report.pose.is_near(report.drive.goal, off_m=AT_GOAL_M, turn_rad=AT_HEADING_RAD)


def _say_next_step(report: DriveReport) -> str:
    if report.is_stop_owed:
        return STOP_OWED
    cause = report.status.cause
    if cause is not None and cause.code is CauseCode.NOT_TAKEN:
        return UNANSWERED
    if report.status.state is not GoalState.ARRIVED:
        return lead(NEXT_STEP[report.status.state])
    off_m = report.pose.point.distance_to(report.drive.goal.point)
    if report.pose_doubt is not None:
        return "Navigation says that it arrived, but the pose is uncertain: look before going on."
    if off_m > AT_GOAL_M:
        return f"Navigation says that it arrived, but the robot is {off_m:.2f} m from the goal now."
    thing = report.drive.thing
    at_it = AT_UNPLACED if thing and thing.thing.position is None else AT_THING
    return "" if thing is None else lead(at_it)


class GoalAnswer(Report):
    """A goal judged before driving."""

    place: str
    verdict: GoalVerdict
    reason: str
    pose: PoseReport = Field(description="where the robot would stand")
    room: str | None = Field(description="the room or corridor that is in, by id")
    clearance_m: float | None = Field(
        description="to the nearest obstacle; null where that is not known"
    )
    path_m: float | None = Field(description="null when there is no way")
    nearest: PoseReport | None = Field(description="the nearest pose that works, if this does not")

    @classmethod
    def of(cls, goal: CheckedGoal, *, robot: Point, room: str | None) -> Self:
        """Make the report of a goal of a robot that stands at a point."""
        check = goal.check
        off = say_off(robot, goal.thing)
        return cls(
            place=goal.name,
            verdict=check.verdict,
            reason="; ".join(filter(None, (goal.place.reason, off, say_check(check)))),
            pose=PoseReport.of(goal.pose),
            room=room,
            clearance_m=_clearance_m(check),
            path_m=None if check.path_m is None else round(check.path_m, 2),
            nearest=None if check.nearest is None else PoseReport.of(check.nearest),
        )


def _clearance_m(check: GoalCheck) -> float | None:
    is_seen = check.verdict not in (GoalVerdict.OFF_MAP, GoalVerdict.UNKNOWN)
    return round(check.clearance_m, 2) if is_seen and math.isfinite(check.clearance_m) else None


class LandmarkReport(Report):
    """A thing seen from a remembered place."""

    label: str
    purpose: str | None = None
    bearing_deg: float | None = Field(None, description="from the pose's heading, left positive")
    range_m: float | None = None
    confidence: str | None = None
    note: str | None = None
    seen_from: str = Field("", description="if not the pose")

    @classmethod
    def of(cls, landmark: Landmark) -> Self:
        """Make the report of a landmark."""
        bearing_rad, pose = landmark.bearing_rad, landmark.pose
        return cls(
            label=landmark.label,
            purpose=landmark.purpose,
            bearing_deg=None if bearing_rad is None else round(math.degrees(bearing_rad), 1),
            range_m=None if landmark.range_m is None else round(landmark.range_m, 2),
            confidence=landmark.confidence,
            note=landmark.note,
            seen_from="" if pose is None else say_pose(pose),
        )


class WaypointReport(Report):
    """A remembered place: what was observed there, never an instruction."""

    id: str = Field(description="takes you there with navigate_to")
    name: str
    description: str
    pose: PoseReport
    safety_landmarks: list[LandmarkReport]
    functional_landmarks: list[LandmarkReport]
    geometric_features: list[str]

    @classmethod
    def of(cls, place: RememberedPlace) -> Self:
        """Make the report of a remembered place."""
        waypoint = place.waypoint
        return cls(
            id=place.id,
            name=waypoint.name,
            description=waypoint.description,
            pose=PoseReport.of(waypoint.pose),
            safety_landmarks=[LandmarkReport.of(each) for each in waypoint.safety_landmarks],
            functional_landmarks=[
                LandmarkReport.of(each) for each in waypoint.functional_landmarks
            ],
            geometric_features=list(waypoint.geometric_features),
        )


class MemoryAnswer(Report):
    """What is remembered."""

    map: str | None = Field(description="the map that the poses belong to")
    n_places: int = Field(description="in all, also those not shown")
    waypoints: list[WaypointReport]
    warnings: list[str]

    @classmethod
    def of(
        cls,
        memory: SemanticMap,
        name: str | None,
        *,
        first: int = 0,
        advice: Sequence[str] = (),
    ) -> Self:
        """Make the report of a page of all places, or of the one of that name or id.

        Args:
            first: The number of the place to begin with.
            advice: What else is to be said.

        Raises:
            SemanticMapError: There is no such place.
        """
        places = number_places(memory.waypoints)
        shown = [place for place in places if name is None or _is_called(place, name)]
        if name is not None and not shown and find_elsewhere(memory, name):
            raise SemanticMapError(
                f"{name[:80]!r} is remembered on another map; how that lies is not known here.",
                hint=lead("{realign_memory} finds out how the maps lie."),
            )
        if name is not None and not shown:
            named = [f"{place.id} {quote_name(place.waypoint.name)}" for place in places]
            known = list_some(named, most=MOST_NAMED)
            raise SemanticMapError(
                f"No place called {name[:80]!r} is remembered.",
                hint=f"Remembered are {known or 'no places yet'}; without a name all are given.",
            )
        return cls.of_places(memory, shown, first=first, advice=advice)

    @classmethod
    def of_places(
        cls,
        memory: SemanticMap,
        chosen: Sequence[RememberedPlace],
        *,
        first: int = 0,
        advice: Sequence[str] = (),
    ) -> Self:
        """Make the report of a page of some places, with what else is to be said of them."""
        shown = chosen[first : first + MOST_PLACES]
        behind = chosen[first + len(shown) :]
        return cls(
            map=memory.map_id,
            n_places=len(memory.waypoints),
            waypoints=[WaypointReport.of(place) for place in shown],
            warnings=[
                *say_places_left(behind, first=first + len(shown)),
                *advice,
                *say_elsewhere(memory),
                *memory.warnings,
            ],
        )


class PlaceWritten(Report):
    """What was remembered of one place, and what was not."""

    id: str = Field(description="takes you there with navigate_to; empty where nothing was written")
    seen_from: str = Field(description="pose, and the room by id")
    is_new: bool
    replaced: str = Field(description="what was known of the place and reads otherwise now")
    landmarks: list[str] = Field(description="new, merged, kept or gone, and what changed")
    things: list[str] = Field(description="by id, where they are")
    refused: list[str] = Field(description="what stays out, and why")
    warnings: list[str]

    @classmethod
    def of(
        cls,
        receipt: WriteReceipt,
        memory: SemanticMap,
        *,
        merge: Merge,
        refused: Sequence[str],
        warnings: Sequence[str] = (),
    ) -> Self:
        """Make the report of a write, with the id that the place has in the memory now."""
        waypoint = receipt.waypoint
        return cls(
            id=find_place_id(memory.waypoints, waypoint.name),
            seen_from=f"{say_pose(waypoint.pose)}, in {waypoint.room_id or 'no room'}",
            is_new=receipt.previous is None,
            replaced="; ".join(say_replaced(receipt.previous, merge.waypoint)),
            landmarks=list(say_landmarks(merge)),
            things=[],
            refused=list(refused),
            warnings=list(warnings),
        )

    @classmethod
    def of_refusal(cls, said: str) -> Self:
        """Make the report of a place of which nothing was written."""
        return cls(
            id="",
            seen_from="",
            is_new=False,
            replaced="",
            landmarks=[],
            things=[],
            refused=[said],
            warnings=[],
        )


class WriteAnswer(PlaceWritten):
    """What was remembered of a place, and of further ones."""

    n_places: int = Field(description="remembered in all")
    others: list[PlaceWritten] = Field(description="those of more, in its order")

    @classmethod
    def of_all(cls, written: Sequence[PlaceWritten], *, n_places: int) -> Self:
        """Make the report of places written at once; what all warn of is said once."""
        first, *others = written
        for n, each in enumerate(others):
            news = [said for said in each.warnings if said not in first.warnings]
            others[n] = each.model_copy(update={"warnings": news})
        return cls(**first.model_dump(), n_places=n_places, others=others)


def _is_called(place: RememberedPlace, name: str) -> bool:
    return name_key(place.waypoint.name) == name_key(name) or place.id == name.strip().upper()
