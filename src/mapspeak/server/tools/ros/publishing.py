"""Publishing once or for a time; velocities one at a time, and never against a drive."""

from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass

import anyio

from mapspeak.errors import GoalError, LinkError
from mapspeak.ros.messages import Message
from mapspeak.safety import publishing_for
from mapspeak.server.tools.ros.commands import RosCommands
from mapspeak.session import Session

BY_HAND = "If the robot still moves, stop it by hand; stop_robot works once the connection is back."


@dataclass(frozen=True, slots=True, kw_only=True)
class Publication:
    """What is to be published.

    Attributes:
        topic: Its full name.
        type: As this ROS writes it.
        message: Each time the same.
        is_moving: It is a velocity other than a stand, which a stand has to follow.
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
    """How far a publication has come."""

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

    async def publish(self, wanted: Publication) -> str:
        """Publishes, and says what was sent and what it ended with.

        Raises:
            GoalError: It is a velocity, and something else moves the robot.
            LinkError: The robot was stopped before, or the connection was lost: says what was sent.
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

    async def _send(self, wanted: Publication, ticket: int) -> str:
        await self._commands.prepare(wanted.topic, wanted.type)
        if self._was_stopped(ticket):
            raise LinkError(
                "The robot was stopped before anything was published.",
                hint="Publish again when it may move.",
            )
        if wanted.duration_s is not None:
            return await self._send_for(wanted, wanted.duration_s, ticket)
        await self._commands.publish(wanted.topic, wanted.message)
        return f"Published once on {wanted.topic}"

    async def _send_for(self, wanted: Publication, duration_s: float, ticket: int) -> str:
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

    async def _repeat(self, wanted: Publication, duration_s: float, run: _Run, ticket: int) -> None:
        """Publishes until the time is over or something else ends it.

        Raises:
            LinkError: The connection was lost. What was begun does not go on when it is back.
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
    def _moving(self, wanted: Publication) -> Generator[None]:
        """Keeps others from the topic while the context lasts."""
        until_s = anyio.current_time() + (wanted.duration_s or 0.0)
        self._moving_until_s[wanted.topic] = until_s
        try:
            yield
        finally:
            del self._moving_until_s[wanted.topic]

    async def _check_that_nothing_moves(self, topic: str) -> None:
        drive = self._session.drives.under_way
        if drive is not None:
            # It may have ended since somebody asked.
            await self._session.drives.report(drive.goal_id)
        drive = self._session.drives.under_way
        if drive is not None:
            raise GoalError(
                f"{drive.goal_id} to {drive.place} is under way: a velocity on {topic} would work "
                "against it.",
                hint="Wait for its end with wait_for_goal, or end it with cancel_goal or "
                "stop_robot.",
            )
        left_s = self._left_s(topic)
        if left_s is not None:
            raise GoalError(
                f"Another ros_publish moves the robot on {topic} for {left_s:.1f} s more.",
                hint="Wait for its end, or end it with stop_robot.",
            )

    def _say_what_moves(self, topic: str) -> str:
        """Says what goes on moving the robot, though this message may be a stand."""
        left_s = self._left_s(topic)
        if left_s is None:
            return "."
        return f". Another ros_publish goes on there for {left_s:.1f} s; stop_robot ends it."

    def _left_s(self, topic: str) -> float | None:
        until_s = self._moving_until_s.get(topic)
        return None if until_s is None else max(until_s - anyio.current_time(), 0.0)


def _cut_off(wanted: Publication, run: _Run, *, has_stood: bool) -> LinkError:
    said = f"{run.say()} on {wanted.topic}, then the connection was lost"
    if not wanted.is_moving:
        return LinkError(
            f"{said}: whether the latest arrived is not known.", hint="Publish it again."
        )
    if has_stood:
        return LinkError(f"{said}; it is back, and a stand was sent.", hint=BY_HAND)
    return LinkError(
        f"{said}. The stand could not be sent: whether the robot stands is not known.",
        hint=BY_HAND,
    )
