"""A websocket over anyio: `websockets` understands the bytes, anyio moves them."""

import socket
import ssl
from collections import deque
from dataclasses import dataclass

import anyio
from anyio.abc import ByteStream
from websockets.client import ClientProtocol
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.extensions.permessage_deflate import ClientPerMessageDeflateFactory
from websockets.frames import Frame, Opcode
from websockets.protocol import State

from mapspeak.errors import LinkError
from mapspeak.links.rosbridge.client.address import RobotAddress
from mapspeak.links.rosbridge.protocol import MAX_FRAME_BYTES

READ_BYTES = 262_144
NOT_ALLOWED = (401, 403)
START_HINT = (
    "Start rosbridge on the robot (ROS 2: `ros2 launch rosbridge_server "
    "rosbridge_websocket_launch.xml`, ROS 1: `roslaunch rosbridge_server "
    "rosbridge_websocket.launch`), and check host and port."
)


@dataclass(frozen=True, slots=True)
class Received:
    """One whole websocket message.

    Attributes:
        data: Its bytes.
        is_text: UTF-8 text, not binary data.
    """

    data: bytes
    is_text: bool


class SocketClosed(Exception):  # noqa: N818 - an event, never shown
    """The other end has gone; never leaves the client."""


class WebSocket:
    """An open websocket. One task may receive while others send."""

    def __init__(self, protocol: ClientProtocol, stream: ByteStream) -> None:
        self._protocol = protocol
        self._stream = stream
        self._sending = anyio.Lock()
        self._arrived: deque[Received] = deque()
        self._parts: list[Frame] = []
        self.n_bytes_received = 0
        """Of any kind, pongs included: an end that is alive makes it grow."""

    async def receive(self) -> Received:
        """Gives the next whole message.

        Raises:
            SocketClosed: None will come.
        """
        while not self._arrived:
            await self._read()
        return self._arrived.popleft()

    async def send(self, text: bytes) -> None:
        """Sends one text message.

        Raises:
            SocketClosed: The other end has gone.
        """
        if self._protocol.state is not State.OPEN:
            raise SocketClosed
        self._protocol.send_text(text)
        await self._flush()

    async def ping(self) -> None:
        """Asks the other end for a sign of life.

        Raises:
            SocketClosed: The other end has gone.
        """
        if self._protocol.state is not State.OPEN:
            raise SocketClosed
        self._protocol.send_ping(b"")
        await self._flush()

    async def say_goodbye(self) -> None:
        """Says that we will send nothing more; whoever receives learns when the other end agrees.

        Raises:
            SocketClosed: The other end has gone already.
        """
        if self._protocol.state is State.OPEN:
            self._protocol.send_close()
        await self._flush()

    async def aclose(self) -> None:
        """Closes the socket at once."""
        await anyio.aclose_forcefully(self._stream)

    async def _read(self) -> None:
        try:
            data = await self._stream.receive(READ_BYTES)
        except (anyio.EndOfStream, anyio.BrokenResourceError, anyio.ClosedResourceError, OSError):
            raise SocketClosed from None
        self.n_bytes_received += len(data)
        self._protocol.receive_data(data)
        for event in self._protocol.events_received():
            if isinstance(event, Frame):
                self._take(event)
        await self._flush()
        is_over = self._protocol.close_rcvd is not None or self._protocol.parser_exc is not None
        if is_over and not self._arrived:
            raise SocketClosed

    def _take(self, frame: Frame) -> None:
        if frame.opcode not in (Opcode.TEXT, Opcode.BINARY, Opcode.CONT):
            return
        self._parts.append(frame)
        if frame.fin:
            parts, self._parts = self._parts, []
            data = bytes(parts[0].data) if len(parts) == 1 else b"".join(p.data for p in parts)
            self._arrived.append(Received(data, parts[0].opcode is Opcode.TEXT))

    async def _flush(self) -> None:
        # Bytes leave in the order in which they were made, whoever made them.
        async with self._sending:
            data = b"".join(self._protocol.data_to_send())
            if not data:
                return
            try:
                await self._stream.send(data)
            except (anyio.BrokenResourceError, anyio.ClosedResourceError, OSError):
                raise SocketClosed from None


async def open_websocket(address: RobotAddress, *, timeout_s: float) -> WebSocket:
    """Connects to a rosbridge server.

    Args:
        address: Where it is.
        timeout_s: For everything together, in wall time.

    Raises:
        LinkError: Nobody is there, or somebody else.
        ConfigError: The CA file cannot be read.
    """
    context = address.build_ssl_context()
    try:
        with anyio.fail_after(timeout_s):
            stream = await _connect(address, context)
            try:
                return await _shake_hands(address, stream)
            except BaseException:
                await anyio.aclose_forcefully(stream)
                raise
    except TimeoutError:
        raise LinkError(
            f"{address.shown} did not answer within {timeout_s:g} s.",
            hint="Check that the robot is on, in the same network, and that no firewall is between."
            f" {START_HINT}",
        ) from None


async def _connect(address: RobotAddress, context: ssl.SSLContext | None) -> ByteStream:
    uri = address.uri
    try:
        if context is None:
            return await anyio.connect_tcp(uri.host, uri.port)
        return await anyio.connect_tcp(
            uri.host, uri.port, ssl_context=context, tls_standard_compatible=False
        )
    except socket.gaierror as error:
        raise LinkError(
            f"No computer called {uri.host!r} is known here.",
            hint="Check the name, or give the robot's IP address.",
        ) from error
    except ssl.SSLCertVerificationError as error:
        raise LinkError(
            f"The certificate of {address.shown} is not trusted: {error.verify_message}.",
            hint="Give the CA file that signed it, or renew the robot's certificate.",
        ) from error
    except (ssl.SSLError, anyio.EndOfStream, anyio.BrokenResourceError) as error:
        raise LinkError(
            f"{address.shown} does not speak TLS.",
            hint="Write ws:// instead of wss://, or start rosbridge with ssl:=true.",
        ) from error
    except OSError as error:
        raise LinkError(f"Nothing listens at {address.shown}.", hint=START_HINT) from error


async def _shake_hands(address: RobotAddress, stream: ByteStream) -> WebSocket:
    protocol = ClientProtocol(
        address.uri,
        extensions=[ClientPerMessageDeflateFactory(client_max_window_bits=True)],
        max_size=MAX_FRAME_BYTES,
    )
    request = protocol.connect()
    for name, value in address.headers.items():
        request.headers[name] = value
    protocol.send_request(request)
    web_socket = WebSocket(protocol, stream)
    try:
        await web_socket._flush()  # noqa: SLF001 - half of the same thing
        while protocol.state is State.CONNECTING and protocol.handshake_exc is None:
            data = await stream.receive(READ_BYTES)
            protocol.receive_data(data)
    except (SocketClosed, anyio.EndOfStream, anyio.BrokenResourceError, OSError) as error:
        raise _no_rosbridge(address, "hung up without a word") from error
    if protocol.handshake_exc is not None:
        raise _refusal(address, protocol.handshake_exc) from protocol.handshake_exc
    # What came in the same packet as the answer is not lost.
    for event in protocol.events_received():
        if isinstance(event, Frame):
            web_socket._take(event)  # noqa: SLF001 - likewise
    return web_socket


def _refusal(address: RobotAddress, error: Exception) -> LinkError:
    if isinstance(error, InvalidStatus):
        status = error.response.status_code
        if status in NOT_ALLOWED:
            return LinkError(
                f"{address.shown} does not let us in: HTTP status {status}.",
                hint="Give the token or the user and password that this robot wants.",
            )
        return _no_rosbridge(address, f"answered as a web server: HTTP status {status}")
    if isinstance(error, ConnectionClosed):
        return _no_rosbridge(address, "closed the connection")
    return _no_rosbridge(address, "answered with something else than a websocket")


def _no_rosbridge(address: RobotAddress, what: str) -> LinkError:
    return LinkError(
        f"{address.shown} is not a rosbridge server: it {what}.",
        hint=f"rosbridge listens on port {address.uri.port} only if told so; its usual port is "
        f"9090. {START_HINT}",
    )
