"""A rosbridge server for tests that does as it is told, also what no server should."""

import ssl
from collections.abc import AsyncGenerator, Callable, Coroutine, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any

import anyio
import orjson
from anyio.abc import ByteStream, Listener, SocketAttribute, TaskGroup
from anyio.streams.tls import TLSListener
from websockets.exceptions import InvalidHandshake
from websockets.extensions.permessage_deflate import ServerPerMessageDeflateFactory
from websockets.frames import Frame, Opcode
from websockets.http11 import Request
from websockets.protocol import State
from websockets.server import ServerProtocol

Operation = dict[str, Any]
PATIENCE_S = 60.0
"""No wait of a test is longer; none is meant to come near."""


class Visitor:
    """One connection of a client, seen from the server."""

    def __init__(self, number: int, stream: ByteStream, protocol: ServerProtocol) -> None:
        self.number = number
        self.request: Request | None = None
        self.operations: list[Operation] = []
        self.is_gone = False
        self._stream = stream
        self._protocol = protocol
        self._sending = anyio.Lock()

    async def send(self, operation: Operation) -> None:
        await self.send_text(orjson.dumps(operation, option=orjson.OPT_SERIALIZE_NUMPY))

    async def send_text(self, text: bytes) -> None:
        if self._protocol.state is State.OPEN:
            self._protocol.send_text(text)
            await self.flush()

    async def send_binary(self, data: bytes) -> None:
        if self._protocol.state is State.OPEN:
            self._protocol.send_binary(data)
            await self.flush()

    async def send_raw(self, data: bytes) -> None:
        """Sends bytes as they are, past the websocket protocol."""
        async with self._sending:
            await self._stream.send(data)

    async def publish(self, topic: str, message: Mapping[str, Any]) -> None:
        await self.send({"op": "publish", "topic": topic, "msg": message})

    async def answer(self, call: Operation, values: object, *, is_success: bool = True) -> None:
        answer = {"op": "service_response", "service": call["service"], "id": call["id"]}
        await self.send({**answer, "values": values, "result": is_success})

    async def drop(self) -> None:
        """Cuts the connection, as a robot that loses power does."""
        self.is_gone = True
        await anyio.aclose_forcefully(self._stream)

    async def flush(self) -> None:
        async with self._sending:
            data = b"".join(self._protocol.data_to_send())
            if data:
                try:
                    await self._stream.send(data)
                except (anyio.BrokenResourceError, anyio.ClosedResourceError):
                    self.is_gone = True

    def asked(self, name: str) -> list[Operation]:
        return [operation for operation in self.operations if operation["op"] == name]


Answer = Callable[[Visitor, Operation], Coroutine[Any, Any, None]]


@dataclass
class ScriptedServer:
    """What the server has seen, and how it answers."""

    answers: dict[str, Answer] = field(default_factory=dict)
    """By operation; one without an answer is met with silence."""
    visitors: list[Visitor] = field(default_factory=list)
    port: int = 0
    answers_pings: bool = True
    hangs_up: bool = False
    """Whoever comes is sent away, as by a machine that is still booting."""
    n_sent_away: int = 0
    _news: anyio.Event = field(default_factory=anyio.Event)

    @property
    def url(self) -> str:
        return f"ws://127.0.0.1:{self.port}"

    @property
    def operations(self) -> list[Operation]:
        return [operation for visitor in self.visitors for operation in visitor.operations]

    @property
    def present(self) -> list[Visitor]:
        return [visitor for visitor in self.visitors if not visitor.is_gone]

    def asked(self, name: str) -> list[Operation]:
        return [operation for operation in self.operations if operation["op"] == name]

    async def until(self, is_true: Callable[[], object]) -> None:
        """Waits until something that the server sees has become true."""
        with anyio.fail_after(PATIENCE_S):
            while not is_true():
                await self._news.wait()

    async def drop_all(self) -> None:
        for visitor in self.present:
            await visitor.drop()

    async def publish(self, topic: str, message: Mapping[str, Any]) -> None:
        """Publishes to every connection that has subscribed."""
        for visitor in self.present:
            if any(operation["topic"] == topic for operation in visitor.asked("subscribe")):
                await visitor.publish(topic, message)

    def tell(self) -> None:
        news, self._news = self._news, anyio.Event()
        news.set()

    async def serve(self, stream: ByteStream) -> None:
        protocol = ServerProtocol(
            extensions=[ServerPerMessageDeflateFactory()], max_size=50_000_000
        )
        if self.hangs_up:
            await anyio.aclose_forcefully(stream)
            self.n_sent_away += 1
            self.tell()
            return
        visitor = Visitor(len(self.visitors), stream, protocol)
        try:
            async with stream, anyio.create_task_group() as tasks:
                while True:
                    protocol.receive_data(await stream.receive())
                    for event in protocol.events_received():
                        self._take(event, visitor, protocol, tasks)
                    if self.answers_pings:
                        await visitor.flush()
        except* (anyio.EndOfStream, anyio.BrokenResourceError, anyio.ClosedResourceError):
            pass
        finally:
            visitor.is_gone = True
            self.tell()

    def _take(
        self,
        event: object,
        visitor: Visitor,
        protocol: ServerProtocol,
        tasks: TaskGroup,
    ) -> None:
        if isinstance(event, Request):
            visitor.request = event
            try:
                protocol.send_response(protocol.accept(event))
            except InvalidHandshake as error:
                protocol.send_response(protocol.reject(400, str(error)))
            self.visitors.append(visitor)
            self.tell()
        elif isinstance(event, Frame) and event.opcode in (Opcode.TEXT, Opcode.BINARY):
            operation = orjson.loads(event.data)
            visitor.operations.append(operation)
            self.tell()
            answer = self.answers.get(operation["op"])
            if answer is not None:
                tasks.start_soon(answer, visitor, operation)


@asynccontextmanager
async def running(
    server: ScriptedServer,
    *,
    host: str = "127.0.0.1",
    ssl_context: ssl.SSLContext | None = None,
) -> AsyncGenerator[ScriptedServer]:
    """Runs a scripted server on a loopback port while the context lasts."""
    listener: Listener[Any] = await anyio.create_tcp_listener(local_host=host)
    server.port = listener.extra(SocketAttribute.local_port)  # noqa: S610 - no SQL
    if ssl_context is not None:
        listener = TLSListener(listener, ssl_context, standard_compatible=False)
    async with listener, anyio.create_task_group() as tasks:
        tasks.start_soon(listener.serve, server.serve)
        yield server
        tasks.cancel_scope.cancel()


@asynccontextmanager
async def answering_with(data: bytes) -> AsyncGenerator[str]:
    """Gives the URL of a listener that sends these bytes to whoever comes, and hangs up."""

    async def greet(stream: ByteStream) -> None:
        async with stream:
            await stream.receive()
            await stream.send(data)

    listener = await anyio.create_tcp_listener(local_host="127.0.0.1")
    port = listener.extra(SocketAttribute.local_port)  # noqa: S610 - no SQL
    async with listener, anyio.create_task_group() as tasks:
        tasks.start_soon(listener.serve, greet)
        yield f"ws://127.0.0.1:{port}"
        tasks.cancel_scope.cancel()
