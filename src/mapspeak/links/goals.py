"""Goals of actions, as members of a ROS 2 network send them.

An action is three services and two topics. Where answers do not name their request, messages with
the goal's id count: the list of all goals' states, and feedback.
"""

from collections.abc import Callable, Coroutine, Mapping
from functools import partial
from typing import Any, Protocol

from mapspeak.errors import LinkError
from mapspeak.links.endpoints import Sample
from mapspeak.ros.activity import REFUSED, ActionEnd, ActionGoal, News
from mapspeak.ros.messages.fields import Message
from mapspeak.ros.port import new_id

Answer = dict[str, Any]


class ServiceClient(Protocol):
    """The client of one service.

    Attributes:
        type_name: As "package/srv/Type".
        on_answer: Called with every answer to `post`, and the number of its request; 0 where
            unknown.
    """

    service: str
    type_name: str
    on_answer: Callable[[int, Answer], None] | None

    @property
    def tells_whom(self) -> bool:
        """True when answers say whose request they answer."""
        ...

    async def wait_for_server(self, *, timeout_s: float) -> None:
        """Return when the requests have a reader."""
        ...

    def encode(self, arguments: Mapping[str, Any]) -> bytes:
        """Return a request."""
        ...

    async def call(self, request: bytes, *, timeout_s: float) -> Sample:
        """Return the service's answer to a request from `encode`."""
        ...

    def post(self, request: bytes) -> int:
        """Send a request without waiting for the answer, and return its number."""
        ...


FINAL = (4, 5, 6)
"""Of action_msgs/GoalStatus: succeeded, cancelled, aborted."""
SECOND_THOUGHT_S = 0.5
"""How long messages with the goal's id may contradict an answer."""
MOST_RESULTS_HELD = 20

StartSoon = Callable[[Callable[[], Coroutine[Any, Any, None]]], None]


class ActionWire:
    """Pursues goals of one action."""

    def __init__(
        self,
        *,
        send: ServiceClient,
        result: ServiceClient,
        cancel: ServiceClient,
        start_soon: StartSoon,
    ) -> None:
        self._send = send
        self._result = result
        self._cancel = cancel
        self._start_soon = start_soon
        self._goals: dict[str, ActionGoal] = {}
        self._asked: dict[int, str] = {}
        self._statuses: dict[str, int] = {}
        self._results: list[Answer] = []
        self._server: bytes | None = None
        self._named = News()
        result.on_answer = self._take_result

    async def send_goal(self, action: str, arguments: Message, *, timeout_s: float) -> ActionGoal:
        """Send a goal; its state follows later."""
        for service in (self._send, self._result, self._cancel):
            await service.wait_for_server(timeout_s=timeout_s)
        goal_id = new_id()
        request = self._send.encode({"goal_id": _uuid(goal_id), "goal": arguments})
        goal = ActionGoal(goal_id=goal_id, action=action, ros_id=goal_id)
        self._goals[goal_id] = goal
        self._start_soon(partial(self._wait_for_answer, goal, request, timeout_s))
        return goal

    def cancel_goal(self, goal_id: str) -> None:
        """Ask for the end of a goal."""
        self._cancel.post(self._cancel.encode({"goal_info": {"goal_id": _uuid(goal_id)}}))

    def note_servers(self, keys: list[bytes]) -> None:
        """Take in the action's present server; goals are lost with the server that took them."""
        if self._server in keys:
            return
        # A server that was started again knows nothing of the goals of the one before.
        if self._server is not None or not keys:
            self._lose_goals()
        self._server = keys[-1] if keys else None

    def _lose_goals(self) -> None:
        lost, self._goals = list(self._goals.values()), {}
        self._asked.clear()
        self._results.clear()
        self._statuses.clear()
        for goal in lost:
            goal.take_loss()

    def take_statuses(self, message: Message) -> None:
        """Take in the states of all goals, ours and others'."""
        self._statuses = {
            each["goal_info"]["goal_id"]["uuid"].hex(): int(each["status"])
            for each in message["status_list"]
        }
        for goal_id in list(self._goals):
            if goal_id in self._statuses:
                self._accept(goal_id)
        self._match_results()
        self._named.tell()

    def take_feedback(self, message: Message) -> None:
        """Take in the feedback of a goal under way."""
        goal_id = message["goal_id"]["uuid"].hex()
        if goal_id in self._goals:
            self._accept(goal_id)
            self._goals[goal_id].take_feedback(message["feedback"])
            self._named.tell()

    # --- acceptance

    async def _wait_for_answer(self, goal: ActionGoal, request: bytes, timeout_s: float) -> None:
        try:
            answer = (await self._send.call(request, timeout_s=timeout_s)).content
        except LinkError:
            # Silence does not refuse a goal: its sender decides how long to wait.
            return
        if not self._send.tells_whom:
            await self._named.wait_until(
                lambda: goal.is_accepted or goal.id not in self._goals, within_s=SECOND_THOUGHT_S
            )
        if goal.id not in self._goals or goal.is_accepted:
            return
        if answer["accepted"]:
            self._accept(goal.id)
        else:
            del self._goals[goal.id]
            goal.take_end(REFUSED)

    def _accept(self, goal_id: str) -> None:
        goal = self._goals[goal_id]
        if not goal.is_accepted:
            number = self._result.post(self._result.encode({"goal_id": _uuid(goal_id)}))
            self._asked[number] = goal_id
            goal.take_acceptance()

    # --- results

    def _take_result(self, number: int, answer: Answer) -> None:
        if number:
            goal_id = self._asked.pop(number, "")
            if goal_id in self._goals:
                self._end(goal_id, answer)
        elif self._goals and answer["status"] in FINAL:
            self._results = [*self._results[-MOST_RESULTS_HELD:], answer]
            self._match_results()

    def _match_results(self) -> None:
        """End each goal whose state by its id is final with a result that says the same."""
        for goal_id in list(self._goals):
            status = self._statuses.get(goal_id)
            fitting = [each for each in self._results if each["status"] == status]
            if fitting:
                self._results = [each for each in self._results if each is not fitting[0]]
                self._end(goal_id, fitting[0])
        if not self._goals:
            self._results.clear()
            self._asked.clear()

    def _end(self, goal_id: str, answer: Answer) -> None:
        goal = self._goals.pop(goal_id)
        goal.take_end(
            ActionEnd(status=int(answer["status"]), is_result=True, values=answer["result"])
        )


def _uuid(goal_id: str) -> dict[str, bytes]:
    return {"uuid": bytes.fromhex(goal_id)}
