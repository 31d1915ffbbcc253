"""Goals of ROS 1 actions: an action as five topics, matched by the id we give each goal."""

from collections.abc import Mapping

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros import Listener, RosConnection, Subscription, new_id
from mapspeak.ros.messages import Dialect, Message, write_header, write_stamp
from mapspeak.server.tools.ros.commands import RosCommands
from mapspeak.server.tools.ros.jobs import ActionState, Job
from mapspeak.server.tools.ros.pursuing import GONE, NOT_TAKEN, RESULT_LATE, ActionPatience
from mapspeak.server.wording import say_count

__all__ = ["Ros1Pursuer"]

STATES = {
    0: ActionState.ACCEPTED,
    1: ActionState.RUNNING,
    2: ActionState.CANCELLED,
    3: ActionState.SUCCEEDED,
    4: ActionState.ABORTED,
    5: ActionState.REJECTED,
    6: ActionState.CANCELLING,
    7: ActionState.CANCELLING,
    8: ActionState.CANCELLED,
    9: ActionState.LOST,
}
"""actionlib_msgs/GoalStatus."""


class Ros1Pursuer:
    """Pursues goals by the topics of an action, matched by the id we give each goal.

    Args:
        connection: To listen with.
        commands: To send with.
        action: The action's full name.
        type_name: Such as "move_base_msgs/MoveBase".
        patience: All time limits.
    """

    def __init__(
        self,
        connection: RosConnection,
        commands: RosCommands,
        action: str,
        *,
        type_name: str,
        patience: ActionPatience,
    ) -> None:
        self._connection = connection
        self._commands = commands
        self._action = action
        self._type_name = type_name
        self._patience = patience
        self._jobs: dict[str, Job] = {}
        self._ids: dict[str, str] = {}
        self._statuses: dict[str, ActionState] = {}
        self._ended_s: dict[str, float] = {}
        self._lists = self._listen("status", "actionlib_msgs/GoalStatusArray", self._take_list)
        self._listen("result", f"{type_name}ActionResult", self._take_result)
        self._listen("feedback", f"{type_name}ActionFeedback", self._take_feedback)

    @property
    def listed(self) -> Mapping[str, ActionState]:
        """The goals that the action server knows."""
        return self._statuses

    @property
    def listed_s(self) -> float:
        """When that list came."""
        return self._lists.arrived_s

    @property
    def handles(self) -> Mapping[str, str]:
        """Our own goals by their ids."""
        return {goal_id: handle for handle, goal_id in self._ids.items()}

    async def wait_for_list(self) -> None:
        """Waits a moment for the goals there are."""
        try:
            await self._lists.wait_for_more_than(0, timeout_s=self._patience.listing_s)
        except LinkError:
            return

    async def send(self, job: Job, goal: Message) -> None:
        """Sends a job's goal, and waits until it was taken or refused."""
        await self._commands.prepare(f"{self._action}/cancel", "actionlib_msgs/GoalID")
        await self._commands.prepare(f"{self._action}/goal", f"{self._type_name}ActionGoal")
        goal_id = new_id()
        self._jobs[goal_id], self._ids[job.handle] = job, goal_id
        stamp = write_stamp(0.0, dialect=Dialect.ROS1)
        message = {
            "header": write_header("", 0.0, dialect=Dialect.ROS1),
            "goal_id": {"stamp": stamp, "id": goal_id},
            "goal": goal,
        }
        job.sent_s = anyio.current_time()
        await self._commands.publish(f"{self._action}/goal", message)
        try:
            is_taken = await job.wait_until_taken(within_s=self._patience.acceptance_s)
        except anyio.get_cancelled_exc_class():
            with anyio.CancelScope(shield=True):
                await self._tell_cancel(goal_id)
            raise
        if not is_taken:
            await self._tell_cancel(goal_id)
            reason = NOT_TAKEN.format(self._patience.acceptance_s)
            job.end(ActionState.REJECTED, reason=reason)

    def look_at(self, job: Job) -> None:
        """Brings a job up to date: one whose server has fallen silent is lost."""
        since_s = self._connection.connected_for_s
        if job.is_over or since_s is None or since_s < self._patience.return_s:
            return
        goal_id = self._ids.get(job.handle, "")
        if goal_id in self._ended_s:
            self._end_by_list(goal_id, job, self._statuses.get(goal_id, ActionState.LOST))
        elif anyio.current_time() - self._lists.arrived_s > self._patience.return_s:
            job.end(ActionState.LOST, reason="The action server has fallen silent.")

    async def cancel(self, job: Job) -> None:
        """Cancels one goal and waits a moment for its end."""
        if not job.is_over:
            await self._tell_cancel(self._ids[job.handle])
            await job.wait_until_over(within_s=self._patience.end_s)

    async def cancel_all(self) -> str:
        """Cancels every goal of the action, whoever sent it."""
        await self._commands.prepare(f"{self._action}/cancel", "actionlib_msgs/GoalID")
        await self._tell_cancel("")
        n_live = sum(not state.is_final for state in self._statuses.values())
        return f"{say_count(n_live, 'goal')} being cancelled"

    async def _tell_cancel(self, goal_id: str) -> None:
        stamp = write_stamp(0.0, dialect=Dialect.ROS1)
        message = {"stamp": stamp, "id": goal_id}
        await self._commands.tell_everywhere(f"{self._action}/cancel", message)

    def _listen(self, topic: str, type_name: str, take: Listener) -> Subscription:
        subscription = self._connection.subscribe(f"{self._action}/{topic}", type_name=type_name)
        subscription.listen(take)
        return subscription

    def _take_list(self, message: Message) -> None:
        self._statuses = {}
        entries = message.get("status_list")
        for entry in entries if isinstance(entries, list) else []:
            goal_id, state, text = _read_status(entry)
            if state is not None:
                self._statuses[goal_id] = state
                self._take_state(goal_id, state, text)
        for goal_id, job in self._jobs.items():
            is_known = job.state is not ActionState.SENT
            if is_known and not job.is_over and goal_id not in self._statuses:
                # actionlib lists a goal until five seconds after its end.
                job.end(ActionState.LOST, reason=GONE)

    def _take_state(self, goal_id: str, state: ActionState, text: str) -> None:
        job = self._jobs.get(goal_id)
        if job is None or job.is_over:
            return
        if state.is_final:
            job.reason = text
            self._end_by_list(goal_id, job, state)
        else:
            job.move_on(state)

    def _end_by_list(self, goal_id: str, job: Job, state: ActionState) -> None:
        """Ends a job by the list, once its result has had time to come."""
        now_s = anyio.current_time()
        job.move_on(ActionState.ACCEPTED)
        if now_s - self._ended_s.setdefault(goal_id, now_s) > self._patience.result_s:
            said = [f"{part.rstrip('.')}." for part in (job.reason, RESULT_LATE) if part]
            job.end(state, reason=" ".join(said))

    def _take_result(self, message: Message) -> None:
        goal_id, state, text = _read_status(message.get("status"))
        job = self._jobs.get(goal_id)
        result = message.get("result")
        if job is not None and state is not None:
            values = result if isinstance(result, Mapping) else None
            job.end(state, reason=text, result=values)

    def _take_feedback(self, message: Message) -> None:
        goal_id, _, _ = _read_status(message.get("status"))
        job, feedback = self._jobs.get(goal_id), message.get("feedback")
        if job is not None and isinstance(feedback, Mapping):
            job.take_feedback(feedback)


def _read_status(entry: object) -> tuple[str, ActionState | None, str]:
    """Gives goal, state and text of an actionlib_msgs/GoalStatus; what is none has no state."""
    goal = entry.get("goal_id") if isinstance(entry, Mapping) else None
    goal_id = goal.get("id") if isinstance(goal, Mapping) else None
    if not isinstance(entry, Mapping) or not isinstance(goal_id, str):
        return "", None, ""
    code = entry.get("status")
    state = STATES.get(code) if isinstance(code, int) else None
    return goal_id, state, str(entry.get("text", ""))
