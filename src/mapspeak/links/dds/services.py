"""Calls of services, and goals of actions, over DDS: the answers to all come on one topic.

Robots on Cyclone DDS put a number before each request and answer. Robots on Fast DDS keep it in a
part of the DDS message that no library shows us: there, one call of a service is under way at a
time, and answers are taken in the order in which they were asked for. The answer to another client
that asks the same service at the same moment cannot be told from ours.
"""

import struct
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import anyio

from mapspeak.links.cdr import HEADER_BYTES
from mapspeak.links.dds.discovery import Framing
from mapspeak.links.dds.endpoints import Quality, reply_topic, request_topic
from mapspeak.links.dds.participant import DdsParticipant
from mapspeak.links.dds.types import Types
from mapspeak.links.endpoints import Sample, no_answer, nobody_serves
from mapspeak.links.goals import Answer
from mapspeak.ros.port import new_id

QUALITY = Quality(is_reliable=True, is_latched=False, depth=100)
NUMBER = struct.Struct("<Qq")
MOST_AT_ONCE = 8
"""Calls of one service: its node keeps ten requests and forgets the oldest."""
LATE_ANSWER_S = 1.0
"""How long to hold an answer that may belong to an earlier call, which was given up."""


class _Call:
    """One request under way, and the answers that came meanwhile."""

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


class DdsService:
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
        self.type_name = type_name
        self._request_type, self._reply_type = f"{type_name}_Request", f"{type_name}_Response"
        self._participant = participant
        self._framing = framing
        self._types = types
        self.on_answer: Callable[[int, Answer], None] | None = None
        """Called with every answer, and the number of its request; 0 where unknown."""
        self._id = int(new_id()[:16], 16)
        self._number = 0
        self._n_open = 0
        self._turns = anyio.CapacityLimiter(MOST_AT_ONCE if self.tells_whom else 1)
        self._calls: dict[int, _Call] = {}
        # The server must know our reader before it reads a request, so this is announced first.
        self._raw_reader = participant.read(
            reply_topic(service),
            self._reply_type,
            quality=QUALITY,
            decode=self._understand,
            take=self._take,
        )
        self._raw_writer = participant.write_to(
            request_topic(service), self._request_type, quality=QUALITY
        )

    async def call(self, request: bytes, *, timeout_s: float) -> Sample:
        """Return the service's answer to a request from `encode`."""
        deadline_s = anyio.current_time() + timeout_s
        await self.wait_for_server(timeout_s=timeout_s)
        with anyio.move_on_at(deadline_s):
            async with self._turns:
                return await self._call(request, deadline_s=deadline_s, timeout_s=timeout_s)
        raise no_answer(self.service, timeout_s)

    async def wait_for_server(self, *, timeout_s: float) -> None:
        """Return when the requests have a reader."""
        if not await self._raw_writer.wait_for_reader(timeout_s=timeout_s):
            raise nobody_serves(self.service)

    @property
    def tells_whom(self) -> bool:
        """True when answers say whose request they answer."""
        return self._framing is Framing.NUMBERED

    def note_server(self, framing: Framing | None) -> None:
        """Take in the framing of the present server; without one, open answers will never come."""
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
        # A held answer is ours if no other followed: the earlier call had no answer.
        found = call.answer or call.held
        if found is None:
            raise no_answer(self.service, timeout_s)
        self._n_open = 0
        if found.refusal is not None:
            raise found.refusal
        return found

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
