"""Whether and how a robot gets to a goal, by the map and the closed areas of now."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import anyio.to_thread

from mapspeak.geometry import Pose
from mapspeak.places.goalcheck import GoalCheck, GoalVerdict, check_goal
from mapspeak.robot import Robot
from mapspeak.safety.deciding import MOST_NESTED, Refused, judge_check, refuse
from mapspeak.safety.detours import plan_legs
from mapspeak.safety.policy import Policy
from mapspeak.safety.surveying import Surveyor
from mapspeak.worldmodel.revision import MapRevision

SAME_PLACE_M = 0.1
"""A goal no farther away than this is a turn."""
SURVEY_EVERY_S = 1.0
"""Robot time between two looks at the map; so late may a closing hour be noticed."""
MOST_POSES = 200
NO_FRAME = "?"
"""Of what no frame could be read for, or that is no place in metres."""

Message = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """How the robot would get to a goal.

    Attributes:
        check: What the map says of the goal.
        legs: The poses to send it to, the goal last.
        here: Where it is.
    """

    check: GoalCheck
    legs: tuple[Pose, ...]
    here: Pose


class Planner:
    """Checks goals against the map, and plans the legs to them.

    Args:
        robot: The robot itself.
        surveyor: Knows what is closed now.
        policy: What goals are held to.
    """

    def __init__(self, robot: Robot, *, surveyor: Surveyor, policy: Policy) -> None:
        self._robot = robot
        self._surveyor = surveyor
        self._policy = policy
        self._surveyed_s = -math.inf

    async def survey_lately(self) -> MapRevision:
        """Return the map of a second of robot time ago at most, or of now."""
        since_s = self._robot.now_s - self._surveyed_s
        if self._surveyor.latest is None or not 0 <= since_s < SURVEY_EVERY_S:
            self._surveyed_s = self._robot.now_s
            return await self.survey()
        return self._surveyor.latest

    async def survey(self) -> MapRevision:
        """Return the map of now with the areas that are closed now."""
        grid = await self._robot.fetch_map()
        radius_m = self._robot.description.radius_m + self._policy.clearance_m
        return await self._surveyor.survey(grid, radius_m=radius_m)

    async def plan(self, goal: Pose) -> Plan:
        """Check a goal, and find the legs by which the robot would get there."""
        revision, here = await self._look()
        check = await anyio.to_thread.run_sync(_check, revision, here, goal)
        legs: tuple[Pose, ...] = (goal,)
        if check.is_ok and check.path_m:
            legs = await anyio.to_thread.run_sync(plan_legs, revision, here.point, goal)
        return Plan(check=check, legs=legs, here=here)

    async def judge_message(self, message: Message) -> Refused | None:
        """Return what is against the goal of an action: each pose in it is held to the map.

        Raises:
            LinkError: It holds a pose, and the map or where the robot is are not known.
        """
        poses = list(find_poses(message))
        if not poses:
            return None
        map_frame = self._robot.description.map_frame
        strange = next((frame for frame, _ in poses if frame not in ("", map_frame)), None)
        if strange is not None and self._surveyor.has_rules:
            return _refuse_frame(strange, map_frame)
        goals = [pose for frame, pose in poses if frame in ("", map_frame)]
        if len(goals) > MOST_POSES:
            return _refuse_many(len(goals))
        if not goals:
            return None
        revision, here = await self._look()
        return await anyio.to_thread.run_sync(self._judge_all, revision, here, goals)

    def _judge_all(
        self, revision: MapRevision, here: Pose, goals: Sequence[Pose]
    ) -> Refused | None:
        judged = (judge_check(_check(revision, here, goal), self._policy) for goal in goals)
        return next((each for each in judged if each is not None), None)

    async def _look(self) -> tuple[MapRevision, Pose]:
        here = (await self._robot.fetch_pose()).pose
        return await self.survey(), here


def _check(revision: MapRevision, here: Pose, goal: Pose) -> GoalCheck:
    check = check_goal(revision.grid, revision.distances_from(here.point), goal)
    if check.is_ok:
        return check
    is_turn = goal.is_finite() and here.point.distance_to(goal.point) <= SAME_PLACE_M
    is_over = any(area.distance_to(here.point) < revision.radius_m for area in revision.areas)
    if is_turn and not is_over:
        # Where it stands it can stand, however tight the map shows that place to be.
        return replace(check, verdict=GoalVerdict.OK, path_m=0.0, nearest=None)
    return check


def find_poses(value: object, frame: str = "", depth: int = 0) -> Iterator[tuple[str, Pose]]:
    """Find the poses anywhere in a message, each with its frame; "" where no header says one."""
    if depth > MOST_NESTED:
        yield NO_FRAME, Pose(math.nan, math.nan)
    elif isinstance(value, Mapping):
        frame = _read_frame(value, frame)
        pose = _read_pose(value, is_stamped="header" in value)
        if pose is not None:
            yield (frame if pose.is_finite() else NO_FRAME), pose
            return
        for inner in value.values():
            yield from find_poses(inner, frame, depth + 1)
    elif isinstance(value, (list, tuple)):
        for inner in value:
            yield from find_poses(inner, frame, depth + 1)


def _read_frame(message: Message, outer: str) -> str:
    header = message.get("header")
    if not isinstance(header, Mapping):
        return outer
    frame = header.get("frame_id")
    # A header without a frame names none, which is not the same as having no header.
    return frame.strip("/") if isinstance(frame, str) and frame else NO_FRAME


def _read_pose(message: Message, *, is_stamped: bool) -> Pose | None:
    """Return the pose that a Pose, a Pose2D or a PointStamped holds; not finite if it is no place.

    A message may leave fields out, which are zero then.
    """
    position = message.get("position")
    if not isinstance(position, Mapping) and is_stamped:
        position = message.get("point")
    if isinstance(position, Mapping):
        if not set(position) <= {"x", "y", "z"}:
            return Pose(math.nan, math.nan)
        return Pose(_number(position, "x"), _number(position, "y"), _read_yaw(message))
    if "theta" in message and {"x", "y"} & set(message):
        return Pose(_number(message, "x"), _number(message, "y"), _number(message, "theta"))
    return None


def _read_yaw(message: Message) -> float:
    quaternion = message.get("orientation")
    if not isinstance(quaternion, Mapping):
        return 0.0
    x, y, z, w = (_number(quaternion, axis) for axis in "xyzw")
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def _number(message: Message, name: str) -> float:
    value = message.get(name, 0.0)
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    try:
        return float(value) if is_number else math.nan
    except OverflowError:
        return math.inf


def _refuse_frame(frame: str, map_frame: str) -> Refused:
    said = "no frame" if frame == NO_FRAME else f"the frame {frame[:80]!r}"
    return refuse(
        f"Areas are closed to the robot, and this goal has a pose in {said}: whether it "
        "lies in one of them cannot be known.",
        rule="keep_out",
        hint=f"Give poses in the frame {map_frame!r}.",
    )


def _refuse_many(n_poses: int) -> Refused:
    return refuse(
        f"This goal has {n_poses} poses; at most {MOST_POSES} are checked.",
        rule="goals",
        hint="Send it in parts.",
    )
