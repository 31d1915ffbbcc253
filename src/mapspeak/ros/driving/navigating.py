"""Driving by an action of the robot's navigation: what a pose means as its goal, and its end."""

from collections.abc import Callable
from dataclasses import dataclass

import anyio

from mapspeak.geometry import Pose
from mapspeak.robot import GoalState
from mapspeak.ros import RosConnection
from mapspeak.ros.actions import ActionState, SentGoal, open_action
from mapspeak.ros.driving.driver import LATEST_S, DrivingPatience
from mapspeak.ros.driving.record import GoalRecord
from mapspeak.ros.messages import Dialect, FramedPose, Message

STATE_OF = {
    ActionState.SUCCEEDED: GoalState.ARRIVED,
    ActionState.ABORTED: GoalState.BLOCKED,
    ActionState.CANCELLED: GoalState.CANCELLED,
    ActionState.REJECTED: GoalState.REJECTED,
    ActionState.LOST: GoalState.LOST,
}
REPLACED = "another goal was received"
"""actionlib's words for a goal that gave way, where the number says only that it was ended."""
RESTARTED = "{} hangs, or it or the robot was restarted, or has ended. {}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Navigation:
    """A kind of navigation.

    Attributes:
        title: What it is called.
        dialect: Its ROS.
        type_name: Of its action.
        write_goal: Gives the goal's fields for a pose.
        read_feedback: Gives how far is left, and how often it had to try again, for a goal.
        hint: What to check when it does not answer.
        feedback_s: Robot time within which it gives feedback as long as it works.
    """

    title: str
    dialect: Dialect
    type_name: str
    write_goal: Callable[[FramedPose], Message]
    read_feedback: Callable[[Message, Pose], tuple[float | None, int]]
    hint: str
    feedback_s: float = 10.0


@dataclass(slots=True, kw_only=True, eq=False)
class _Drive:
    """A goal as the action client knows it, and as the robot's port tells it."""

    sent: SentGoal
    record: GoalRecord


class ActionDriver:
    """Sends poses to navigation and reads how its goals end.

    Args:
        connection: Connected to the robot.
        action: Its full name, such as /navigate_to_pose.
        navigation: Which kind it is.
        map_frame: In which goals are given.
        patience: All time limits.
        now_s: Tells robot time.
        on_lost: Called when navigation has gone under a drive; nobody stops the base then.
    """

    def __init__(
        self,
        connection: RosConnection,
        action: str,
        navigation: Navigation,
        *,
        map_frame: str,
        patience: DrivingPatience,
        now_s: Callable[[], float],
        on_lost: Callable[[], None] = lambda: None,
    ) -> None:
        self._connection = connection
        self._navigation = navigation
        self._map_frame = map_frame
        self._patience = patience
        self._on_lost = on_lost
        self._drives: dict[str, _Drive] = {}
        self._client = open_action(
            connection,
            action,
            dialect=navigation.dialect,
            type_name=navigation.type_name,
            patience=patience,
        )
        self._client.advertise(connection)
        self._client.ends_others = True
        self._client.expect_feedback(within_s=navigation.feedback_s, now_s=now_s)
        self._client.listeners.append(self._consider_all)

    @property
    def foreign_goals(self) -> tuple[GoalState, ...]:
        """How goals of others stand, by the list of all."""
        return tuple(
            GoalState.ACCEPTED if state is ActionState.ACCEPTED else GoalState.DRIVING
            for state in self._client.others.values()
        )

    async def send(self, goal: Pose) -> GoalRecord:
        """Send a goal, and wait until navigation has taken or refused it."""
        before = [drive for drive in self._drives.values() if not drive.record.is_over]
        pose = FramedPose(pose=goal, frame_id=self._map_frame, stamp_s=LATEST_S)
        goal_fields = self._navigation.write_goal(pose)
        sent = await self._client.send(goal_fields, through=self._connection)
        drive = _Drive(sent=sent, record=GoalRecord(sent.id, goal))
        self._drives = {each.sent.id: each for each in [*before, drive]}
        for each in before:
            each.record.is_replaced = True
        await self._client.wait_until_taken(sent)
        self._consider(drive)
        with anyio.move_on_after(self._patience.end_s):
            for each in before:
                await each.sent.wait_until_over(within_s=self._patience.end_s)
                self._consider(each)
        return drive.record

    async def look_at(self, record: GoalRecord) -> None:
        """Bring a record up to date."""
        del record
        self._client.look()

    async def cancel(self, record: GoalRecord) -> None:
        """End one goal, and wait a moment for its end."""
        drive = self._drives.get(record.goal_id)
        if drive is not None and not record.is_over:
            await self._client.cancel(drive.sent)
            self._consider(drive)

    # --- inside

    def _consider_all(self) -> None:
        for drive in self._drives.values():
            self._consider(drive)

    def _consider(self, drive: _Drive) -> None:
        """Draw from how the action's goal stands how the drive stands."""
        sent, record = drive.sent, drive.record
        record.afterwards = sent.afterwards
        if record.is_over:
            return
        if sent.feedback is not None:
            left_m, n_recoveries = self._navigation.read_feedback(sent.feedback, record.goal)
            record.drive(distance_left_m=left_m, n_recoveries=n_recoveries)
        elif sent.state in (ActionState.RUNNING, ActionState.CANCELLING):
            record.drive()
        if sent.is_over and not self._may_be_replaced_yet(drive):
            self._end(drive)

    def _may_be_replaced_yet(self, drive: _Drive) -> bool:
        """True while the list of all goals, which may name a newer one of others, is behind.

        Of a goal that was aborted, the list that says so shows what replaced it; the result comes
        another way, and may come first.
        """
        sent = drive.sent
        if drive.record.is_replaced or sent.state is not ActionState.ABORTED:
            return False
        listed = self._client.listed.get(sent.server_id or "")
        is_behind = listed is not None and not listed.is_final
        ended_s = anyio.current_time() - (sent.ended_s or 0.0)
        return is_behind and ended_s < self._patience.result_s

    def _end(self, drive: _Drive) -> None:
        sent, record, navigation = drive.sent, drive.record, self._navigation
        state, reason = STATE_OF[sent.state], sent.reason
        is_unanswered = sent.is_withdrawn and state is GoalState.REJECTED
        if state is GoalState.ARRIVED:
            reason = ""
        elif is_unanswered:
            reason = (
                f"{navigation.title} gave no sign of taking the goal within "
                f"{self._patience.acceptance_s:g} s: it was withdrawn, and is cancelled should it "
                f"be taken later. {navigation.hint}"
            )
        elif state is GoalState.REJECTED and navigation.dialect is Dialect.ROS2:
            reason = f"{navigation.title} rejected the goal. {reason}"
        elif sent.is_withdrawn and state is GoalState.LOST:
            reason = f"{reason} {RESTARTED.format(navigation.title, navigation.hint)}"
        elif state is GoalState.CANCELLED and REPLACED in reason:
            state = GoalState.PREEMPTED
        elif state is GoalState.BLOCKED and not record.is_replaced and self._client.others:
            state, reason = GoalState.PREEMPTED, "Another client sent a newer goal."
        elif state is GoalState.BLOCKED and not reason:
            reason = f"{navigation.title} gave up and did not say why."
        record.end(state, reason, is_unanswered=is_unanswered)
        if state is GoalState.LOST:
            self._on_lost()
