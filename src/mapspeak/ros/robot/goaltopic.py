"""Goals for a robot that takes a pose on a topic and says nothing: its own pose has to tell."""

from collections.abc import Awaitable, Callable

from mapspeak.geometry import Point, Pose
from mapspeak.robot import Cause, CauseCode, GoalState, StampedPose
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.messages.poses import FramedPose, write_pose_stamped
from mapspeak.ros.port import RosConnection, has_listeners, new_id
from mapspeak.ros.robot.driving import LATEST_S, GoalRecord

ARRIVAL_M = 0.35
"""Nav2 and move_base stop within 0.25 m by default, and the pose may be a step behind."""
STANDING_M = 0.05
GIVEN_UP_S = 20.0
"""A robot that has stood still for so long has come as far as it could."""


class GoalTopicDriver:
    """Publishes goals and judges by the robot's pose what becomes of them.

    Args:
        map_frame: In which goals are given.
    """

    def __init__(
        self,
        connection: RosConnection,
        topic: str,
        *,
        dialect: Dialect,
        map_frame: str,
        fetch_pose: Callable[[], Awaitable[StampedPose]],
        now_s: Callable[[], float],
    ) -> None:
        self._connection = connection
        self._topic = topic
        self._dialect = dialect
        self._map_frame = map_frame
        self._fetch_pose = fetch_pose
        self._now_s = now_s
        self._current: GoalRecord | None = None
        self._moved: tuple[Point, float] | None = None
        """Where the robot was when it last moved, and when."""
        connection.advertise(topic, type_name=dialect.type_name("geometry_msgs/PoseStamped"))
        connection.started.actions[topic] = self

    @property
    def is_busy(self) -> bool:
        """True while a goal of ours is under way."""
        return self._current is not None and not self._current.is_over

    @property
    def owners(self) -> frozenset[str]:
        """None: whoever drives sees to the end."""
        return frozenset()

    async def fetch_foreign_goals(self) -> tuple[GoalState, ...]:
        """Return nothing: a topic for goals does not tell what became of them."""
        return ()

    async def send(self, goal: Pose) -> GoalRecord:
        """Publish a goal; nobody confirms it."""
        record = GoalRecord(new_id(), goal)
        self._connection.started.n_begun += 1
        await self._publish(goal)
        if self._current is not None:
            self._current.end(GoalState.PREEMPTED, Cause(code=CauseCode.REPLACED))
        self._current = record
        self._moved = None
        record.drive()
        return record

    async def look_at(self, record: GoalRecord) -> None:
        """Judge by the robot's pose how the goal stands."""
        if record is not self._current or record.is_over:
            return
        place = (await self._fetch_pose()).pose.point
        left_m = place.distance_to(record.goal.point)
        record.drive(distance_left_m=left_m)
        stood_s = self._stood_for_s(place)
        if left_m <= ARRIVAL_M and stood_s > 0.0:
            record.end(GoalState.ARRIVED)
        elif stood_s > GIVEN_UP_S:
            code = CauseCode.STOOD_STILL
            cause = Cause(code=code, after_s=stood_s, distance_m=left_m)
            record.end(GoalState.BLOCKED, cause)

    async def cancel(self, record: GoalRecord) -> None:
        """Send the robot to where it is; it has no other way to end a goal."""
        if not record.is_over and record is self._current:
            await self._publish((await self._fetch_pose()).pose)
            record.end(GoalState.CANCELLED)

    async def end(self) -> bool:
        """Send the robot to where it is; return whether anybody listens to goals."""
        await self._publish((await self._fetch_pose()).pose)
        if self._current is not None:
            self._current.end(GoalState.CANCELLED)
        return await has_listeners(self._connection, self._topic)

    async def _publish(self, goal: Pose) -> None:
        pose = FramedPose(pose=goal, frame_id=self._map_frame, stamp_s=LATEST_S)
        await self._connection.publish(self._topic, write_pose_stamped(pose, dialect=self._dialect))

    def _stood_for_s(self, place: Point) -> float:
        now_s = self._now_s()
        if self._moved is None or place.distance_to(self._moved[0]) > STANDING_M:
            self._moved = (place, now_s)
        return max(now_s - self._moved[1], 0.0)
