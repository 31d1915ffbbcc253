"""One socket to the robot, made anew whenever it dies."""

import logging
from collections.abc import Callable
from contextlib import suppress

import anyio
import anyio.lowlevel
from anyio.abc import TaskGroup

from mapspeak.errors import LinkError, MapspeakError
from mapspeak.links.endpoints import no_answer
from mapspeak.links.rosbridge.address import RobotAddress
from mapspeak.links.rosbridge.connection import SocketConnection
from mapspeak.links.rosbridge.protocol.conversation import Event, ServerEvent, write_operation
from mapspeak.links.rosbridge.websocket import open_websocket
from mapspeak.ros.link import Patience

logger = logging.getLogger(__name__)


class Channel:
    """A connection that reconnects by itself.

    Args:
        on_event: Called with the server's events, except answers to calls.
        on_loss: Called with this channel when a connection has died or been replaced.
    """

    def __init__(
        self,
        address: RobotAddress,
        *,
        on_event: Callable[[Event], None],
        on_loss: Callable[["Channel"], None],
        patience: Patience,
    ) -> None:
        self._address = address
        self._on_event = on_event
        self._on_loss = on_loss
        self._patience = patience
        self._standing: dict[str, bytes] = {}
        self._connection: SocketConnection | None = None
        self._is_up = anyio.Event()
        self._fault: MapspeakError | None = None
        self._is_closing = False
        self._wanted = anyio.Event()
        self._up_since_s = 0.0
        self._lost_since_s: float | None = None
        self.was_replaced = False
        """The latest loss was our own doing: the robot and its rosbridge went on."""
        self._fault_pause_s = 0.0
        self.n_connections = 0
        """How often it was connected; more than one means that it was lost in between."""

    @property
    def is_up(self) -> bool:
        """True when something sent now leaves at once."""
        return self._is_up.is_set()

    @property
    def is_waiting(self) -> bool:
        """True while a call over it has no answer yet."""
        return self._connection is not None and self._connection.is_waiting

    @property
    def up_for_s(self) -> float | None:
        """Since when it has been connected, in wall time; None while it is not."""
        return anyio.current_time() - self._up_since_s if self.is_up else None

    @property
    def lost_for_s(self) -> float | None:
        """Since when it has been lost, in wall time; None while it is connected."""
        return None if self._lost_since_s is None else anyio.current_time() - self._lost_since_s

    async def start(self, tasks: TaskGroup) -> None:
        """Connect for the first time, and keep connected in the background.

        Raises:
            LinkError: The robot cannot be reached.
        """
        await self._connect(tasks)
        tasks.start_soon(self._keep_up, tasks)

    def keep_standing(self, operation_id: str, text: bytes) -> None:
        """Send something now, and again after every reconnection."""
        self._standing[operation_id] = text
        self.send_if_up(text)

    def end_standing(self, operation_id: str, text: bytes) -> None:
        """End what `keep_standing` began, with the text that says so."""
        if self._standing.pop(operation_id, None) is not None:
            self.send_if_up(text)

    def send_if_up(self, text: bytes) -> bool:
        """Send something that is of no use later; True when it could be sent."""
        if self._connection is None or not self.is_up or self._connection.is_over.is_set():
            return False
        self._connection.send(text)
        return True

    async def send_when_up(self, text: bytes) -> None:
        """Send something that must not be lost while the socket is being replaced."""
        with suppress(LinkError):
            await self.send(text, timeout_s=self._patience.answer_s)

    async def send(self, text: bytes, *, timeout_s: float) -> None:
        """Send something once there is a connection."""
        (await self.wait_until_up(timeout_s)).send(text)

    async def call(self, text: bytes, *, call_id: str, what: str, timeout_s: float) -> object:
        """Return the answer of a service."""
        deadline_s = anyio.current_time() + timeout_s
        connection = await self.wait_until_up(timeout_s)
        n_answers = connection.n_answers
        answer: ServerEvent | None = None
        with anyio.move_on_after(deadline_s - anyio.current_time()) as limit:
            answer = await connection.ask(text, call_id=call_id)
        if limit.cancelled_caught:
            # Some versions of rosbridge do one thing after another: nothing behind this call
            # would be answered either.
            if connection.n_answers == n_answers:
                self.replace(connection)
            raise no_answer(what, timeout_s)
        if answer is None:
            raise self._lost(f"was lost while {what} was asked")
        return _values_of(answer, what)

    def replace(self, connection: SocketConnection | None = None) -> None:
        """Return up a socket that does not answer for a fresh one; call under way may finish."""
        stuck = connection or self._connection
        if stuck is not None and stuck is self._connection:
            self.was_replaced = True
            stuck.retire()

    async def say_goodbye(self) -> None:
        """Close as the protocol wants it, within the time for that."""
        self._is_closing = True
        if self._connection is not None and self.is_up:
            with anyio.move_on_after(self._patience.goodbye_s):
                await self._connection.say_goodbye()

    async def _keep_up(self, tasks: TaskGroup) -> None:
        while self._connection is not None:
            await self._connection.is_over.wait()
            if self._is_closing:
                return
            self._is_up = anyio.Event()
            self._lost_since_s = anyio.current_time()
            self._on_loss(self)
            await self._connect_again(tasks, fault=self._connection.fault)

    async def _connect_again(self, tasks: TaskGroup, *, fault: str) -> None:
        """Reconnect until it succeeds, with longer and longer pauses.

        Args:
            tasks: Where the new connection is served.
            fault: The other end's protocol fault in the last one; such an end gets its pauses too.
        """
        pause_s = self._pause_after(self._fault_pause_s) if fault else 0.0
        self._fault_pause_s = pause_s
        if fault:
            logger.warning(
                "The connection to %s is made anew, after %g s: %s.",
                self._address.shown,
                pause_s,
                fault,
            )
        while True:
            with anyio.move_on_after(pause_s):
                # A waiting caller learns at once whether the robot is back.
                await self._wanted.wait()
            self._wanted = anyio.Event()
            try:
                await self._connect(tasks)
            except MapspeakError as error:
                # A CA file that cannot be read now may be written anew.
                self._fault = error
                pause_s = self._pause_after(pause_s)
            else:
                return

    def _pause_after(self, pause_s: float) -> float:
        return min(max(2 * pause_s, self._patience.first_pause_s), self._patience.longest_pause_s)

    async def _connect(self, tasks: TaskGroup) -> None:
        socket = await open_websocket(self._address, timeout_s=self._patience.connect_s)
        connection = SocketConnection(socket, on_event=self._on_event, patience=self._patience)
        if self._address.token is not None:
            connection.send(write_operation("auth", token=self._address.token))
        for text in self._standing.values():
            connection.send(text)
        self._connection = connection
        self.n_connections += 1
        self._fault = self._lost_since_s = None
        tasks.start_soon(connection.serve)
        self.was_replaced = False
        self._up_since_s = anyio.current_time()
        self._is_up.set()

    async def wait_until_up(self, timeout_s: float) -> SocketConnection:
        """Return the connection at once, or when there is one again."""
        with anyio.move_on_after(self._limit_s(timeout_s)):
            while self._connection is None or not self.is_up or self._connection.is_over.is_set():
                # A connection that has just ended is noticed by `_keep_up` before long.
                self._wanted.set()
                await self._is_up.wait()
                await anyio.lowlevel.checkpoint()
            return self._connection
        raise self._lost(f"has been lost for {self.lost_for_s or 0.0:.0f} s")

    def _limit_s(self, timeout_s: float) -> float:
        """Return how long to wait: from the loss on, so that waits for a lost robot do not add up.

        One that has been away for longer gets the time of one attempt.
        """
        return min(timeout_s, max(timeout_s - (self.lost_for_s or 0.0), self._patience.attempt_s))

    def _lost(self, what: str) -> LinkError:
        why = f" {self._fault.message}" if self._fault is not None else ""
        return LinkError(
            f"The connection to {self._address.shown} {what}.{why}",
            hint="It is made anew by itself; check that the robot and its rosbridge still run.",
        )


def _values_of(answer: ServerEvent, what: str) -> object:
    if answer.is_result:
        return answer.values
    said = answer.values if isinstance(answer.values, str) else ""
    reason = " ".join(said.split())[:300].rstrip(". ")
    raise LinkError(
        f"{what} failed: {reason or 'it gave no reason'}.",
        hint="Check its name, its type and the fields of the request.",
    )
