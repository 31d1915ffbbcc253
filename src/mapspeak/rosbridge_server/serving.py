"""Any robot offered as a rosbridge server, as a program too: one connection per client."""

import logging
import signal
from collections.abc import AsyncGenerator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import dataclass

import anyio
from anyio.abc import ByteStream, SocketAttribute
from anyio.streams.memory import MemoryObjectReceiveStream

from mapspeak.errors import ConfigError
from mapspeak.robot import Robot
from mapspeak.ros.messages.fields import Dialect
from mapspeak.rosbridge_server.connection import Outbox, ServerWebSocket
from mapspeak.rosbridge_server.conversation import ClientConversation
from mapspeak.rosbridge_server.hub import Frame, fragments_of
from mapspeak.rosbridge_server.interfaces import RosSystem
from mapspeak.rosbridge_server.stack import RosStack

LONGEST_FRAME = 10_000_000
"""rosbridge's `max_message_size`: on ROS 2 longer text is cut in pieces, longer CBOR is lost."""
DEFAULT_HOST = "127.0.0.1"
MOST_OPERATIONS = 1000
"""Operations that wait for one that takes long; then the network has to wait."""

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class RosbridgeServer:
    """A server that runs.

    Attributes:
        url: Where clients find it, as "ws://127.0.0.1:9090".
    """

    url: str
    port: int


@asynccontextmanager
async def serve_system(
    system: RosSystem,
    *,
    host: str = DEFAULT_HOST,
    port: int = 0,
    goals_in_new_thread: bool = True,
) -> AsyncGenerator[RosbridgeServer]:
    """Offer a ROS as a rosbridge server while the context lasts.

    Args:
        system: What clients find.
        host: Where to listen.
        port: Where to listen; 0 takes any that is free.
        goals_in_new_thread: A goal does not hold up its client's further operations, as in newer
            versions of rosbridge.

    Raises:
        ConfigError: The address cannot be listened on.
    """
    try:
        listener = await anyio.create_tcp_listener(local_host=host, local_port=port)
    except OSError as error:
        raise ConfigError(
            f"{host}:{port} cannot be served on: {error.strerror or error}.",
            hint="Choose another port, or end the program that has this one.",
        ) from error
    async with listener, anyio.create_task_group() as tasks:
        await tasks.start(system.keep_going)
        reception = Reception(system, goals_in_new_thread=goals_in_new_thread)
        tasks.start_soon(listener.serve, reception.receive)
        port = listener.extra(SocketAttribute.local_port)  # noqa: S610 - anyio's, not Django's
        name = f"[{host}]" if ":" in host else host
        yield RosbridgeServer(url=f"ws://{name}:{port}", port=port)
        tasks.cancel_scope.cancel()


def open_rosbridge_server(
    robot: Robot,
    *,
    dialect: Dialect,
    host: str = DEFAULT_HOST,
    port: int = 0,
    goals_in_new_thread: bool = False,
) -> AbstractAsyncContextManager[RosbridgeServer]:
    """Offer a robot as a rosbridge server with rosapi, as `serve_system` does.

    Args:
        robot: Its `sleep` must give way to other tasks: time passes here, and only by it.
        dialect: Which ROS to be.
        host: Likewise, as are the others.
    """
    return serve_system(
        RosStack(robot, dialect=dialect),
        host=host,
        port=port,
        goals_in_new_thread=goals_in_new_thread,
    )


class Reception:
    """Takes clients in; what one does or does not do is no matter to the others."""

    def __init__(self, stack: RosSystem, *, goals_in_new_thread: bool) -> None:
        self._stack = stack
        self._blocks = not goals_in_new_thread

    async def receive(self, stream: ByteStream) -> None:
        """Serve one client until it hangs up."""
        socket = ServerWebSocket(stream)
        try:
            if await socket.accept():
                await self._talk(socket)
        except (anyio.BrokenResourceError, anyio.ClosedResourceError):
            return
        except Exception:
            # A fault of ours; it may cost this client its connection, and the others nothing.
            logger.exception("A client could not be served")
        finally:
            await socket.close()

    async def _talk(self, socket: ServerWebSocket) -> None:
        to_do, done = anyio.create_memory_object_stream[str | bytes](MOST_OPERATIONS)
        async with to_do, done, anyio.create_task_group() as tasks:
            outbox = Outbox(tasks.cancel_scope.cancel)
            conversation = ClientConversation(self._stack, outbox, tasks, blocks=self._blocks)
            try:
                tasks.start_soon(self._write, socket, outbox, conversation)
                tasks.start_soon(_carry_out_all, conversation, done)
                while (message := await socket.receive()) is not None:
                    await to_do.send(message)
            except (anyio.BrokenResourceError, anyio.ClosedResourceError):
                pass
            finally:
                conversation.close()
                tasks.cancel_scope.cancel()

    async def _write(
        self, socket: ServerWebSocket, outbox: Outbox, conversation: ClientConversation
    ) -> None:
        try:
            while True:
                for item in await outbox.take():
                    frame = item if isinstance(item, Frame) else conversation.frame_of(item)
                    for piece in self._pieces(frame, conversation):
                        await socket.send(piece.data, is_text=piece.is_text)
        except (anyio.BrokenResourceError, anyio.ClosedResourceError):
            return

    def _pieces(self, frame: Frame | None, conversation: ClientConversation) -> list[Frame]:
        """Cut a long text up as rosbridge does; long CBOR is silently lost on ROS 2."""
        if frame is None:
            return []
        length = conversation.fragment_length
        if self._stack.dialect is Dialect.ROS2:
            if not frame.is_text:
                return [frame] if len(frame.data) <= LONGEST_FRAME else []
            length = min(length or LONGEST_FRAME, LONGEST_FRAME)
        if not frame.is_text or length is None or len(frame.data) <= length:
            return [frame]
        return list(fragments_of(frame, length=length, fragment_id="0"))


async def _carry_out_all(
    conversation: ClientConversation, operations: MemoryObjectReceiveStream[str | bytes]
) -> None:
    async for operation in operations:
        try:
            await conversation.handle(operation)
        except Exception:
            # A fault of ours; one client's odd operation must not end the others' robot.
            logger.exception("An operation could not be carried out")


async def run_rosbridge_server(
    robot: Robot,
    *,
    dialect: Dialect,
    address: str,
    goals_in_new_thread: bool,
    say: Callable[[str], None],
) -> None:
    """Offer a robot as a rosbridge server until the process is interrupted or told to end.

    Args:
        robot: As for `open_rosbridge_server`, as are the others.
        dialect: Which ROS to be.
        address: PORT or HOST:PORT; without a host this machine alone reaches it.
        goals_in_new_thread: A goal does not hold up its client's further operations.
        say: Told one line when clients may come.

    Raises:
        ConfigError: The address is none, or cannot be listened on.
    """
    host, port = _parse_address(address)
    with anyio.open_signal_receiver(signal.SIGINT, signal.SIGTERM) as signals:
        async with open_rosbridge_server(
            robot, dialect=dialect, host=host, port=port, goals_in_new_thread=goals_in_new_thread
        ) as server:
            robot_name, map_name = robot.description.name, robot.description.map_name
            say(f"mapspeak: {robot_name} in {map_name}, {dialect.upper()}: {server.url}")
            async for _ in signals:
                return


def _parse_address(address: str) -> tuple[str, int]:
    host, _, port = address.rpartition(":")
    if not (port.isdecimal() and port.isascii() and int(port) < 65536):
        raise ConfigError(
            f"{address!r} is no address to serve on.", hint="Give PORT or HOST:PORT, as 9090."
        )
    return host.strip("[]") or DEFAULT_HOST, int(port)
