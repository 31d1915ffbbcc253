"""Goals of move_base (ROS 1): an action as five topics, matched by the id we give each goal."""

import anyio

from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.links.ros.driving.driver import LATEST_S, DrivingPatience
from mapspeak.links.ros.driving.record import GoalRecord, wait_for_ends
from mapspeak.robot import GoalState
from mapspeak.ros import RosConnection, new_id
from mapspeak.ros.messages import (
    Dialect,
    FramedPose,
    Message,
    read_pose_stamped,
    write_header,
    write_pose_stamped,
    write_stamp,
)

GOAL_TYPE = "move_base_msgs/MoveBaseActionGoal"
CANCEL_TYPE = "actionlib_msgs/GoalID"
RESULT_TYPE = "move_base_msgs/MoveBaseActionResult"
FEEDBACK_TYPE = "move_base_msgs/MoveBaseActionFeedback"
STATUS_TYPE = "actionlib_msgs/GoalStatusArray"
PENDING, ACTIVE, PREEMPTED, SUCCEEDED, ABORTED, REJECTED = 0, 1, 2, 3, 4, 5
PREEMPTING, RECALLING, RECALLED, LOST = 6, 7, 8, 9
"""actionlib_msgs/GoalStatus."""
LIVE = (PENDING, ACTIVE, PREEMPTING, RECALLING)
STATE_OF = {
    PREEMPTED: GoalState.CANCELLED,
    SUCCEEDED: GoalState.ARRIVED,
    ABORTED: GoalState.BLOCKED,
    REJECTED: GoalState.REJECTED,
    RECALLED: GoalState.CANCELLED,
    LOST: GoalState.LOST,
}
REPLACED = "another goal was received"
"""actionlib's words for a goal that gave way, where the number says only that it was ended."""
MOVE_BASE_HINT = "Check that move_base runs and that the robot knows where it is."


class MoveBaseDriver:
    """Sends goals to move_base and keeps what its topics say of them.

    Args:
        connection: Connected to the robot.
        name: Of the action, such as /move_base.
        map_frame: In which goals are given.
        patience: All time limits.
    """

    def __init__(
        self,
        connection: RosConnection,
        name: str,
        *,
        map_frame: str,
        patience: DrivingPatience,
    ) -> None:
        self._connection = connection
        self._name = name
        self._map_frame = map_frame
        self._patience = patience
        self._records: dict[str, GoalRecord] = {}
        self._foreign: list[GoalState] = []
        connection.advertise(f"{name}/goal", type_name=GOAL_TYPE)
        connection.advertise(f"{name}/cancel", type_name=CANCEL_TYPE)
        self._lists = connection.subscribe(f"{name}/status", type_name=STATUS_TYPE)
        self._lists.listen(self._take_statuses)
        results = connection.subscribe(f"{name}/result", type_name=RESULT_TYPE)
        results.listen(self._take_one)
        feedback = connection.subscribe(f"{name}/feedback", type_name=FEEDBACK_TYPE)
        feedback.listen(self._take_feedback)

    @property
    def foreign_goals(self) -> tuple[GoalState, ...]:
        """How goals of others stand, by the list of all."""
        return tuple(self._foreign)

    async def send(self, goal: Pose) -> GoalRecord:
        """Sends a goal, and waits until move_base has taken or refused it."""
        self._records = {
            goal_id: each for goal_id, each in self._records.items() if not each.is_over
        }
        before = list(self._records.values())
        record = GoalRecord(new_id(), goal)
        self._records[record.goal_id] = record
        await self._connection.publish(f"{self._name}/goal", self._write_goal(record))
        for each in before:
            each.is_replaced = True
        try:
            await record.wait_for_acceptance(within_s=self._patience.acceptance_s)
        except anyio.get_cancelled_exc_class():
            # Nobody has the id of this goal: nobody else could end it.
            self._cancel_everywhere(record.goal_id)
            raise
        if not record.is_accepted:
            # It may be taken after all, and we would have said that it was not.
            self._cancel_everywhere(record.goal_id)
            record.end(
                GoalState.REJECTED,
                f"move_base gave no sign of taking the goal within "
                f"{self._patience.acceptance_s:g} s. {MOVE_BASE_HINT}",
            )
        await self._wait_for_end(before)
        return record

    async def look_at(self, record: GoalRecord) -> None:
        """Brings a record up to date: a goal that move_base no longer lists is lost."""
        since_s = self._connection.connected_for_s
        if record.is_over or since_s is None or since_s < self._patience.return_s:
            return
        silent_s = anyio.current_time() - self._lists.arrived_s
        if silent_s > self._patience.return_s:
            record.end(
                GoalState.LOST,
                f"move_base has said nothing for {silent_s:.0f} s. {MOVE_BASE_HINT}",
            )

    async def cancel(self, record: GoalRecord) -> None:
        """Cancels one goal and waits for its end."""
        if not record.is_over:
            stamp = write_stamp(LATEST_S, dialect=Dialect.ROS1)
            message = {"stamp": stamp, "id": record.goal_id}
            await self._connection.publish(f"{self._name}/cancel", message)
            await self._wait_for_end([record])

    async def cancel_all(self) -> None:
        """Cancels every goal, whoever sent it."""
        if self._cancel_everywhere("") == 0:
            raise LinkError(
                "The robot could not be told to stop: there is no connection.",
                hint="Stop it by hand. The connection is made anew by itself.",
            )
        await self._wait_for_end([each for each in self._records.values() if not each.is_over])

    def _cancel_everywhere(self, goal_id: str) -> int:
        """Cancels one goal, or with an empty id all of them; gives over how many sockets."""
        stamp = write_stamp(LATEST_S, dialect=Dialect.ROS1)
        message = {"stamp": stamp, "id": goal_id}
        return self._connection.publish_everywhere(f"{self._name}/cancel", message)

    def _write_goal(self, record: GoalRecord) -> Message:
        pose = FramedPose(pose=record.goal, frame_id=self._map_frame, stamp_s=LATEST_S)
        return {
            "header": write_header("", LATEST_S, dialect=Dialect.ROS1),
            "goal_id": {
                "stamp": write_stamp(LATEST_S, dialect=Dialect.ROS1),
                "id": record.goal_id,
            },
            "goal": {"target_pose": write_pose_stamped(pose, dialect=Dialect.ROS1)},
        }

    async def _wait_for_end(self, records: list[GoalRecord]) -> None:
        await wait_for_ends(records, within_s=self._patience.end_s)

    def _take_statuses(self, message: Message) -> None:
        entries = message.get("status_list")
        listed = [self._take_status(entry) for entry in _as_list(entries)]
        self._foreign = [
            GoalState.ACCEPTED if entry.get("status") == PENDING else GoalState.DRIVING
            for entry, record in zip(_as_list(entries), listed, strict=True)
            if record is None and isinstance(entry, dict) and entry.get("status") in LIVE
        ]
        for record in self._records.values():
            if record.is_accepted and not record.is_over and record not in listed:
                # actionlib lists a goal until five seconds after its end.
                record.end(GoalState.LOST, "move_base does not know the goal: it was restarted.")

    def _take_one(self, message: Message) -> None:
        self._take_status(message.get("status"))

    def _take_status(self, status: object) -> GoalRecord | None:
        record = self._find(status)
        if record is None or not isinstance(status, dict):
            return None
        code, text = status.get("status"), str(status.get("text", ""))[:300]
        if not isinstance(code, int):
            return record
        if code == PENDING:
            record.accept()
        elif code in LIVE:
            record.drive()
        elif code in STATE_OF:
            record.accept()
            state = STATE_OF[code]
            if state is GoalState.CANCELLED and REPLACED in text:
                state = GoalState.PREEMPTED
            record.end(state, "" if state is GoalState.ARRIVED else text)
        return record

    def _take_feedback(self, message: Message) -> None:
        record = self._find(message.get("status"))
        feedback = message.get("feedback")
        if record is None or not isinstance(feedback, dict):
            return
        try:
            here = read_pose_stamped(feedback.get("base_position") or {}).pose
        except LinkError:
            return
        # move_base does not say how long its path is; the straight line is the least it can be.
        record.drive(distance_left_m=here.point.distance_to(record.goal.point))

    def _find(self, status: object) -> GoalRecord | None:
        """Gives our goal that a status is about; None where it is another client's."""
        goal_id = status.get("goal_id") if isinstance(status, dict) else None
        own_id = goal_id.get("id") if isinstance(goal_id, dict) else None
        return self._records.get(own_id) if isinstance(own_id, str) else None


def _as_list(value: object) -> list[object]:
    return value if isinstance(value, list) else []
