"""Goals of Nav2: the action NavigateToPose of ROS 2."""

import base64
import binascii
import math
from dataclasses import dataclass
from typing import Any

import anyio

from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.links.ros.driving.driver import LATEST_S, DrivingPatience
from mapspeak.links.ros.driving.record import GoalRecord, wait_for_ends
from mapspeak.robot import GoalState
from mapspeak.ros import ActionGoal, RosConnection
from mapspeak.ros.messages import Dialect, FramedPose, Message, write_pose_stamped

ACTION_TYPE = "nav2_msgs/action/NavigateToPose"
STATUS_TYPE = "action_msgs/msg/GoalStatusArray"
CANCEL_TYPE = "action_msgs/srv/CancelGoal"
ACCEPTED, EXECUTING, CANCELING, SUCCEEDED, CANCELED, ABORTED = 1, 2, 3, 4, 5, 6
"""action_msgs/GoalStatus."""
LARGEST = 1e9
"""No distance and no count is larger; what is, is no number of Nav2's."""
LIVE = (ACCEPTED, EXECUTING, CANCELING)
STATE_OF = {
    SUCCEEDED: GoalState.ARRIVED,
    CANCELED: GoalState.CANCELLED,
    ABORTED: GoalState.BLOCKED,
}
NO_REFUSAL = (0, 3)
"""action_msgs/CancelGoal: none, and a goal that has ended already."""
NAV2_HINT = (
    "Check that Nav2 is active (`ros2 lifecycle get /bt_navigator`), that the robot knows where it "
    "is, and that the goal lies on the map."
)


@dataclass(slots=True, eq=False)
class _Pursuit:
    """One of our goals, seen from all sides."""

    record: GoalRecord
    action: ActionGoal
    ros_id: str | None = None
    ended_s: float | None = None
    n_arrays_at_loss: int | None = None


class Nav2Driver:
    """Sends goals to Nav2 and keeps what it says of them.

    The result comes over the socket that sent the goal; when that is lost, the latched list of all
    goals' states tells how it ended.

    Args:
        connection: Connected to the robot.
        action: Such as /navigate_to_pose.
        map_frame: In which goals are given.
        patience: All time limits.
    """

    def __init__(
        self,
        connection: RosConnection,
        action: str,
        *,
        map_frame: str,
        patience: DrivingPatience,
    ) -> None:
        self._connection = connection
        self._action = action
        self._map_frame = map_frame
        self._patience = patience
        self._pursuits: dict[str, _Pursuit] = {}
        self._statuses: dict[str, int] = {}
        self._seen: set[str] = set()
        self._arrays = connection.subscribe(f"{action}/_action/status", type_name=STATUS_TYPE)
        self._arrays.listen(self._take_statuses)

    @property
    def foreign_goals(self) -> tuple[GoalState, ...]:
        """How goals of others stand; nothing while it is unknown which of them is ours."""
        going = [each for each in self._pursuits.values() if not each.record.is_over]
        if any(each.ros_id is None for each in going):
            return ()
        return tuple(
            GoalState.ACCEPTED if self._statuses[ros_id] == ACCEPTED else GoalState.DRIVING
            for ros_id in self._foreign_ids()
        )

    async def send(self, goal: Pose) -> GoalRecord:
        """Sends a goal, and waits until the robot has taken or refused it."""
        self._pursuits = {
            goal_id: each for goal_id, each in self._pursuits.items() if not each.record.is_over
        }
        before = list(self._pursuits.values())
        pose = FramedPose(pose=goal, frame_id=self._map_frame, stamp_s=LATEST_S)
        arguments = {"pose": write_pose_stamped(pose, dialect=Dialect.ROS2), "behavior_tree": ""}
        action = await self._connection.send_goal(self._action, arguments, type_name=ACTION_TYPE)
        pursuit = _Pursuit(GoalRecord(action.goal_id, goal), action, ros_id=action.ros_id)
        self._pursuits[action.goal_id] = pursuit
        action.listen(lambda: self._consider(pursuit))
        for each in before:
            each.record.is_replaced = True
        await self._wait_for_acceptance(pursuit)
        await self._wait_for_end([each.record for each in before])
        return pursuit.record

    async def look_at(self, record: GoalRecord) -> None:
        """Brings a record up to date."""
        pursuit = self._pursuits.get(record.goal_id)
        if pursuit is not None:
            self._consider(pursuit)

    async def cancel(self, record: GoalRecord) -> None:
        """Cancels one goal: by our id, and by the robot's where that shows no effect."""
        pursuit = self._pursuits.get(record.goal_id)
        if pursuit is None or record.is_over:
            return
        self._connection.cancel_goal(pursuit.action)
        await self._wait_for_end([record])
        if pursuit.ros_id is not None and not record.status.state.is_final:
            uuid = list(bytes.fromhex(pursuit.ros_id))
            await self._call_cancel({"goal_info": {"goal_id": {"uuid": uuid}}})
            await self._wait_for_end([record])

    async def cancel_all(self) -> None:
        """Cancels every goal, whoever sent it."""
        going = [each for each in self._pursuits.values() if not each.record.is_over]
        self._connection.clear_the_way()
        for each in going:
            self._connection.cancel_goal(each.action)
        await self._call_cancel({})
        await self._wait_for_end([each.record for each in going])

    async def _call_cancel(self, arguments: dict[str, Any]) -> None:
        service = f"{self._action}/_action/cancel_goal"
        try:
            answer = await self._connection.call_service(
                service, arguments, type_name=CANCEL_TYPE, timeout_s=self._patience.end_s
            )
        except LinkError:
            # Something before us is stuck in the socket, and that was replaced: once more.
            answer = await self._connection.call_service(
                service, arguments, type_name=CANCEL_TYPE, timeout_s=self._patience.end_s
            )
        if answer.get("return_code", 0) not in NO_REFUSAL:
            raise LinkError(
                f"The robot's navigation refused to cancel: code {answer.get('return_code')}.",
                hint="If the robot still moves, stop it by hand.",
            )

    async def _wait_for_acceptance(self, pursuit: _Pursuit) -> None:
        record = pursuit.record
        try:
            await record.wait_for_acceptance(within_s=self._patience.acceptance_s)
        except anyio.get_cancelled_exc_class():
            # Nobody has the id of this goal: nobody else could end it.
            self._connection.cancel_goal(pursuit.action)
            raise
        if not (record.is_accepted or record.is_over):
            # It may be taken after all, and we would have said that it was not.
            self._connection.cancel_goal(pursuit.action)
            self._connection.give_up_goal(pursuit.action)
            record.end(
                GoalState.REJECTED,
                f"Navigation gave no sign of taking the goal within "
                f"{self._patience.acceptance_s:g} s. {NAV2_HINT}",
            )

    async def _wait_for_end(self, records: list[GoalRecord]) -> None:
        await wait_for_ends(records, within_s=self._patience.end_s)

    def _take_statuses(self, message: Message) -> None:
        self._statuses = dict(_read_statuses(message))
        fresh = [
            ros_id
            for ros_id, status in self._statuses.items()
            if ros_id not in self._seen and status in LIVE
        ]
        self._seen = set(self._statuses)
        for pursuit in self._pursuits.values():
            if pursuit.record.is_over:
                continue
            if pursuit.ros_id is None and fresh:
                # The server does not tell its id for our goal: it is the one that appears now.
                pursuit.ros_id = fresh.pop(0)
            self._consider(pursuit)

    def _consider(self, pursuit: _Pursuit) -> None:
        """Draws from all that has been heard how a goal stands."""
        record, action = pursuit.record, pursuit.action
        if record.is_over:
            return
        if action.end is not None:
            if not self._may_be_replaced_yet(pursuit, action.end.status):
                self._end_by_result(pursuit)
            return
        if action.is_accepted and not record.is_accepted:
            record.accept()
        if action.feedback is not None and not action.is_lost:
            record.drive(
                distance_left_m=_number(action.feedback.get("distance_remaining")),
                n_recoveries=_count(action.feedback.get("number_of_recoveries")),
            )
        self._consider_status(pursuit)
        if action.is_lost and not record.is_over:
            self._consider_loss(pursuit, self._arrays.n_received)

    def _consider_status(self, pursuit: _Pursuit) -> None:
        status = self._statuses.get(pursuit.ros_id or "")
        if status in LIVE:
            if status == ACCEPTED:
                pursuit.record.accept()
            else:
                pursuit.record.drive()
        elif status in STATE_OF:
            pursuit.record.accept()
            now_s = anyio.current_time()
            pursuit.ended_s = pursuit.ended_s or now_s
            # The result says why; it follows its status at once unless its socket has gone.
            if pursuit.action.is_lost or now_s - pursuit.ended_s > self._patience.result_s:
                self._end_by_status(pursuit, status, reason="")

    def _consider_loss(self, pursuit: _Pursuit, n_arrays: int) -> None:
        if pursuit.n_arrays_at_loss is None:
            pursuit.n_arrays_at_loss = n_arrays
        since_s = self._connection.connected_for_s
        has_news = n_arrays > pursuit.n_arrays_at_loss
        if has_news and pursuit.ros_id in self._statuses:
            return
        if has_news or (since_s is not None and since_s > self._patience.return_s):
            pursuit.record.end(
                GoalState.LOST,
                "The connection was lost during the drive, and navigation does not know the goal "
                "any more: it or the robot was restarted.",
            )

    def _may_be_replaced_yet(self, pursuit: _Pursuit, status: int | None) -> bool:
        """True while the list of all goals, which may name a newer one of others, is behind.

        Of a goal that was aborted, the list that says so shows what replaced it; the result comes
        another way, and may come first.
        """
        if pursuit.record.is_replaced:
            return False
        if status != ABORTED or self._statuses.get(pursuit.ros_id or "") not in LIVE:
            return False
        now_s = anyio.current_time()
        pursuit.ended_s = pursuit.ended_s or now_s
        return now_s - pursuit.ended_s < self._patience.result_s

    def _end_by_result(self, pursuit: _Pursuit) -> None:
        end = pursuit.action.end
        if end is None:
            return
        if not end.is_result:
            said = end.values if isinstance(end.values, str) and end.values else NAV2_HINT
            pursuit.record.end(GoalState.REJECTED, f"Navigation rejected the goal. {said[:300]}")
            return
        values = end.values if isinstance(end.values, dict) else {}
        # Without a status of its own the result says nothing; the list of all goals may.
        status = end.status or self._statuses.get(pursuit.ros_id or "")
        self._end_by_status(pursuit, status, reason=_reason_of(values))

    def _end_by_status(self, pursuit: _Pursuit, status: int | None, *, reason: str) -> None:
        state = STATE_OF.get(status or 0, GoalState.LOST)
        if state is GoalState.ARRIVED:
            reason = ""
        elif state is GoalState.LOST:
            reason = "Navigation ended the goal without saying how: look where the robot is."
        elif state is GoalState.BLOCKED and self._is_replaced_by_others(pursuit):
            state, reason = GoalState.PREEMPTED, "Another client sent a newer goal."
        elif state is GoalState.BLOCKED and not reason:
            reason = "Navigation gave up and did not say why."
        pursuit.record.end(state, reason)

    def _is_replaced_by_others(self, pursuit: _Pursuit) -> bool:
        is_known = pursuit.ros_id is not None and not pursuit.record.is_replaced
        return is_known and bool(self._foreign_ids())

    def _foreign_ids(self) -> list[str]:
        ours = {each.ros_id for each in self._pursuits.values()}
        return [
            ros_id
            for ros_id, status in self._statuses.items()
            if status in LIVE and ros_id not in ours
        ]


def _read_statuses(message: Message) -> list[tuple[str, int]]:
    """Gives id and status of each goal; what is none is left away."""
    entries = message.get("status_list")
    read: list[tuple[str, int]] = []
    for entry in entries if isinstance(entries, list) else []:
        try:
            ros_id = _hex_of(entry["goal_info"]["goal_id"]["uuid"])
            read.append((ros_id, _count(entry["status"])))
        except (KeyError, TypeError, ValueError):
            continue
    return read


def _hex_of(uuid: Any) -> str:  # noqa: ANN401 - ROS JSON enters here
    """Gives the 16 bytes of an id as text: they come as a list, as base64 or as bytes."""
    if isinstance(uuid, str):
        try:
            return base64.b64decode(uuid, validate=True).hex()
        except binascii.Error as error:
            raise ValueError from error
    if not isinstance(uuid, bytes | list):
        raise TypeError
    return bytes(uuid).hex()


def _number(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float) or abs(value) > LARGEST:
        return None
    return None if math.isnan(value) else float(value)


def _count(value: object) -> int:
    return int(_number(value) or 0)


def _reason_of(values: dict[str, Any]) -> str:
    text, code = values.get("error_msg"), values.get("error_code")
    if isinstance(text, str) and text.strip():
        return " ".join(text.split())[:300]
    return f"Navigation's error code is {code}." if isinstance(code, int) and code else ""
