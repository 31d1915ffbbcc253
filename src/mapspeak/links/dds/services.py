"""Calls of services, and goals of actions, over DDS: the answers to all come on one topic.

Robots on Cyclone DDS put a number before each request and answer. Robots on Fast DDS keep it in a
part of the DDS message that no library shows us: there, one call of a service is under way at a
time, and answers are taken in the order in which they were asked for. The answer to another client
that asks the same service at the same moment cannot be told from ours.

An action is three services and two topics. Where answers do not say whom they answer, what is said
of a goal by its id counts: the list of all goals' states, and feedback.
"""

import struct
from collections.abc import Callable, Coroutine, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import anyio

from mapspeak.errors import LinkError
from mapspeak.links.dds.cdr import HEADER_BYTES
from mapspeak.links.dds.discovery import Framing
from mapspeak.links.dds.endpoints import Quality, RawWriter, Sample, reply_topic, request_topic
from mapspeak.links.dds.participant import DdsParticipant
from mapspeak.links.dds.types import Types
from mapspeak.ros.activity import REFUSED, ActionEnd, ActionGoal
from mapspeak.ros.messages.fields import Message
from mapspeak.ros.port import new_id

QUALITY = Quality(is_reliable=True, is_latched=False, depth=100)
NUMBER = struct.Struct("<Qq")
MOST_AT_ONCE = 8
"""Calls of one service: its node keeps ten requests and forgets the oldest."""
LATE_ANSWER_S = 1.0
"""So long an answer is held that may belong to an earlier call, which was given up."""

Answer = dict[str, Any]


class _Call:
    """One request of ours under way, and what was answered while it was."""

    def __init__(self, n_before: int) -> None:
        self.n_before = n_before
        self.held: Sample | None = None
        self.answer: Sample | None = None
        self.is_answered = anyio.Event()

    def take(self, sample: Sample) -> None:
        """Take an answer, which belongs to an earlier call while such are open."""
        if self.n_before:
            self.n_before -= 1
            self.held = sample
        elif self.answer is None:
            self.answer = sample
            self.is_answered.set()


class ServiceClient:
    """Asks one service, of a type such as "rcl_interfaces/srv/GetParameters"."""

    def __init__(
        self,
        participant: DdsParticipant,
        service: str,
        type_name: str,
        *,
        framing: Framing,
        types: Types,
    ) -> None:
        self.service = service
        self._request_type, self._reply_type = f"{type_name}_Request", f"{type_name}_Response"
        self._participant = participant
        self._framing = framing
        self._types = types
        self.on_answer: Callable[[int, Answer], None] | None = None
        """Is called with every answer, and the number of its request; 0 where that is not known."""
        self._id = int(new_id()[:16], 16)
        self._number = 0
        self._n_open = 0
        self._turns = anyio.CapacityLimiter(MOST_AT_ONCE if self.tells_whom else 1)
        self._calls: dict[int, _Call] = {}
        # Who reads our requests must know our reader by then: it is announced first.
        self._raw_reader = participant.read(
            reply_topic(service),
            self._reply_type,
            quality=QUALITY,
            decode=self._understand,
            take=self._take,
        )
        self._raw_writer: RawWriter = participant.write_to(
            request_topic(service), self._request_type, quality=QUALITY
        )

    async def call(self, request: bytes, *, timeout_s: float) -> Sample:
        """Return what the service answers to a request that `encode` gave."""
        deadline_s = anyio.current_time() + timeout_s
        await self.wait_for_server(timeout_s=timeout_s)
        with anyio.move_on_at(deadline_s):
            async with self._turns:
                return await self._call(request, deadline_s=deadline_s, timeout_s=timeout_s)
        raise self._silence(timeout_s)

    async def wait_for_server(self, *, timeout_s: float) -> None:
        """Return when somebody reads our requests."""
        if not await self._raw_writer.wait_for_reader(timeout_s=timeout_s):
            raise LinkError(
                f"Nobody serves {self.service}.",
                hint=f"Start the node that does: `ros2 service info {self.service}`.",
            )

    @property
    def tells_whom(self) -> bool:
        """True when answers say whose request they answer."""
        return self._framing is Framing.NUMBERED

    def note_server(self, framing: Framing | None) -> None:
        """Take in who serves now, or that nobody does, whose answers will never come."""
        if framing is None:
            self._n_open = 0
        else:
            self._framing = framing
            self._turns.total_tokens = MOST_AT_ONCE if self.tells_whom else 1

    def encode(self, arguments: Mapping[str, Any]) -> bytes:
        """Return a request."""
        return self._types.encode(self._request_type, arguments)

    def post(self, request: bytes) -> int:
        """Send a request without waiting for the answer, and return its number."""
        self._number += 1
        if self._framing is Framing.NUMBERED:
            number = NUMBER.pack(self._id, self._number)
            request = request[:HEADER_BYTES] + number + request[HEADER_BYTES:]
        self._raw_writer.write(request)
        self._n_open += 1
        return self._number

    async def _call(self, request: bytes, *, deadline_s: float, timeout_s: float) -> Sample:
        n_before = 0 if self.tells_whom else self._n_open
        number = self.post(request)
        call = self._calls[number] = _Call(n_before)
        try:
            with anyio.move_on_at(deadline_s) as scope:
                if n_before:
                    scope.deadline = min(deadline_s, anyio.current_time() + LATE_ANSWER_S)
                await call.is_answered.wait()
            if call.answer is None and call.held is None:
                with anyio.move_on_at(deadline_s):
                    await call.is_answered.wait()
        finally:
            del self._calls[number]
        # What was held is ours after all where nothing followed: the earlier call had no answer.
        found = call.answer or call.held
        if found is None:
            raise self._silence(timeout_s)
        self._n_open = 0
        if found.refusal is not None:
            raise found.refusal
        return found

    def _silence(self, timeout_s: float) -> LinkError:
        return LinkError(
            f"{self.service} has not answered within {timeout_s:g} s.",
            hint="The node that serves it may be busy or stuck: try again, or restart it.",
        )

    # --- answers

    def _understand(self, data: bytes) -> tuple[int | None, Answer]:
        """Return number of the request, None for others' and 0 where unknown, and the answer."""
        if self._framing is Framing.BARE:
            return 0, self._types.decode(self._reply_type, data)
        asker, number = NUMBER.unpack_from(data.ljust(HEADER_BYTES + NUMBER.size), HEADER_BYTES)
        if asker != self._id:
            return None, {}
        bare = data[:HEADER_BYTES] + data[HEADER_BYTES + NUMBER.size :]
        return number, self._types.decode(self._reply_type, bare)

    def _take(self, sample: Sample) -> None:
        number, answer = (0, None) if sample.refusal is not None else sample.content
        if number is None:
            return
        if self.on_answer is not None and answer is not None:
            self.on_answer(number, answer)
        call = self._calls.get(number) if number else next(iter(self._calls.values()), None)
        if call is not None:
            call.take(replace(sample, content=answer))
        self._n_open = max(self._n_open - 1, 0)


FINAL = (4, 5, 6)
"""Of action_msgs/GoalStatus: succeeded, cancelled, aborted."""
SECOND_THOUGHT_S = 0.5
"""So long an answer may be contradicted by what is said of the goal by its id."""
MOST_RESULTS_HELD = 20

StartSoon = Callable[[Callable[[], Coroutine[Any, Any, None]]], None]


class DdsActionClient:
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
        self._is_named = anyio.Event()
        result.on_answer = self._take_result

    async def send_goal(self, action: str, arguments: Message, *, timeout_s: float) -> ActionGoal:
        """Send a goal; what becomes of it comes later."""
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
        """Take in who serves the action now; goals are lost with the one that took them."""
        if self._server not in keys:
            self._lose_goals()
            # A server that was started again knows nothing of the goals of the one before.
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
        self._tell_named()

    def take_feedback(self, message: Message) -> None:
        """Take in what is said of a goal under way."""
        goal_id = message["goal_id"]["uuid"].hex()
        if goal_id in self._goals:
            self._accept(goal_id)
            self._goals[goal_id].take_feedback(message["feedback"])
            self._tell_named()

    # --- acceptance

    async def _wait_for_answer(self, goal: ActionGoal, request: bytes, timeout_s: float) -> None:
        try:
            answer = (await self._send.call(request, timeout_s=timeout_s)).content
        except LinkError:
            # Silence is no refusal: who sent the goal decides how long to wait.
            return
        if not self._send.tells_whom:
            await self._wait_until_named(goal)
        if goal.goal_id not in self._goals or goal.is_accepted:
            return
        if answer["accepted"]:
            self._accept(goal.goal_id)
        else:
            del self._goals[goal.goal_id]
            goal.take_end(REFUSED)

    async def _wait_until_named(self, goal: ActionGoal) -> None:
        with anyio.move_on_after(SECOND_THOUGHT_S):
            while not goal.is_accepted and goal.goal_id in self._goals:
                await self._is_named.wait()

    def _tell_named(self) -> None:
        is_named, self._is_named = self._is_named, anyio.Event()
        is_named.set()

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
