"""One live socket: its queue of messages to send, and the calls that wait for an answer."""

import logging
from collections.abc import Awaitable, Callable
from contextlib import suppress

import anyio
import anyio.lowlevel
import anyio.to_thread

from mapspeak.errors import LinkError
from mapspeak.links.rosbridge.protocol.bounds import MAX_FRAME_BYTES, FrameFault
from mapspeak.links.rosbridge.protocol.conversation import (
    LIGHT_BYTES,
    Conversation,
    Event,
    EventKind,
    FrameRefused,
    ServerEvent,
)
from mapspeak.links.rosbridge.websocket import Received, SocketClosed, WebSocket
from mapspeak.ros.link import Patience

logger = logging.getLogger(__name__)

MAX_UNSENT = 10_000
MAX_REFUSED = 1_000
"""Frames in a row that could not be understood, after which a new connection is tried."""


class SocketConnection:
    """Serves one socket until it dies or is retired.

    Args:
        on_event: Called with everything the server says but the answers to calls.
    """

    def __init__(
        self, socket: WebSocket, *, on_event: Callable[[Event], None], patience: Patience
    ) -> None:
        self._socket = socket
        self._on_event = on_event
        self._patience = patience
        self._conversation = Conversation()
        self._unsent, self._to_send = anyio.create_memory_object_stream[bytes](MAX_UNSENT)
        self._pending: dict[str, anyio.Event] = {}
        self._answers: dict[str, ServerEvent] = {}
        self._may_go = anyio.Event()
        self._is_sent = anyio.Event()
        self.is_over = anyio.Event()
        """Set when nothing more can be sent here."""
        self.n_answers = 0
        self.fault = ""
        """Why the other end is not worth another connection at once; empty where it is."""
        self._n_refused = 0
        self._is_warned = False

    @property
    def is_waiting(self) -> bool:
        """True while a call has no answer yet."""
        return bool(self._pending)

    def send(self, text: bytes) -> None:
        """Send a text after those before it."""
        try:
            self._is_sent = anyio.Event()
            self._unsent.send_nowait(text)
        except (anyio.WouldBlock, anyio.BrokenResourceError, anyio.ClosedResourceError):
            raise LinkError(
                "The robot does not take what we send.",
                hint="Its network may be overloaded or gone: check the connection and try again.",
            ) from None

    async def ask(self, text: bytes, *, call_id: str) -> ServerEvent | None:
        """Return the answer to a call; None when the socket died first."""
        is_over = self._pending[call_id] = anyio.Event()
        try:
            self.send(text)
            await is_over.wait()
        finally:
            del self._pending[call_id]
            answer = self._answers.pop(call_id, None)
            self._go_if_retired()
        return answer

    async def serve(self) -> None:
        """Move messages both ways until the socket is closed, silent for too long, or retired."""
        try:
            async with anyio.create_task_group() as tasks:
                for part in (self._write, self._listen_for_life, self._wait_for_leave, self._read):
                    tasks.start_soon(self._until_closed, part, tasks.cancel_scope)
        finally:
            self.is_over.set()
            self._unsent.close()
            self._to_send.close()
            for is_over in self._pending.values():
                is_over.set()
            with anyio.CancelScope(shield=True):
                await self._socket.aclose()

    def retire(self) -> None:
        """Let the calls under way finish, and close then."""
        self.is_over.set()
        self._go_if_retired()

    async def say_goodbye(self) -> None:
        """Wait until all is sent, and close as the protocol wants it; the caller sets a limit."""
        if self._unsent.statistics().current_buffer_used:
            await self._is_sent.wait()
        with suppress(SocketClosed):
            await self._socket.say_goodbye()
        await self.is_over.wait()

    def _go_if_retired(self) -> None:
        if self.is_over.is_set() and not self._pending:
            self._may_go.set()

    async def _until_closed(
        self, part: Callable[[], Awaitable[None]], scope: anyio.CancelScope
    ) -> None:
        with suppress(SocketClosed):
            await part()
        self.fault = self.fault or self._socket.fault
        scope.cancel()

    async def _write(self) -> None:
        async for text in self._to_send:
            await self._socket.send(text)
            if not self._unsent.statistics().current_buffer_used:
                self._is_sent.set()

    async def _read(self) -> None:
        while True:
            event = await self._understand(await self._socket.receive())
            self._judge(event)
            if isinstance(event, ServerEvent) and event.kind is EventKind.ANSWERED:
                self._answer(event)
            elif event is not None:
                self._tell(event)
            # A waiting caller sees this message before the next one comes.
            await anyio.lowlevel.checkpoint()

    async def _understand(self, received: Received) -> Event | None:
        if received.n_bytes > MAX_FRAME_BYTES:
            return FrameRefused(
                FrameFault.TOO_LARGE, f"{received.n_bytes} > {MAX_FRAME_BYTES} bytes"
            )
        if received.n_bytes <= LIGHT_BYTES and self._conversation.is_light(
            frame := received.join()
        ):
            return self._conversation.receive(frame, is_text=received.is_text)
        # A stop must not wait until a large map is read.
        return await anyio.to_thread.run_sync(
            lambda: self._conversation.receive(received.join(), is_text=received.is_text)
        )

    def _judge(self, event: Event | None) -> None:
        """Warn of a frame that was refused, once; give up an end that sends nothing else."""
        if not isinstance(event, FrameRefused):
            self._n_refused = 0
            return
        self._n_refused += 1
        if not self._is_warned:
            self._is_warned = True
            logger.warning(
                "A message of the robot was left away: %s (%s).", event.fault, event.detail
            )
        if self._n_refused > MAX_REFUSED:
            self.fault = f"{MAX_REFUSED} messages in a row could not be understood"
            raise SocketClosed

    def _tell(self, event: Event) -> None:
        try:
            self._on_event(event)
        except Exception:
            # A fault of ours; one odd message must not cost the robot its connection.
            logger.exception("What the robot said could not be taken in")

    def _answer(self, answer: ServerEvent) -> None:
        self.n_answers += 1
        # An answer that comes after its caller has gone is of no use to anybody.
        if answer.key in self._pending:
            self._answers[answer.key] = answer
            self._pending[answer.key].set()

    async def _listen_for_life(self) -> None:
        n_bytes, heard_s = 0, anyio.current_time()
        while anyio.current_time() - heard_s < self._patience.silence_s:
            with anyio.move_on_after(self._patience.ping_s):
                await self._socket.ping()
            await anyio.sleep(self._patience.ping_s)
            if self._socket.n_bytes_received != n_bytes:
                n_bytes, heard_s = self._socket.n_bytes_received, anyio.current_time()

    async def _wait_for_leave(self) -> None:
        await self.is_over.wait()
        with anyio.move_on_after(self._patience.retired_s):
            await self._may_go.wait()
