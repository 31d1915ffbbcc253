"""A websocket over anyio: `websockets` understands the bytes, anyio moves them."""

import socket
import ssl
from collections import deque
from collections.abc import Callable, Generator
from dataclasses import dataclass
from functools import partial

import anyio
import anyio.lowlevel
from anyio.abc import ByteStream
from websockets.client import ClientProtocol
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.frames import Frame, Opcode
from websockets.protocol import State
from websockets.streams import StreamReader

from mapspeak.errors import LinkError
from mapspeak.links.rosbridge.address import DEFAULT_PORT, RobotAddress
from mapspeak.links.rosbridge.protocol.bounds import MAX_FRAME_BYTES

READ_BYTES = 262_144
FED_BYTES = 4_096
"""Bytes parsed in one go: 2,000 empty frames take some 20 ms."""
MAX_PARTS = 10_000
"""Frames of one message, beyond which the connection is given up."""
MAX_SKIPPED_BYTES = 1_000_000_000
"""A larger message is not worth waiting for its end."""
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
        parts: Its bytes, as they came; putting large ones together takes a moment. What is too
            large has none.
    """

    parts: tuple[bytes | bytearray, ...]
    is_text: bool
    n_bytes: int

    def join(self) -> bytes | bytearray:
        """Return all bytes; a message in one part as it is."""
        if len(self.parts) == 1:
            return self.parts[0]
        whole = bytearray()
        for part in self.parts:
            whole += part
        return whole


class SocketClosed(Exception):  # noqa: N818 - an event, never shown
    """The other end has gone; never leaves the client."""


class _Reader(StreamReader):
    """Hands a large frame on as it is, where the library copies it; skips one that is too large."""

    n_skipped = 0

    def read_exact(self, n: int) -> Generator[None, None, bytearray]:
        if n < READ_BYTES:
            return (yield from super().read_exact(n))
        if n > MAX_FRAME_BYTES:
            return (yield from self._skip(n))
        while len(self.buffer) < n and not self.eof:
            yield
        if self.eof:
            return (yield from super().read_exact(n))
        whole, self.buffer = self.buffer, self.buffer[n:]
        del whole[n:]
        return whole

    def _skip(self, n: int) -> Generator[None, None, bytearray]:
        self.n_skipped += n
        while n > len(self.buffer) and not self.eof:
            n -= len(self.buffer)
            self.buffer.clear()
            yield
        yield from super().read_exact(n)
        return bytearray()


class _Protocol(ClientProtocol):
    reader: _Reader

    def parse(self) -> Generator[None]:
        self.reader = _Reader()
        yield from super().parse()


class WebSocket:
    """An open websocket. One task may receive while others send."""

    def __init__(self, protocol: _Protocol, stream: ByteStream) -> None:
        self._protocol = protocol
        self._stream = stream
        self._sending = anyio.Lock()
        self._arrived: deque[Received] = deque()
        self._parts: list[bytes | bytearray] = []
        self._n_frames = self._n_bytes = 0
        self._is_text = True
        self._fault = ""
        self.n_bytes_received = 0
        """Of any kind, pongs included: an end that is alive makes it grow."""

    @property
    def fault(self) -> str:
        """The other end's violation of the protocol; empty without one."""
        error = self._protocol.parser_exc
        return self._fault or ("" if error is None or isinstance(error, EOFError) else str(error))

    async def receive(self) -> Received:
        """Return the next whole message.

        Raises:
            SocketClosed: None will come.
        """
        while not self._arrived:
            await self._read()
        return self._arrived.popleft()

    async def send(self, text: bytes) -> None:
        """Send one text message."""
        await self._say(partial(self._protocol.send_text, text))

    async def ping(self) -> None:
        """Ask the other end for a sign of life."""
        await self._say(partial(self._protocol.send_ping, b""))

    async def say_goodbye(self) -> None:
        """Announce the end of our messages; the receiver learns when the other end agrees."""
        if self._protocol.state is State.OPEN:
            self._protocol.send_close()
        await self._flush()

    async def aclose(self) -> None:
        """Close the socket at once."""
        await anyio.aclose_forcefully(self._stream)

    async def _read(self) -> None:
        try:
            data = await self._stream.receive(READ_BYTES)
        except (anyio.EndOfStream, anyio.BrokenResourceError, anyio.ClosedResourceError, OSError):
            raise SocketClosed from None
        self.n_bytes_received += len(data)
        for start in range(0, len(data), FED_BYTES):
            self._protocol.receive_data(data[start : start + FED_BYTES])
            events = self._protocol.events_received()
            for event in events:
                if isinstance(event, Frame):
                    self._take(event)
            if len(events) > 1:
                # Many small frames must not keep a stop waiting.
                await anyio.lowlevel.checkpoint()
        await self._flush()
        is_over = self._protocol.close_rcvd is not None or self._protocol.parser_exc is not None
        if is_over and not self._arrived:
            raise SocketClosed

    def _take(self, frame: Frame) -> None:
        if frame.opcode not in (Opcode.TEXT, Opcode.BINARY, Opcode.CONT):
            return
        if frame.opcode is not Opcode.CONT:
            self._is_text = frame.opcode is Opcode.TEXT
            self._parts, self._n_frames, self._n_bytes = [], 0, 0
        self._parts.append(_bytes_of(frame))
        self._n_frames += 1
        self._n_bytes += len(frame.data) + self._protocol.reader.n_skipped
        self._protocol.reader.n_skipped = 0
        if self._n_frames > MAX_PARTS:
            self._fault = f"a message in more than {MAX_PARTS} frames"
            raise SocketClosed
        if self._n_bytes > MAX_FRAME_BYTES:
            self._parts = []
        if frame.fin:
            parts, self._parts = tuple(self._parts), []
            self._arrived.append(Received(parts, self._is_text, self._n_bytes))

    async def _say(self, say: Callable[[], None]) -> None:
        if self._protocol.state is not State.OPEN:
            raise SocketClosed
        say()
        await self._flush()

    async def _flush(self) -> None:
        # Bytes of all callers leave in the order in which they were made.
        async with self._sending:
            data = b"".join(self._protocol.data_to_send())
            if not data:
                return
            try:
                await self._stream.send(data)
            except (anyio.BrokenResourceError, anyio.ClosedResourceError, OSError):
                raise SocketClosed from None


def _bytes_of(frame: Frame) -> bytes | bytearray:
    return bytes(frame.data) if isinstance(frame.data, memoryview) else frame.data


async def open_websocket(address: RobotAddress, *, timeout_s: float) -> WebSocket:
    """Connect to a rosbridge server.

    Raises:
        LinkError: No server answers, or another kind of server.
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
    # Compression is not offered: a small frame could unfold into a large one on the event loop.
    protocol = _Protocol(address.uri, max_size=MAX_SKIPPED_BYTES)
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
        # Bytes that came in the same packet as the answer are not lost.
        for event in protocol.events_received():
            if isinstance(event, Frame):
                web_socket._take(event)  # noqa: SLF001 - likewise
    except (SocketClosed, anyio.EndOfStream, anyio.BrokenResourceError, OSError) as error:
        raise _no_rosbridge(address, "hung up without a word") from error
    if protocol.handshake_exc is not None:
        raise _refusal(address, protocol.handshake_exc) from protocol.handshake_exc
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
    port, hint = address.uri.port, START_HINT
    if port != DEFAULT_PORT:
        hint = f"The usual port of rosbridge is {DEFAULT_PORT}, not {port}. {START_HINT}"
    return LinkError(f"{address.shown} is not a rosbridge server: it {what}.", hint=hint)
