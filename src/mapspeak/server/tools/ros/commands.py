"""Everything the ROS tools change on the robot, through one door; publishing too."""

from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from dataclasses import dataclass

import anyio

from mapspeak.errors import GoalError, LinkError
from mapspeak.ros.messages.fields import Message
from mapspeak.ros.port import RosConnection
from mapspeak.safety import (
    Act,
    Call,
    GuardedConnection,
    Publish,
    SetParameter,
    publishing_for,
    zero_velocity_of,
)
from mapspeak.server.text.offered import lead
from mapspeak.session import Session

SETTLE_S = 0.3
"""From the first advertisement until the robot's nodes receive messages, in wall time."""
LONGEST_SETTLE_S = 1.0
"""Longest further wait where a robot under load does not know the publisher yet."""
LOOK_S = 0.1
N_STANDS = 3
PAUSE_S = 0.05
STAND_S = 1.0
VELOCITIES = frozenset(
    {
        "geometry_msgs/Twist",
        "geometry_msgs/TwistStamped",
        "ackermann_msgs/AckermannDrive",
        "ackermann_msgs/AckermannDriveStamped",
    }
)
"""Types on which a robot goes on until it is told otherwise, or its driver loses patience."""


class RosCommands:
    """Asks the guard, and publishes by the methods of the port alone.

    Args:
        connection: Gives the connection, which may be guarded.
    """

    def __init__(self, connection: Callable[[], RosConnection]) -> None:
        self._connection = connection
        self._advertised: set[tuple[str, str]] = set()

    def check_name(self, command: Publish | Call | Act | SetParameter) -> None:
        """Return when a command is not denied for its name: said before anything else is checked.

        Raises:
            PolicyError: It is.
        """
        connection = self._connection()
        if isinstance(connection, GuardedConnection):
            connection.check_name(command)

    async def prepare(self, topic: str, type_name: str) -> None:
        """Advertise a topic, and wait until the robot has noticed.

        It stays advertised: the robot's brake may use the same topic.
        """
        self._connection().advertise(topic, type_name=type_name)
        if (topic, type_name) not in self._advertised:
            await anyio.sleep(SETTLE_S)
            await self._wait_until_known(topic)
            self._advertised.add((topic, type_name))

    async def _wait_until_known(self, topic: str) -> None:
        """Return when the robot knows a publisher, cannot answer, or the time is over."""
        with suppress(LinkError), anyio.move_on_after(LONGEST_SETTLE_S):
            fetch = self._connection().fetch_publishers
            while not await fetch(topic):  # noqa: ASYNC110 - it happens in other programs
                await anyio.sleep(LOOK_S)

    @property
    def connection(self) -> RosConnection:
        """The connection, which may be guarded."""
        return self._connection()

    async def publish_at_once(self, topic: str, message: Message) -> None:
        """Publish one message on a topic that was prepared, now or not at all.

        Raises:
            LinkError: There is no connection.
        """
        connection = self._connection()
        if connection.lost_for_s is not None:
            raise LinkError(
                f"Nothing can be sent on {topic}: there is no connection.",
                hint="Try again: the connection is made anew by itself.",
            )
        await connection.publish(topic, message)

    def note_velocity(self, topic: str, message: Message) -> None:
        """Let every stop from now on publish zero velocity on a topic too."""
        self._connection().started.note_velocity(topic, zero=zero_velocity_of(message))

    async def stand(self, topic: str, message: Message) -> bool:
        """Publish the stand for a velocity, whatever happens to the call that moved the robot.

        Where the connection is lost it is waited for a moment. Gives whether a stand was sent.
        """
        zero = zero_velocity_of(message)
        n_sent = 0
        with anyio.CancelScope(shield=True), anyio.move_on_after(STAND_S):
            while n_sent < N_STANDS:
                if self._connection().publish_everywhere(topic, zero):
                    n_sent += 1
                await anyio.sleep(PAUSE_S)
        return n_sent > 0


STOP = "{stop_robot} ends it."
BY_HAND = (
    "If the robot still moves, stop it by hand. {stop_robot} works once the connection is back."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishRequest:
    """A request to publish messages.

    Attributes:
        topic: Its full name.
        type: As this ROS writes it.
        message: The same each time.
        is_moving: It is a velocity other than zero, which zero velocity has to follow.
        duration_s: From the first message on, in wall time; None for a single message.
        rate_hz: Messages a second.
    """

    topic: str
    type: str
    message: Message
    is_moving: bool
    duration_s: float | None
    rate_hz: float


class _Run:
    """The progress of a publication."""

    def __init__(self) -> None:
        self.started_s = anyio.current_time()
        self.n_sent = 0
        self.passed_s = 0.0
        self.ended_by = ""

    def say(self) -> str:
        times = "once" if self.n_sent == 1 else f"{self.n_sent} times"
        return f"Published {times} in {self.passed_s:.2f} s{self.ended_by}"


class Publisher:
    """Publishes for the model.

    Args:
        session: Knows of drives and stops.
        commands: Sends.
    """

    def __init__(self, session: Session, commands: RosCommands) -> None:
        self._session = session
        self._commands = commands
        self._moving_until_s: dict[str, float] = {}

    async def publish(self, wanted: PublishRequest) -> str:
        """Publish, and say how much was sent and how it ended.

        Raises:
            GoalError: It is a velocity, and something else moves the robot.
            LinkError: The robot was stopped before, or the connection was lost: says how much was
                sent.
        """
        with self._session.drives.preparing() as ticket:
            if not wanted.is_moving:
                said = await self._send(wanted, ticket)
                return f"{said}{self._say_what_moves(wanted.topic)}"
            await self._check_that_nothing_moves(wanted.topic)
            self._commands.note_velocity(wanted.topic, wanted.message)
            with self._moving(wanted):
                said = f"{await self._send(wanted, ticket)}."
            guard = self._session.guard
            return " ".join((said, *(() if guard is None else guard.warn_of_servers())))

    async def _send(self, wanted: PublishRequest, ticket: int) -> str:
        await self._commands.prepare(wanted.topic, wanted.type)
        if self._was_stopped(ticket):
            raise LinkError(
                "The robot was stopped before anything was published.",
                hint="Publish again when it may move.",
            )
        if wanted.duration_s is not None:
            return await self._send_for(wanted, wanted.duration_s, ticket)
        await self._commands.connection.publish(wanted.topic, wanted.message)
        return f"Published once on {wanted.topic}"

    async def _send_for(self, wanted: PublishRequest, duration_s: float, ticket: int) -> str:
        run = _Run()
        is_cut_off, has_stood = False, True
        try:
            with publishing_for(duration_s):
                await self._repeat(wanted, duration_s, run, ticket)
        except LinkError:
            is_cut_off = True
        finally:
            run.passed_s = anyio.current_time() - run.started_s
            if wanted.is_moving:
                has_stood = await self._commands.stand(wanted.topic, wanted.message)
        if is_cut_off or not has_stood:
            raise _cut_off(wanted, run, has_stood=has_stood)
        return f"{run.say()}{', then a stand' if wanted.is_moving else ''} on {wanted.topic}"

    async def _repeat(
        self, wanted: PublishRequest, duration_s: float, run: _Run, ticket: int
    ) -> None:
        """Publish until the time is over or something else ends it.

        Raises:
            LinkError: The connection was lost. The publication does not go on when it is back.
        """
        while run.n_sent / wanted.rate_hz < duration_s and not run.ended_by:
            await self._commands.publish_at_once(wanted.topic, wanted.message)
            run.n_sent += 1
            due_s = min(run.n_sent / wanted.rate_hz, duration_s)
            await anyio.sleep_until(run.started_s + due_s)
            run.ended_by = self._find_end(ticket, is_moving=wanted.is_moving)

    def _find_end(self, ticket: int, *, is_moving: bool) -> str:
        if self._was_stopped(ticket):
            return " until the robot was stopped"
        drive = self._session.drives.under_way
        if is_moving and drive is not None:
            return f" until {drive.goal_id} began, which drives the robot now"
        return ""

    def _was_stopped(self, ticket: int) -> bool:
        with self._session.drives.preparing() as now:
            return now != ticket

    @contextmanager
    def _moving(self, wanted: PublishRequest) -> Generator[None]:
        """Keep others from the topic while the context lasts."""
        until_s = anyio.current_time() + (wanted.duration_s or 0.0)
        self._moving_until_s[wanted.topic] = until_s
        try:
            yield
        finally:
            del self._moving_until_s[wanted.topic]

    async def _check_that_nothing_moves(self, topic: str) -> None:
        drive = self._session.drives.under_way
        if drive is not None:
            # It may have ended since the last report.
            await self._session.drives.report(drive.goal_id)
        drive = self._session.drives.under_way
        if drive is not None:
            raise GoalError(
                f"{drive.goal_id} to {drive.place} is under way: a velocity on {topic} would work "
                "against it.",
                hint=lead(f"Wait for its end, or end it. {{wait_for_goal}} waits. {STOP}"),
            )
        left_s = self._left_s(topic)
        if left_s is not None:
            raise GoalError(
                f"Another publication moves the robot on {topic} for {left_s:.1f} s more.",
                hint=lead(f"Wait for its end, or end it. {STOP}"),
            )

    def _say_what_moves(self, topic: str) -> str:
        """Name another publication that still moves the robot, even after a zero velocity."""
        left_s = self._left_s(topic)
        if left_s is None:
            return "."
        return f". Another publication goes on there for {left_s:.1f} s. {lead(STOP)}".rstrip()

    def _left_s(self, topic: str) -> float | None:
        until_s = self._moving_until_s.get(topic)
        return None if until_s is None else max(until_s - anyio.current_time(), 0.0)


def _cut_off(wanted: PublishRequest, run: _Run, *, has_stood: bool) -> LinkError:
    said = f"{run.say()} on {wanted.topic}, then the connection was lost"
    if not wanted.is_moving:
        return LinkError(
            f"{said}: whether the latest arrived is not known.", hint="Publish it again."
        )
    if has_stood:
        return LinkError(f"{said}; it is back, and a stand was sent.", hint=lead(BY_HAND))
    return LinkError(
        f"{said}. The stand could not be sent: whether the robot stands is not known.",
        hint=lead(BY_HAND),
    )
