"""Goals for the robot's own navigation, Nav2 or move_base, and the state of each drive.

A robot that takes a pose on a topic does not report on it: its own pose has to tell.
"""

import math
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace

import anyio

from mapspeak.errors import LinkError
from mapspeak.geometry import Pose, wrap_angle
from mapspeak.robot import Cause, CauseCode, GoalState, GoalStatus, StampedPose
from mapspeak.ros.actions import open_action
from mapspeak.ros.activity import ActionGoal, ActionState
from mapspeak.ros.discovery.profile import POSE_STAMPED, RobotProfile
from mapspeak.ros.messages.fields import LATEST_S, Dialect, Message
from mapspeak.ros.messages.poses import FramedPose, read_pose_stamped, write_pose_stamped
from mapspeak.ros.port import RosConnection, has_listeners, new_id


class GoalRecord:
    """A goal that was sent, and how it stands. Once ended, its state stays.

    Attributes:
        goal_id: Ours, used nowhere else.
        sent: As its action's client knows it; None for one on a topic.
        is_replaced: We have sent another goal since.
    """

    def __init__(self, goal: Pose, *, sent: ActionGoal | None = None) -> None:
        self.goal_id = new_id() if sent is None else sent.id
        self.goal = goal
        self.sent = sent
        self.status = GoalStatus(state=GoalState.ACCEPTED)
        self.is_replaced = False

    @property
    def is_over(self) -> bool:
        """True when nothing more will happen."""
        return self.status.state.is_final

    def drive(self, *, distance_left_m: float | None = None, n_recoveries: int = 0) -> None:
        """Note that the robot is on its way."""
        if self.is_over:
            return
        now = self.status
        left_m = now.distance_left_m if distance_left_m is None else distance_left_m
        n_recoveries = max(now.n_recoveries, n_recoveries)
        self.status = replace(
            now, state=GoalState.DRIVING, distance_left_m=left_m, n_recoveries=n_recoveries
        )

    def end(self, state: GoalState, cause: Cause | None = None) -> None:
        """Note how it ended; the first word counts."""
        if self.is_over:
            return
        if self.is_replaced and state in (GoalState.BLOCKED, GoalState.CANCELLED):
            # Navigation tells a replaced goal as aborted or cancelled.
            state, cause = GoalState.PREEMPTED, Cause(code=CauseCode.REPLACED)
        left_m = 0.0 if state is GoalState.ARRIVED else self.status.distance_left_m
        self.status = replace(self.status, state=state, cause=cause, distance_left_m=left_m)


STATE_OF = {
    ActionState.SUCCEEDED: GoalState.ARRIVED,
    ActionState.ABORTED: GoalState.BLOCKED,
    ActionState.CANCELLED: GoalState.CANCELLED,
    ActionState.REJECTED: GoalState.REJECTED,
    ActionState.LOST: GoalState.LOST,
}
REPLACED = "another goal was received"
"""actionlib's words for a goal that gave way, where the number says only that it was ended."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Navigation:
    """A kind of navigation.

    Attributes:
        pose_field: The goal's field for its pose.
        read_feedback: Gives how far is left, and how often it had to try again, for a goal.
        feedback_s: Robot time within which it gives feedback as long as it works.
    """

    title: str
    dialect: Dialect
    type_name: str
    pose_field: str
    read_feedback: Callable[[Message, Pose], tuple[float | None, int]]
    feedback_s: float = 10.0


class ActionDriver:
    """Sends poses to navigation and reads how its goals end.

    Args:
        map_frame: Tells in which frame goals are given.
        on_lost: Called when navigation has gone during a drive; the base is then not stopped.
    """

    def __init__(
        self,
        connection: RosConnection,
        action: str,
        navigation: Navigation,
        *,
        map_frame: Callable[[], str],
        now_s: Callable[[], float],
        on_lost: Callable[[], None],
    ) -> None:
        self._connection = connection
        self._navigation = navigation
        self._map_frame = map_frame
        self._patience = connection.patience
        self._on_lost = on_lost
        self._drives: list[tuple[GoalRecord, ActionGoal]] = []
        self._client = open_action(
            connection, action, dialect=navigation.dialect, type_name=navigation.type_name
        )
        self._client.advertise(connection)
        self._client.ends_others = True
        self._client.expect_feedback(within_s=navigation.feedback_s, now_s=now_s)
        self._client.listeners.append(self._consider_all)

    async def fetch_foreign_goals(self) -> tuple[GoalState, ...]:
        """Return how goals of others stand, by the list of all."""
        await self._client.wait_for_list()
        return tuple(
            GoalState.ACCEPTED if state is ActionState.ACCEPTED else GoalState.DRIVING
            for state in self._client.others.values()
        )

    async def send(self, goal: Pose) -> GoalRecord:
        """Send a goal, and wait until navigation has taken or refused it."""
        before = [(record, sent) for record, sent in self._drives if not record.is_over]
        pose = FramedPose(pose=goal, frame_id=self._map_frame(), stamp_s=LATEST_S)
        written = write_pose_stamped(pose, dialect=self._navigation.dialect)
        sent = await self._client.send(
            {self._navigation.pose_field: written}, through=self._connection
        )
        record = GoalRecord(goal, sent=sent)
        self._drives = [*before, (record, sent)]
        for replaced, _ in before:
            replaced.is_replaced = True
        await self._client.wait_until_taken(sent)
        self._consider(record, sent)
        if sent.state is ActionState.REJECTED:
            for kept, _ in before:
                kept.is_replaced = False
            return record
        with self._client.giving_up(sent), anyio.move_on_after(self._patience.end_s):
            for _, earlier in before:
                await earlier.wait_until_over(within_s=self._patience.end_s)
                self._consider(replaced, earlier)
        return record

    async def look_at(self, record: GoalRecord) -> None:
        """Bring a record up to date."""
        del record
        self._client.look()

    async def cancel(self, record: GoalRecord) -> None:
        """End one goal, and wait a moment for its end."""
        if record.sent is not None and not record.is_over:
            await self._client.cancel(record.sent)
            self._consider(record, record.sent)

    # --- inside

    def _consider_all(self) -> None:
        for record, sent in self._drives:
            self._consider(record, sent)

    def _consider(self, record: GoalRecord, sent: ActionGoal) -> None:
        """Draw from how the action's goal stands how the drive stands."""
        if record.status.afterwards != sent.afterwards:
            record.status = replace(record.status, afterwards=sent.afterwards)
        if record.is_over:
            return
        if sent.feedback is not None:
            left_m, n_recoveries = self._navigation.read_feedback(sent.feedback, record.goal)
            record.drive(distance_left_m=left_m, n_recoveries=n_recoveries)
        elif sent.state in (ActionState.RUNNING, ActionState.CANCELLING):
            record.drive()
        if sent.is_over and not self._may_be_replaced_yet(record, sent):
            record.end(*self._judge_end(record, sent))
            if record.status.state is GoalState.LOST:
                self._on_lost()

    def _may_be_replaced_yet(self, record: GoalRecord, sent: ActionGoal) -> bool:
        """Return True while the list of all goals is late: it may name another client's newer goal.

        The list that shows an aborted goal also shows the goal that replaced it; the result comes
        over another topic or service, and may come first.
        """
        if record.is_replaced or sent.state is not ActionState.ABORTED:
            return False
        listed = self._client.listed.get(sent.server_id or "")
        is_behind = listed is not None and not listed.is_final
        ended_s = anyio.current_time() - (sent.ended_s or 0.0)
        return is_behind and ended_s < self._patience.result_s

    def _judge_end(self, record: GoalRecord, sent: ActionGoal) -> tuple[GoalState, Cause | None]:
        """Return how a drive ended, from the states of its action goal and of others' goals."""
        navigation = self._navigation
        state, code = STATE_OF[sent.state], CauseCode.NAVIGATION_SAID
        if state is GoalState.ARRIVED:
            return state, None
        if sent.is_withdrawn and state is GoalState.REJECTED:
            waited_s = self._patience.acceptance_s
            return state, Cause(code=CauseCode.NOT_TAKEN, name=navigation.title, after_s=waited_s)
        if state is GoalState.REJECTED and navigation.dialect is Dialect.ROS2:
            code = CauseCode.REJECTED
        elif sent.is_withdrawn and state is GoalState.LOST:
            code = CauseCode.NAVIGATION_LOST
        elif state is GoalState.CANCELLED and REPLACED in sent.reason:
            state = GoalState.PREEMPTED
        elif state is GoalState.BLOCKED and not record.is_replaced and self._client.others:
            return GoalState.PREEMPTED, Cause(code=CauseCode.REPLACED_BY_OTHERS)
        elif state is GoalState.BLOCKED and not sent.reason:
            code = CauseCode.NAVIGATION_MUTE
        elif not sent.reason:
            return state, None
        return state, Cause(code=code, name=navigation.title, quote=sent.reason)


def _read_move_base_feedback(feedback: Message, goal: Pose) -> tuple[float | None, int]:
    try:
        here = read_pose_stamped(feedback.get("base_position") or {}).pose
    except LinkError:
        return None, 0
    # move_base does not say how long its path is; the straight line is the least it can be.
    return here.point.distance_to(goal.point), 0


MOVE_BASE = Navigation(
    title="move_base",
    dialect=Dialect.ROS1,
    type_name="move_base_msgs/MoveBase",
    pose_field="target_pose",
    read_feedback=_read_move_base_feedback,
    # It gives none while a recovery turns the robot once round.
    feedback_s=20.0,
)


LARGEST = 1e9
"""No distance and no count is larger; a larger number is not from Nav2."""


def _read_nav2_feedback(feedback: Message, _goal: Pose) -> tuple[float | None, int]:
    left_m = _number(feedback.get("distance_remaining"))
    return left_m, int(_number(feedback.get("number_of_recoveries")) or 0)


def _number(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float) or abs(value) > LARGEST:
        return None
    return None if math.isnan(value) else float(value)


NAV2 = Navigation(
    title="Navigation",
    dialect=Dialect.ROS2,
    type_name="nav2_msgs/action/NavigateToPose",
    pose_field="pose",
    read_feedback=_read_nav2_feedback,
)


ARRIVAL_M = 0.35
"""Nav2 and move_base stop within 0.25 m by default, and the pose may be a step behind."""
ARRIVAL_RAD = 0.35
"""Nav2 stops within 0.25 rad by default."""
STANDING_M = 0.05
STANDING_RAD = 0.05
TURN_S = 5.0
"""A robot that has stood at its goal for this time does not turn any more."""
GIVEN_UP_S = 20.0
"""A robot that has stood still for this time has come as far as it could."""


class GoalTopicDriver:
    """Publishes goals and judges their outcome by the robot's pose.

    Args:
        profile: Returns the robot's interfaces, as far as they have been found.
    """

    def __init__(
        self,
        connection: RosConnection,
        topic: str,
        *,
        profile: Callable[[], RobotProfile],
        fetch_pose: Callable[[], Awaitable[StampedPose]],
        now_s: Callable[[], float],
    ) -> None:
        self._connection = connection
        self._topic = topic
        self._profile = profile
        self._fetch_pose = fetch_pose
        self._now_s = now_s
        self._current: GoalRecord | None = None
        self._moved: tuple[Pose, float] | None = None
        """The last pose in motion, and its time."""
        connection.advertise(topic, type_name=profile().dialect.type_name(POSE_STAMPED))
        connection.started.actions[topic] = self

    @property
    def is_busy(self) -> bool:
        """True while a goal of ours is under way."""
        return self._current is not None and not self._current.is_over

    @property
    def owners(self) -> frozenset[str]:
        """None: the caller ends the drive."""
        return frozenset()

    async def fetch_foreign_goals(self) -> tuple[GoalState, ...]:
        """Return nothing: a topic for goals does not tell their end."""
        return ()

    async def send(self, goal: Pose) -> GoalRecord:
        """Publish a goal, without confirmation."""
        record = GoalRecord(goal)
        self._connection.started.n_begun += 1
        await self._publish(goal, self._profile().map_frame)
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
        here = (await self._fetch_pose()).pose
        left_m = here.point.distance_to(record.goal.point)
        record.drive(distance_left_m=left_m)
        stood_s = self._stood_for_s(here)
        is_turned = abs(wrap_angle(record.goal.yaw_rad - here.yaw_rad)) <= ARRIVAL_RAD
        if left_m <= ARRIVAL_M and stood_s > (0.0 if is_turned else TURN_S):
            record.end(GoalState.ARRIVED)
        elif stood_s > GIVEN_UP_S:
            code = CauseCode.STOOD_STILL
            cause = Cause(code=code, after_s=stood_s, distance_m=left_m)
            # It must not drive on to the goal when that is told as over.
            await self._call_off()
            record.end(GoalState.BLOCKED, cause)

    async def cancel(self, record: GoalRecord) -> None:
        """Send the robot to where it is; it has no other way to end a goal."""
        if not record.is_over and record is self._current:
            await self._call_off()
            record.end(GoalState.CANCELLED)

    async def end(self) -> bool:
        """Send the robot to where it is; return whether anybody listens to goals."""
        await self._call_off()
        if self._current is not None:
            self._current.end(GoalState.CANCELLED)
        return await has_listeners(self._connection, self._topic)

    async def _call_off(self) -> None:
        """Send the robot to where it is, by its own frame where its pose is not known."""
        profile = self._profile()
        try:
            await self._publish((await self._fetch_pose()).pose, profile.map_frame)
        except LinkError:
            await self._publish(Pose(0.0, 0.0), profile.base_frame)

    async def _publish(self, goal: Pose, frame_id: str) -> None:
        framed = FramedPose(pose=goal, frame_id=frame_id, stamp_s=LATEST_S)
        message = write_pose_stamped(framed, dialect=self._profile().dialect)
        await self._connection.publish(self._topic, message)

    def _stood_for_s(self, here: Pose) -> float:
        now_s = self._now_s()
        before, since_s = self._moved or (here, now_s)
        stands = before.is_near(here, off_m=STANDING_M, turn_rad=STANDING_RAD)
        # A clock that was set back has not run backwards.
        if self._moved is None or not stands or now_s < since_s:
            self._moved = before, since_s = here, now_s
        return now_s - since_s
