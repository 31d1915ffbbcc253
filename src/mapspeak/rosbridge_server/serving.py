"""Any robot offered as a rosbridge server: one connection per client."""

import logging
from collections.abc import AsyncGenerator, AsyncIterator
from contextlib import AbstractAsyncContextManager, asynccontextmanager, suppress
from dataclasses import dataclass

import anyio
import anyio.lowlevel
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.extensions.permessage_deflate import ServerPerMessageDeflateFactory

from mapspeak.errors import ConfigError, plain_errors
from mapspeak.robot import Robot
from mapspeak.ros.messages.fields import Dialect
from mapspeak.rosbridge_server.conversation import LONGEST_MESSAGE, ClientConversation
from mapspeak.rosbridge_server.hub import Outbox
from mapspeak.rosbridge_server.interfaces import RosSystem
from mapspeak.rosbridge_server.stack import RosStack
from mapspeak.skill import SkilledRobot

FRAME_LENGTH = 1 << 18
"""A long message leaves in frames of this length: compressing one must not hold up the others."""
HANDSHAKE_TIMEOUT_S = 10.0
CLOSING_TIMEOUT_S = 1.0
DEFAULT_HOST = "127.0.0.1"
MOST_OPERATIONS = 1000
"""Operations that wait for one that takes long; then the network has to wait."""

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class RosbridgeServer:
    """A server that runs; its address is as "ws://127.0.0.1:9090"."""

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
    """Offer a ROS as a rosbridge server while the context lasts; port 0 takes any that is free.

    With goals in a new thread, one does not hold up its client's further operations, as in newer
    versions of rosbridge.

    Raises:
        ConfigError: The address cannot be listened on.
    """
    with plain_errors():
        async with anyio.create_task_group() as tasks:
            await tasks.start(system.keep_going)
            async with listen(
                system, host=host, port=port, goals_in_new_thread=goals_in_new_thread
            ) as server:
                yield server
            tasks.cancel_scope.cancel()


@asynccontextmanager
async def listen(
    system: RosSystem, *, host: str = DEFAULT_HOST, port: int, goals_in_new_thread: bool
) -> AsyncGenerator[RosbridgeServer]:
    """Take in clients of a ROS that is kept going elsewhere, while the context lasts.

    Raises:
        ConfigError: The address cannot be listened on.
    """

    async def receive(socket: ServerConnection) -> None:
        await _serve_client(socket, system, blocks=not goals_in_new_thread)

    try:
        server = await serve(
            receive,
            host,
            port,
            compression=None,
            extensions=[ServerPerMessageDeflateFactory(compress_settings={"level": 1})],
            max_size=LONGEST_MESSAGE,
            max_queue=MOST_OPERATIONS,
            open_timeout=HANDSHAKE_TIMEOUT_S,
            close_timeout=CLOSING_TIMEOUT_S,
            ping_interval=None,
        )
    except OSError as error:
        raise ConfigError(
            f"{host}:{port} cannot be served on: {error.strerror or error}.",
            hint="Choose another port, or end the program that has this one.",
        ) from error
    try:
        port = next(iter(server.sockets)).getsockname()[1]
        name = f"[{host}]" if ":" in host else host
        yield RosbridgeServer(url=f"ws://{name}:{port}", port=port)
    finally:
        with anyio.CancelScope(shield=True):
            server.close()
            await server.wait_closed()


def open_rosbridge_server(
    robot: Robot,
    *,
    dialect: Dialect,
    host: str = DEFAULT_HOST,
    port: int = 0,
    goals_in_new_thread: bool = False,
    skilled: SkilledRobot | None = None,
) -> AbstractAsyncContextManager[RosbridgeServer]:
    """Offer a robot as a rosbridge server with rosapi, as `serve_system` does.

    What it can do besides driving is offered as services where it is given as `skilled` too.

    The robot's `sleep` must give way to other tasks: time passes here, and only by it.
    """
    return serve_system(
        RosStack(robot, dialect=dialect, skilled=skilled),
        host=host,
        port=port,
        goals_in_new_thread=goals_in_new_thread,
    )


async def _serve_client(socket: ServerConnection, system: RosSystem, *, blocks: bool) -> None:
    """Serve one client until it hangs up, without an effect on the others."""
    async with anyio.create_task_group() as tasks:
        outbox = Outbox(tasks.cancel_scope.cancel)
        conversation = ClientConversation(system, outbox, tasks, blocks=blocks)
        tasks.start_soon(_write, socket, outbox, conversation)
        tasks.start_soon(_carry_out_all, socket, conversation)
        try:
            await socket.wait_closed()
        finally:
            conversation.close()
        tasks.cancel_scope.cancel()


async def _carry_out_all(socket: ServerConnection, conversation: ClientConversation) -> None:
    with suppress(ConnectionClosed):
        async for operation in socket:
            try:
                await conversation.handle(operation)
            except Exception:
                # A fault of ours; one client's odd operation must not end the others' robot.
                logger.exception("An operation could not be carried out")


async def _write(
    socket: ServerConnection, outbox: Outbox, conversation: ClientConversation
) -> None:
    with suppress(ConnectionClosed):
        while True:
            for item in await outbox.take():
                for piece in conversation.frames_of(item):
                    await socket.send(_frames_of(piece.data), text=piece.is_text)


async def _frames_of(message: bytes) -> AsyncIterator[bytes]:
    for start in range(0, max(len(message), 1), FRAME_LENGTH):
        yield message[start : start + FRAME_LENGTH]
        await anyio.lowlevel.checkpoint()
