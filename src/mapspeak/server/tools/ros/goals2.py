"""Goals of ROS 2 actions: over the port, and by the latched list of all goals' states."""

import base64
import binascii
from collections.abc import Mapping
from typing import Any

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros import ActionGoal, RosConnection
from mapspeak.ros.messages import Message
from mapspeak.server.tools.ros.commands import RosCommands
from mapspeak.server.tools.ros.jobs import ActionState, Job
from mapspeak.server.tools.ros.pursuing import GONE, NOT_TAKEN, RESULT_LATE, ActionPatience
from mapspeak.server.wording import say_count

__all__ = ["Ros2Pursuer"]

STATES = {
    1: ActionState.ACCEPTED,
    2: ActionState.RUNNING,
    3: ActionState.CANCELLING,
    4: ActionState.SUCCEEDED,
    5: ActionState.CANCELLED,
    6: ActionState.ABORTED,
}
"""action_msgs/GoalStatus."""
CANCEL_ANSWERS = {1: "it refuses", 2: "it knows no such goal", 3: "the goal has ended already"}
"""action_msgs/CancelGoal."""
CANCEL_TYPE, STATUS_TYPE = "action_msgs/srv/CancelGoal", "action_msgs/msg/GoalStatusArray"
RESULT_GONE = "Its result went with the connection."
UNSAID = "The action server ended the goal without saying how."


class _Pursuit:
    """One of our goals, seen from all sides."""

    def __init__(self, job: Job, action: ActionGoal) -> None:
        self.job = job
        self.action = action
        self.ros_id = action.ros_id
        self.ended_s: float | None = None
        self.n_arrays_at_loss: int | None = None
        self.feedback: Message | None = None


class Ros2Pursuer:
    """Pursues goals over the port, and by the latched list of all goals' states.

    Args:
        connection: To listen with.
        commands: To send with.
        action: The action's full name.
        patience: All time limits.
    """

    def __init__(
        self,
        connection: RosConnection,
        commands: RosCommands,
        action: str,
        *,
        patience: ActionPatience,
    ) -> None:
        self._connection = connection
        self._commands = commands
        self._action = action
        self._patience = patience
        self._goals: dict[str, _Pursuit] = {}
        self._statuses: dict[str, ActionState] = {}
        self._seen: set[str] = set()
        self._arrays = connection.subscribe(f"{action}/_action/status", type_name=STATUS_TYPE)
        self._arrays.listen(self._take_statuses)
        if self._arrays.latest is not None:
            self._take_statuses(self._arrays.latest)

    @property
    def listed(self) -> Mapping[str, ActionState]:
        """The goals that the action server knows."""
        return self._statuses

    @property
    def listed_s(self) -> float:
        """When that list came."""
        return self._arrays.arrived_s

    @property
    def handles(self) -> Mapping[str, str]:
        """Our own goals by the server's ids, as far as these are known."""
        return {each.ros_id: handle for handle, each in self._goals.items() if each.ros_id}

    async def wait_for_list(self) -> None:
        """Waits a moment for the goals there are, so that none is taken for ours."""
        try:
            await self._arrays.wait_for_more_than(0, timeout_s=self._patience.listing_s)
        except LinkError:
            return  # An action server without goals need not have said so.

    async def send(self, job: Job, goal: Message) -> None:
        """Sends a job's goal, and waits until it was taken or refused."""
        await self.wait_for_list()
        before = set(self._statuses)
        action = await self._commands.send_goal(self._action, goal, type_name=job.type)
        pursued = _Pursuit(job, action)
        self._goals[job.handle] = pursued
        action.listen(lambda: self._consider(pursued))
        self._claim(pursued, [each for each in self._statuses if each not in before])
        self._consider(pursued)
        try:
            is_taken = await job.wait_until_taken(within_s=self._patience.acceptance_s)
        except anyio.get_cancelled_exc_class():
            # Nobody has the handle of this goal: nobody else could end it.
            self._commands.cancel_goal(action)
            raise
        if not is_taken:
            # It may be taken after all, and we would have said that it was not.
            self._commands.cancel_goal(action)
            self._commands.give_up_goal(action)
            reason = NOT_TAKEN.format(self._patience.acceptance_s)
            job.end(ActionState.REJECTED, reason=reason)

    def look_at(self, job: Job) -> None:
        """Brings a job up to date."""
        pursued = self._goals.get(job.handle)
        if pursued is not None:
            self._consider(pursued)

    async def cancel(self, job: Job) -> None:
        """Cancels one goal: by our id, and by the robot's where that shows no effect."""
        pursued = self._goals.get(job.handle)
        if pursued is None or job.is_over:
            return
        self._commands.cancel_goal(pursued.action)
        if not await job.wait_until_over(within_s=self._patience.end_s) and pursued.ros_id:
            uuid = list(bytes.fromhex(pursued.ros_id))
            await self._call_cancel({"goal_info": {"goal_id": {"uuid": uuid}}})
            await job.wait_until_over(within_s=self._patience.end_s)

    async def cancel_all(self) -> str:
        """Cancels every goal of the action, whoever sent it."""
        return await self._call_cancel({})

    async def _call_cancel(self, arguments: Message) -> str:
        service = f"{self._action}/_action/cancel_goal"
        answer = await self._commands.call(
            service, arguments, type_name=CANCEL_TYPE, timeout_s=self._patience.end_s
        )
        code = answer.get("return_code", 0)
        if code:
            raise LinkError(
                f"{self._action} cancels nothing: {CANCEL_ANSWERS.get(code, f'code {code}')}.",
                hint="Call ros_goal_status for the goals there are.",
            )
        return say_count(len(answer.get("goals_canceling") or []), "goal") + " being cancelled"

    def _take_statuses(self, message: Message) -> None:
        self._statuses = dict(_read_statuses(message))
        fresh = [each for each in self._statuses if each not in self._seen]
        self._seen = set(self._statuses)
        for pursued in self._goals.values():
            if pursued.job.is_over:
                continue
            self._claim(pursued, fresh)
            self._consider(pursued)

    def _claim(self, pursued: _Pursuit, fresh: list[str]) -> None:
        """Takes for ours the goal that appears: rosbridge does not tell the server's id for it."""
        if pursued.ros_id is None and fresh:
            pursued.ros_id = fresh.pop(0)

    def _consider(self, pursued: _Pursuit) -> None:
        """Draws from all that has been heard how a goal stands."""
        job, action = pursued.job, pursued.action
        if action.end is not None:
            self._end_by_result(pursued)
            return
        if action.feedback is not None and action.feedback is not pursued.feedback:
            pursued.feedback = action.feedback
            job.take_feedback(action.feedback)
        if action.is_accepted:
            job.move_on(ActionState.ACCEPTED)
        status = self._statuses.get(pursued.ros_id or "")
        if status is not None and not status.is_final:
            job.move_on(status)
        elif status is not None:
            self._end_by_status(pursued, status)
        if action.is_lost and not job.is_over:
            self._consider_loss(pursued, is_listed=status is not None)

    def _end_by_result(self, pursued: _Pursuit) -> None:
        end = pursued.action.end
        if end is None:
            return
        values = end.values if isinstance(end.values, Mapping) else None
        if not end.is_result:
            said = end.values if isinstance(end.values, str) else ""
            pursued.job.end(ActionState.REJECTED, reason=said or "The action server refused it.")
            return
        # Without a status of its own the result says nothing; the list of all goals may.
        state = STATES.get(end.status or 0) or self._statuses.get(pursued.ros_id or "")
        if state is None or not state.is_final:
            pursued.job.end(ActionState.LOST, reason=UNSAID, result=values)
            return
        pursued.job.end(state, reason=_reason_of(values, state), result=values)

    def _end_by_status(self, pursued: _Pursuit, state: ActionState) -> None:
        now_s = anyio.current_time()
        pursued.ended_s = pursued.ended_s or now_s
        pursued.job.move_on(ActionState.ACCEPTED)
        # The result says why; it follows its status at once unless its connection has gone.
        if pursued.action.is_lost:
            pursued.job.end(state, reason=RESULT_GONE)
        elif now_s - pursued.ended_s > self._patience.result_s:
            pursued.job.end(state, reason=RESULT_LATE)

    def _consider_loss(self, pursued: _Pursuit, *, is_listed: bool) -> None:
        n_arrays = self._arrays.n_received
        if pursued.n_arrays_at_loss is None:
            pursued.n_arrays_at_loss = n_arrays
        has_news = n_arrays > pursued.n_arrays_at_loss
        if has_news and is_listed:
            return
        since_s = self._connection.connected_for_s
        if has_news or (since_s is not None and since_s > self._patience.return_s):
            pursued.job.end(ActionState.LOST, reason=GONE)


def _read_statuses(message: Message) -> list[tuple[str, ActionState]]:
    entries = message.get("status_list")
    read: list[tuple[str, ActionState]] = []
    for entry in entries if isinstance(entries, list) else []:
        try:
            uuid = entry["goal_info"]["goal_id"]["uuid"]
            raw = base64.b64decode(uuid, validate=True) if isinstance(uuid, str) else bytes(uuid)
            read.append((raw.hex(), STATES[entry["status"]]))
        except (KeyError, TypeError, ValueError, binascii.Error):
            continue
    return read


def _reason_of(values: Mapping[str, Any] | None, state: ActionState) -> str:
    if state is ActionState.SUCCEEDED or values is None:
        return ""
    text, code = values.get("error_msg"), values.get("error_code")
    if isinstance(text, str) and text.strip():
        return text
    return f"Its error code is {code}." if isinstance(code, int) and code else ""
