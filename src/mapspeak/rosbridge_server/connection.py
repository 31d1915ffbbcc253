"""One client's websocket on a byte stream, and what waits to be sent over it: bounded.

The library `websockets` speaks the protocol, this moves the bytes.
"""

import math
from collections import deque
from collections.abc import Callable, Iterable

import anyio
from anyio.abc import ByteStream
from websockets.exceptions import ProtocolError
from websockets.extensions.permessage_deflate import ServerPerMessageDeflateFactory
from websockets.frames import CloseCode, Opcode
from websockets.frames import Frame as SocketFrame
from websockets.http11 import Request
from websockets.protocol import State
from websockets.server import ServerProtocol

from mapspeak.rosbridge_server.hub import Frame, Publication

LONGEST_MESSAGE = 10_000_000
"""What rosbridge takes in at most, unless told otherwise."""
FRAME_LENGTH = 1 << 18
"""A long message leaves in frames of this length: compressing one must not hold up the others."""
HANDSHAKE_TIMEOUT_S = 10.0
CLOSING_TIMEOUT_S = 1.0


class ServerWebSocket:
    """The server's end of one connection."""

    def __init__(self, stream: ByteStream) -> None:
        self._stream = stream
        compression = ServerPerMessageDeflateFactory(compress_settings={"level": 1})
        self._protocol = ServerProtocol(extensions=[compression], max_size=LONGEST_MESSAGE)
        self._flushing = anyio.Lock()
        self._sending = anyio.Lock()
        self._frames: list[SocketFrame] = []

    async def accept(self) -> bool:
        """Shake hands; False when the other end is no websocket client."""
        with anyio.move_on_after(HANDSHAKE_TIMEOUT_S):
            while self._protocol.state is State.CONNECTING and await self._read():
                for event in self._protocol.events_received():
                    if isinstance(event, Request):
                        self._protocol.send_response(self._protocol.accept(event))
                await self._flush()
                if self._protocol.handshake_exc is not None:
                    break
        return self._protocol.state is State.OPEN

    async def receive(self) -> str | bytes | None:
        """Return the next message; None when there will be no more."""
        parts: list[SocketFrame] = []
        while (frame := await self._next_frame()) is not None:
            if frame.opcode in (Opcode.TEXT, Opcode.BINARY, Opcode.CONT):
                parts.append(frame)
            if parts and parts[-1].fin:
                data = b"".join(part.data for part in parts)
                if parts[0].opcode is Opcode.BINARY:
                    return data
                text = _decode(data)
                if text is not None:
                    return text
                self._protocol.fail(CloseCode.INVALID_DATA)
                await self._flush()
                return None
        return None

    async def send(self, message: bytes, *, is_text: bool) -> None:
        """Send one message; return when the network has taken it.

        Raises:
            anyio.BrokenResourceError: The connection is gone.
        """
        async with self._sending:
            for start in range(0, max(len(message), 1), FRAME_LENGTH):
                part = message[start : start + FRAME_LENGTH]
                self._send_frame(
                    part,
                    is_text=is_text,
                    is_first=start == 0,
                    is_last=start + FRAME_LENGTH >= len(message),
                )
                await self._flush()

    async def close(self) -> None:
        """Say goodbye, and hangs up without waiting long for an answer."""
        with anyio.move_on_after(CLOSING_TIMEOUT_S, shield=True):
            try:
                if self._protocol.state is State.OPEN:
                    self._protocol.send_close(CloseCode.GOING_AWAY)
                await self._flush()
            except (anyio.BrokenResourceError, anyio.ClosedResourceError):
                pass
            await self._stream.aclose()

    def _send_frame(self, part: bytes, *, is_text: bool, is_first: bool, is_last: bool) -> None:
        if self._protocol.state is not State.OPEN:
            raise anyio.BrokenResourceError
        if not is_first:
            self._protocol.send_continuation(part, is_last)
        elif is_text:
            self._protocol.send_text(part, is_last)
        else:
            self._protocol.send_binary(part, is_last)

    async def _next_frame(self) -> SocketFrame | None:
        while not self._frames:
            if not await self._read():
                return None
            events = self._protocol.events_received()
            self._frames = [event for event in events if isinstance(event, SocketFrame)]
            await self._flush()
        return self._frames.pop(0)

    async def _read(self) -> bool:
        """Take in what has arrived; False when the other end has hung up."""
        try:
            data = await self._stream.receive()
        except (anyio.EndOfStream, anyio.BrokenResourceError, anyio.ClosedResourceError):
            self._protocol.receive_eof()
            return False
        try:
            self._protocol.receive_data(data)
        except ProtocolError:
            return False
        return True

    async def _flush(self) -> None:
        async with self._flushing:
            for data in self._protocol.data_to_send():
                if data:
                    await self._stream.send(data)
                else:
                    await self._stream.send_eof()


def _decode(data: bytes) -> str | None:
    try:
        return data.decode()
    except UnicodeDecodeError:
        return None


MOST_REPLIES = 1000

Item = Frame | Publication


class Lane:
    """The messages of one topic that wait; when there are too many, the oldest goes."""

    def __init__(self, *, depth: int, throttle_s: float, holds_back: bool) -> None:
        self.waiting: deque[Item] = deque(maxlen=depth)
        self.throttle_s = throttle_s
        self.holds_back = holds_back
        self.due_s = -math.inf

    def offer(self, item: Item, now_s: float) -> None:
        """Take a message in, unless it comes too early and nothing may wait."""
        if now_s >= self.due_s or self.holds_back:
            self.waiting.append(item)
        if now_s >= self.due_s and not self.holds_back:
            self.due_s = now_s + self.throttle_s

    def take(self, now_s: float) -> Item | None:
        """Return the message that may go now."""
        if not self.waiting or (self.holds_back and now_s < self.due_s):
            return None
        if self.holds_back:
            self.due_s = now_s + self.throttle_s
        return self.waiting.popleft()


class Outbox:
    """One client's replies, in order, and its topics, one lane each; all on the wall clock.

    Args:
        give_up: Called when the client asks and asks, and reads nothing.
    """

    def __init__(self, give_up: Callable[[], None]) -> None:
        self._give_up = give_up
        self._replies: deque[Frame] = deque()
        self._lanes: dict[str, Lane] = {}
        self._news = anyio.Event()

    def open_lane(self, topic: str, *, depth: int, throttle_s: float, holds_back: bool) -> None:
        """Make room for a topic, or change the room it has."""
        lane = Lane(depth=depth, throttle_s=throttle_s, holds_back=holds_back)
        if topic in self._lanes:
            lane.waiting.extend(self._lanes[topic].waiting)
        self._lanes[topic] = lane

    def close_lane(self, topic: str) -> None:
        """Forget a topic and what waits on it."""
        self._lanes.pop(topic, None)

    def reply(self, frame: Frame) -> None:
        """Put an answer behind the others; none is ever left out."""
        if len(self._replies) >= MOST_REPLIES:
            self._give_up()
            return
        self._replies.append(frame)
        self._news.set()

    def hear(self, publication: Publication) -> None:
        """Put a message on its topic's lane."""
        self.offer(publication.topic, publication)

    def offer(self, lane: str, item: Item) -> None:
        """Put something on a lane, if it is open; one too many pushes the oldest out."""
        if lane in self._lanes:
            self._lanes[lane].offer(item, anyio.current_time())
            self._news.set()

    async def take(self) -> Iterable[Item]:
        """Wait for something to send: all answers, then at most one message of each topic."""
        while True:
            if self._news.is_set():
                self._news = anyio.Event()
            now_s = anyio.current_time()
            replies, self._replies = self._replies, deque()
            due = [lane.take(now_s) for lane in self._lanes.values()]
            found = [*replies, *(each for each in due if each is not None)]
            if found:
                return found
            with anyio.move_on_at(self._next_due_s()):
                await self._news.wait()

    def _next_due_s(self) -> float:
        return min((lane.due_s for lane in self._lanes.values() if lane.waiting), default=math.inf)
