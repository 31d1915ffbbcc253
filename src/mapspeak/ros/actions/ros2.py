"""Actions of ROS 2: goals over the connection, and the latched list of all goals' states."""

from collections.abc import Iterator, Mapping
from functools import partial

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros.actions.client import GONE, RESULT_LATE, UNSERVED, ActionClient
from mapspeak.ros.activity import ActionEnd, ActionGoal, ActionState
from mapspeak.ros.messages.fields import Message, bytes_of
from mapspeak.ros.port import RosConnection

CANCEL_TYPE, STATUS_TYPE = "action_msgs/srv/CancelGoal", "action_msgs/msg/GoalStatusArray"
REFUSED = 1
ENDED = (2, 3)
"""action_msgs/CancelGoal: the server knows no such goal, or has ended it."""
STATES = {
    1: ActionState.ACCEPTED,
    2: ActionState.RUNNING,
    3: ActionState.CANCELLING,
    4: ActionState.SUCCEEDED,
    5: ActionState.CANCELLED,
    6: ActionState.ABORTED,
}
"""action_msgs/GoalStatus."""
RESULT_GONE = "Its result went with the connection."
UNSAID = "The action server ended the goal without saying how."
SUSPECTED_S = (0.05, 0.05, 0.1, 0.1, 0.2, 0.5, 1.0, 1.0)
"""Between two attempts to find out whether a goal that has appeared is a withdrawn one."""
UNNAMED_S = 0.3
"""How long a goal that may be a withdrawn one may go on, where safety comes first."""
RECENT_S = 60.0
"""How long after a goal's end the list may name it for the first time."""
N_SEEN_KEPT = 1_000


class Ros2ActionClient(ActionClient):
    """Sends goals, and joins the news of them: from the connection, and from the list.

    In ROS 2 itself the server knows a goal by the id that we gave it. rosbridge gives it another,
    and does not tell which: there, the goal that newly appears in the list, and is not over, is
    ours. As long as it may be an older one of ours, which has ended without an id, no newer one
    gets that id: feedback and result tell its state. rosbridge is told again to cancel a withdrawn
    goal by the id it has for it, which touches no other client's; a goal that goes on nevertheless
    is left alone. Only where rosbridge may have forgotten the id, because the connection was lost
    since, or where the robot was told to stop, the goals cannot be told apart for certain, and
    safety comes first: the goal is cancelled, whichever client sent it.
    """

    def __init__(self, connection: RosConnection, action: str, *, type_name: str) -> None:
        statuses = connection.subscribe(f"{action}/_action/status", type_name=STATUS_TYPE)
        super().__init__(connection, action, type_name=type_name, statuses=statuses)
        self._seen: dict[str, int] = {}
        self._n_seen = 0
        self._suspected: set[str] = set()
        statuses.listen(self._take_list)
        if statuses.latest is not None:
            self._take_list(statuses.latest)

    @property
    def others(self) -> Mapping[str, ActionState]:
        """The states of other clients' goals; empty while an unknown one of them is ours."""
        if self._suspected or any(goal.server_id is None for goal in self.open_goals):
            return {}
        return super().others

    async def cancel_all(self, through: RosConnection | None = None) -> int:
        """Cancel every goal of the action, of all clients; return how many there were."""
        connection = through or self._connection
        connection.clear_the_way()
        answer = await self._call_cancel(connection, {})
        return len(answer.get("goals_canceling") or [])

    async def _begin(self, arguments: Message, through: RosConnection) -> ActionGoal:
        n_seen = self._n_seen
        goal = await through.send_goal(self.action, arguments, type_name=self.type_name)
        goal.n_seen = n_seen
        self._keep(goal, through)
        goal.listen(partial(self._hear, goal))
        # The list may have come while the goal was still being sent.
        self._claim(self._seen_since(goal))
        self._hear(goal)
        return goal

    def _ask_to_cancel(self, goal: ActionGoal) -> None:
        goal.through.cancel_goal(goal)
        if goal.is_withdrawn:
            goal.n_lists_at_end = self._list.n_received
            if goal.server_id is None:
                # It may be one of those that could not be told apart until now.
                self._claim(self._seen_since(goal))

    async def _cancel(self, goal: ActionGoal) -> bool:
        if goal.ros_id is None:
            goal.through.cancel_goal(goal)
        if goal.server_id is None:
            return False
        uuid = list(bytes.fromhex(goal.server_id))
        arguments = {"goal_info": {"goal_id": {"uuid": uuid}}}
        answer = await self._call_cancel(goal.through, arguments)
        if answer.get("return_code", 0) == 0 and answer.get("goals_canceling") == []:
            raise self._refusal(REFUSED)
        return answer.get("return_code", 0) in ENDED

    async def _call_cancel(self, through: RosConnection, arguments: Message) -> Message:
        service = f"{self.action}/_action/cancel_goal"
        call = partial(
            through.call_service,
            service,
            arguments,
            type_name=CANCEL_TYPE,
            timeout_s=self._patience.end_s,
        )
        try:
            answer = await call()
        except LinkError:
            # Something before us is stuck in the socket, and that was replaced: once more.
            answer = await call()
        code = answer.get("return_code", 0)
        if code not in (0, *ENDED):
            raise self._refusal(code)
        return answer

    def _refusal(self, code: object) -> LinkError:
        return LinkError(
            f"{self.action} refused to cancel: code {code}.",
            hint="If the robot still moves, stop it by hand.",
        )

    # --- news of goals

    def _hear(self, goal: ActionGoal) -> None:
        """Take in the connection's news of a goal."""
        goal.heard_s = anyio.current_time()
        self._consider(goal)
        self._tell()

    def _look_at(self, goal: ActionGoal) -> None:
        self._consider(goal)
        if goal.is_lost:
            # The connection that brought its feedback is gone; the list goes on.
            goal.silent_s = 0.0
        silent_s = anyio.current_time() - goal.heard_s
        is_sent = goal.state is ActionState.SENT
        if not (is_sent or goal.is_over) and silent_s > self._patience.return_s:
            goal.heard_s = anyio.current_time()
            self._connection.start_soon(partial(self._check_served, goal))

    async def _check_served(self, goal: ActionGoal) -> None:
        """Withdraw a goal whose server is gone: rosbridge does not tell of that."""
        try:
            servers = await self._connection.fetch_publishers(f"{self.action}/_action/status")
        except LinkError:
            return
        if not servers and not goal.is_over:
            self._withdraw(goal, ActionState.LOST, UNSERVED)

    def _take_list(self, message: Message) -> None:
        self._statuses = dict(_read_statuses(message))
        fresh = [each for each in self._statuses if each not in self._seen]
        for server_id in fresh:
            self._seen[server_id] = self._n_seen
            self._n_seen += 1
        for server_id in list(self._seen)[: max(len(self._seen) - N_SEEN_KEPT, 0)]:
            del self._seen[server_id]
        self._claim(fresh)
        self._consider_all()

    def _consider_all(self) -> None:
        for goal in self.goals:
            self._consider(goal)
        self._tell()

    def _consider(self, goal: ActionGoal) -> None:
        """Draw from all that has been heard how a goal stands."""
        status = self._statuses.get(goal.server_id or "")
        if goal.is_withdrawn:
            self._consider_withdrawn(goal, status)
            return
        if goal.end is not None:
            self._end_by_result(goal, goal.end)
            return
        if goal.feedback is not goal.taken_feedback:
            goal.count_feedback()
        if goal.is_accepted:
            goal.move_on(ActionState.ACCEPTED)
        if status is not None and not status.is_final:
            goal.move_on(status)
        elif status is not None:
            self._end_by_list(goal, status)
        if goal.is_lost and not goal.is_over:
            self._consider_loss(goal, is_listed=status is not None)

    def _consider_withdrawn(self, goal: ActionGoal, status: ActionState | None) -> None:
        is_server_gone = goal.is_lost and goal.ros_id is not None
        if goal.end is not None or is_server_gone or (status is not None and status.is_final):
            self._note_server_end(goal)
            return
        is_listed = status is not None and self._list.n_received > goal.n_lists_at_end
        # The earlier acceptance of a lost goal does not show that it is alive.
        is_taken = goal.is_accepted and goal.state is not ActionState.LOST
        if is_taken or is_listed or goal.feedback is not goal.taken_feedback:
            self._note_life(goal)

    def _end_by_result(self, goal: ActionGoal, end: ActionEnd) -> None:
        values = end.values if isinstance(end.values, Mapping) else None
        if not end.is_result:
            said = end.values if isinstance(end.values, str) else ""
            goal.finish(ActionState.REJECTED, reason=said or "The action server refused it.")
            return
        # A result without a status does not tell the end; the list of all goals may.
        state = STATES.get(end.status or 0) or self._statuses.get(goal.server_id or "")
        if state is None or not state.is_final:
            goal.finish(ActionState.LOST, reason=UNSAID, result=values)
        else:
            goal.finish(state, reason=_reason_of(values, state), result=values)

    def _end_by_list(self, goal: ActionGoal, state: ActionState) -> None:
        now_s = anyio.current_time()
        goal.listed_end_s = goal.listed_end_s or now_s
        goal.move_on(ActionState.ACCEPTED)
        # The result says why; it follows its status at once unless its connection has gone.
        if goal.is_lost:
            goal.finish(state, reason=RESULT_GONE)
        elif now_s - goal.listed_end_s > self._patience.result_s:
            goal.finish(state, reason=RESULT_LATE)

    def _consider_loss(self, goal: ActionGoal, *, is_listed: bool) -> None:
        n_lists = self._list.n_received
        if goal.n_lists_at_loss is None:
            goal.n_lists_at_loss = n_lists
        has_news = n_lists > goal.n_lists_at_loss
        if has_news and is_listed:
            return
        since_s = self._connection.connected_for_s
        if has_news or (since_s is not None and since_s > self._patience.return_s):
            self._withdraw(goal, ActionState.LOST, GONE)

    # --- which goal is ours, where only rosbridge knows

    def _seen_since(self, goal: ActionGoal) -> list[str]:
        """Return the listed goals that go on, and were first seen after a goal was sent."""
        return [
            server_id
            for server_id, state in self._statuses.items()
            if not state.is_final and self._seen.get(server_id, -1) >= goal.n_seen
        ]

    def _claim(self, server_ids: list[str]) -> None:
        """Take for ours the goals that have appeared, the oldest first, as far as that is sure."""
        for server_id in server_ids:
            state = self._statuses[server_id]
            if server_id in self.ours or server_id in self._suspected:
                continue
            if state.is_final:
                self._give_to_ended(server_id, state)
            elif self._suspects():
                self._suspected.add(server_id)
                self._connection.start_soon(partial(self._find_out, server_id))
            else:
                self._give_to_open(server_id)

    def _unresolved(self) -> list[ActionGoal]:
        """Return the withdrawn goals that the server may still take under an unknown id."""
        return [goal for goal in self._suspects() if goal.is_withdrawn and not goal.is_settled]

    def _suspects(self) -> list[ActionGoal]:
        """Return our goals that are over, and that the list may still name for the first time."""
        return [
            goal
            for goal in self.goals
            if goal.is_over
            and goal.server_id is None
            and (self._is_recent(goal) or (goal.is_withdrawn and not goal.is_settled))
        ]

    def _is_recent(self, goal: ActionGoal) -> bool:
        heard_s = max(goal.ended_s or 0.0, goal.heard_s)
        return anyio.current_time() - heard_s < RECENT_S

    def _give_to_open(self, server_id: str) -> None:
        """Give an id to a goal under way that was sent before the id was seen."""
        for goal in self.open_goals:
            is_older = goal.n_seen <= self._seen.get(server_id, -1)
            if goal.server_id is None and is_older:
                goal.server_id = server_id
                return

    def _give_to_ended(self, server_id: str, state: ActionState) -> None:
        """Give an id to a goal that has ended in the same way, or was to be cancelled."""
        for goal in self._suspects():
            end = goal.end
            told = STATES.get(end.status or 0) if end is not None else ActionState.CANCELLED
            if told is state and (end is not None or goal.is_withdrawn):
                self._resolve(goal, server_id)
                return

    def _resolve(self, goal: ActionGoal, server_id: str) -> None:
        """Give an id to a goal that is over; other goals that might have had it are then free."""
        goal.server_id = server_id
        self._note_life(goal)
        if not self._suspects():
            for each in self.open_goals:
                self._claim(self._seen_since(each))

    async def _find_out(self, server_id: str) -> None:
        """Cancel a goal that has appeared where it is one of ours that was withdrawn."""
        begun_s = anyio.current_time()
        for pause_s in SUSPECTED_S:
            for goal in self._unresolved():
                goal.through.cancel_goal(goal)
            await anyio.sleep(pause_s)
            state = self._statuses.get(server_id, ActionState.CANCELLED)
            is_late = anyio.current_time() - begun_s > UNNAMED_S
            if state is ActionState.CANCELLING or (is_late and self._is_safety_first()):
                for goal in self._unresolved()[:1]:
                    self._resolve(goal, server_id)
                break
            if state.is_final:
                self._give_to_ended(server_id, state)
                break
        else:
            # No goal goes on for so long that the server has ended.
            if not any(self._is_recent(goal) for goal in self._unresolved()):
                self._give_to_open(server_id)
        self._suspected.discard(server_id)
        self._consider_all()

    def _is_safety_first(self) -> bool:
        """Return True where nothing else would end a goal that may be a withdrawn one."""
        if any(goal.server_id is None for goal in self.open_goals):
            # It may be the one that is wanted, and that is told as under way.
            return False
        return any(
            (goal.state is ActionState.CANCELLED or goal.is_lost) and self._is_recent(goal)
            for goal in self._unresolved()
        )


def _read_statuses(message: Message) -> Iterator[tuple[str, ActionState]]:
    """Yield id and state of each goal of a list; leave out invalid entries."""
    entries = message.get("status_list")
    for entry in entries if isinstance(entries, list) else []:
        try:
            uuid = bytes_of(entry["goal_info"]["goal_id"]["uuid"], "uuid")
            yield uuid.hex(), STATES[entry["status"]]
        except (KeyError, TypeError, LinkError):
            continue


def _reason_of(values: Message | None, state: ActionState) -> str:
    if state is ActionState.SUCCEEDED or values is None:
        return ""
    text, code = values.get("error_msg"), values.get("error_code")
    if isinstance(text, str) and text.strip():
        return text
    return f"Its error code is {code}." if isinstance(code, int) and code else ""
