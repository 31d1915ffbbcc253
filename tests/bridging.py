"""A robot whose time a test lets pass, behind a rosbridge server, and a plain client of that."""

import json
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from typing import Any

import anyio
from websockets.asyncio.client import ClientConnection, connect

from fakes import FakeRobot, two_rooms
from mapspeak.links.rosbridge.protocol.codec import decode_cbor
from mapspeak.ros.messages.fields import Dialect
from mapspeak.rosbridge_server import open_rosbridge_server

STEP_S = 0.05
PATIENCE_S = 60.0

Operation = dict[str, Any]


class SteppedRobot(FakeRobot):
    """A fake robot that stands still in time until a test lets it go on."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:  # noqa: ANN401
        super().__init__(*args, **kwargs)
        self._moved_on = anyio.Event()
        self._fell_asleep = anyio.Event()

    async def sleep(self, duration_s: float) -> None:
        left_s = duration_s
        while left_s > 1e-6:
            before_s = self._now_s
            self._fell_asleep.set()
            await self._moved_on.wait()
            left_s -= max(self._now_s - before_s, 0.0)

    async def let_pass(self, duration_s: float) -> None:
        """Lets time pass, and the server do at each step what is then due."""
        for _ in range(round(duration_s / STEP_S)):
            await FakeRobot.sleep(self, STEP_S)
            self._moved_on.set()
            self._moved_on, self._fell_asleep = anyio.Event(), anyio.Event()
            with anyio.fail_after(PATIENCE_S):
                await self._fell_asleep.wait()

    def set_back(self, by_s: float) -> None:
        """Sets its clock back, as a simulation does that is begun anew."""
        self._now_s -= by_s


class RawClient:
    """Sends operations and reads what comes back, each wait with an end."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection

    async def send(self, **operation: Any) -> None:  # noqa: ANN401
        await self.connection.send(json.dumps(operation))

    async def receive(self, *, patience_s: float = PATIENCE_S) -> Operation:
        with anyio.fail_after(patience_s):
            frame = await self.connection.recv()
        value: Operation = json.loads(frame) if isinstance(frame, str) else decode_cbor(frame)
        return value

    async def until(self, is_wanted: Callable[[Operation], bool]) -> Operation:
        while not is_wanted(operation := await self.receive()):
            pass
        return operation

    async def next_on(self, topic: str) -> Any:  # noqa: ANN401
        return (await self.until(lambda each: each.get("topic") == topic))["msg"]

    async def call(self, service: str, /, **args: Any) -> Operation:  # noqa: ANN401
        await self.send(op="call_service", id=f"call {service}", service=service, args=args)
        return await self.until(lambda each: each.get("id") == f"call {service}")

    async def all_before(self, question: str = "get_time") -> list[Operation]:
        """Gives everything that came before the answer to a question asked now."""
        await self.send(op="call_service", id="the last", service=f"/rosapi/{question}")
        came: list[Operation] = []
        while (operation := await self.receive()).get("id") != "the last":
            came.append(operation)
        return came

    async def ask(self, question: str, /, **args: Any) -> Any:  # noqa: ANN401
        """Asks rosapi; all that was asked before has been dealt with when it answers."""
        answer = await self.call(f"/rosapi/{question}", **args)
        assert answer["result"] is True, answer
        return answer["values"]


@asynccontextmanager
async def bridge(
    dialect: Dialect, robot: SteppedRobot | None = None, *, goals_in_new_thread: bool = False
) -> AsyncGenerator[tuple[SteppedRobot, Callable[..., Any]]]:
    """Gives a robot behind a server, and what connects one more client to it."""
    stepped = robot or SteppedRobot(two_rooms())
    async with open_rosbridge_server(
        stepped, dialect=dialect, goals_in_new_thread=goals_in_new_thread
    ) as server:

        @asynccontextmanager
        async def client(**options: Any) -> AsyncGenerator[RawClient]:  # noqa: ANN401
            async with connect(server.url, max_size=None, **options) as connection:
                yield RawClient(connection)

        yield stepped, client
