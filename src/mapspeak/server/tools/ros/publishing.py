"""Publishing for the model: once or for a time, one velocity at a time, a stand after each."""

import math
from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros.listening import hear_frames
from mapspeak.ros.messages.fields import VELOCITIES, Message, bare_type
from mapspeak.ros.port import find_nearest
from mapspeak.safety import publishing_for, zero_velocity_of
from mapspeak.server.text.ros.outcomes import (
    CUT_OFF,
    CUT_OFF_MOVING,
    CUT_OFF_STANDING,
    DRIVE_UNDER_WAY,
    ENDLESS,
    NO_CONNECTION,
    NO_FRAME,
    PUBLICATION_UNDER_WAY,
    STOPPED_BEFORE,
    UNTIL_DRIVE,
    UNTIL_STOPPED,
    say_going_on,
    say_published,
)
from mapspeak.server.tools.ros.inquiry import RosInquiry
from mapspeak.session import Session

TRANSFORMS = "tf2_msgs/TFMessage"
FRAMES_COME_S = 2.0
"""Longest wait for a published frame, in wall time."""
MOST_NAMED = 12
LONGEST_S = 25.0
SETTLE_S = 0.3
"""From the first advertisement until the robot's nodes receive messages, in wall time."""
LONGEST_SETTLE_S = 1.0
"""Longest further wait where a robot under load does not know the publisher yet."""
LOOK_S = 0.1
N_STANDS = 3
PAUSE_S = 0.05
STAND_S = 1.0


@dataclass(slots=True, kw_only=True)
class PublishRun:
    """Messages that are published, and how far that has come.

    Attributes:
        topic: Its full name.
        type: As this ROS writes it.
        message: The same each time.
        duration_s: From the first message on, in wall time; None for a single message.
        rate_hz: Messages a second.
        ticket: Of the session's drives: another one since means that the robot was stopped.
        until_s: When it ends, by the event loop's clock.
    """

    topic: str
    type: str
    message: Message
    duration_s: float | None = None
    rate_hz: float = 10.0
    ticket: int = 0
    until_s: float = 0.0
    n_sent: int = field(default=0, init=False)
    ended_by: str = field(default="", init=False)

    @property
    def is_moving(self) -> bool:
        """True for a velocity other than zero, which zero velocity has to follow."""
        is_velocity = bare_type(self.type) in VELOCITIES
        return is_velocity and zero_velocity_of(self.message) != self.message


class Publisher:
    """Publishes by the methods of the port alone, which may be guarded.

    Args:
        session: Knows of drives and stops.
        inquiry: Holds the connection.
    """

    def __init__(self, session: Session, inquiry: RosInquiry) -> None:
        self._session = session
        self._inquiry = inquiry
        self._known_s: dict[tuple[str, str], float] = {}
        self._moving: dict[str, PublishRun] = {}

    async def prepare(self, topic: str, type_name: str) -> None:
        """Advertise a topic, and wait until the robot has noticed or cannot answer.

        It stays advertised: the robot's brake may use the same topic. The link advertises it anew
        after a loss; the robot, which may be started anew as well, has to notice again.
        """
        connection = self._inquiry.connection
        connection.advertise(topic, type_name=type_name)
        connected_s = anyio.current_time() - (connection.connected_for_s or 0.0)
        if self._known_s.get((topic, type_name), -math.inf) < connected_s:
            await anyio.sleep(SETTLE_S)
            with suppress(LinkError), anyio.move_on_after(LONGEST_SETTLE_S):
                while not await connection.fetch_publishers(topic):  # noqa: ASYNC110 - elsewhere
                    await anyio.sleep(LOOK_S)
            self._known_s[topic, type_name] = anyio.current_time()

    async def publish(self, wanted: PublishRun) -> str:
        """Publish, and say how much was sent and how it ended.

        Raises:
            GoalError: It is a velocity, and something else moves the robot.
            LinkError: It is a velocity without an end, the robot was stopped before, or the
                connection was lost: says how much was sent.
        """
        if wanted.is_moving and wanted.duration_s is None:
            raise ENDLESS.error(topic=wanted.topic, most_s=LONGEST_S)
        with self._session.drives.preparing() as wanted.ticket:
            if not wanted.is_moving:
                said = await self._send(wanted)
                return f"{said}. {say_going_on(self._left_s(wanted.topic))}".rstrip()
            await self._check_that_nothing_moves(wanted.topic)
            with self._keeping_others_off(wanted):
                said = f"{await self._send(wanted)}."
            guard = self._session.guard
            return " ".join((said, *(() if guard is None else guard.warn_of_servers())))

    async def _send(self, wanted: PublishRun) -> str:
        await self.prepare(wanted.topic, wanted.type)
        if self._was_stopped(wanted):
            raise STOPPED_BEFORE.error()
        if wanted.is_moving:
            zero = zero_velocity_of(wanted.message)
            # Every stop from now on publishes zero velocity there too.
            self._inquiry.connection.started.note_velocity(wanted.topic, zero=zero)
        if wanted.duration_s is None:
            await self._inquiry.connection.publish(wanted.topic, wanted.message)
            return f"Published once on {wanted.topic}"
        is_cut_off, has_stood = False, True
        started_s = anyio.current_time()
        try:
            with publishing_for(wanted.duration_s):
                await self._repeat(wanted, wanted.duration_s, started_s)
        except LinkError:
            is_cut_off = True
        finally:
            passed_s = anyio.current_time() - started_s
            if wanted.is_moving:
                has_stood = await self._stand(wanted)
        said = partial(say_published, wanted.topic, wanted.n_sent, passed_s, wanted.ended_by)
        if is_cut_off or not has_stood:
            moving = CUT_OFF_STANDING if has_stood else CUT_OFF_MOVING
            raise (moving if wanted.is_moving else CUT_OFF).error(said=said())
        return said(then_stood=wanted.is_moving)

    async def _repeat(self, wanted: PublishRun, duration_s: float, started_s: float) -> None:
        """Publish until the time is over or something else ends it.

        Raises:
            LinkError: The connection was lost. The publication does not go on when it is back.
        """
        connection = self._inquiry.connection
        while wanted.n_sent / wanted.rate_hz < duration_s and not wanted.ended_by:
            if connection.lost_for_s is not None:
                raise NO_CONNECTION.error(topic=wanted.topic)
            await connection.publish(wanted.topic, wanted.message)
            wanted.n_sent += 1
            due_s = min(wanted.n_sent / wanted.rate_hz, duration_s)
            await anyio.sleep_until(started_s + due_s)
            drive = self._session.drives.under_way
            if self._was_stopped(wanted):
                wanted.ended_by = UNTIL_STOPPED
            elif wanted.is_moving and drive is not None:
                wanted.ended_by = UNTIL_DRIVE.format(goal_id=drive.goal_id)

    async def _stand(self, wanted: PublishRun) -> bool:
        """Publish zero velocity, whatever happens to the call that moved the robot.

        Where the connection is lost it is waited for a moment. Return whether a stand was sent.
        """
        zero, n_sent = zero_velocity_of(wanted.message), 0
        with anyio.CancelScope(shield=True), anyio.move_on_after(STAND_S):
            while n_sent < N_STANDS:
                if self._inquiry.connection.publish_everywhere(wanted.topic, zero):
                    n_sent += 1
                await anyio.sleep(PAUSE_S)
        return n_sent > 0

    def _was_stopped(self, wanted: PublishRun) -> bool:
        with self._session.drives.preparing() as now:
            return now != wanted.ticket

    @contextmanager
    def _keeping_others_off(self, wanted: PublishRun) -> Generator[None]:
        wanted.until_s = anyio.current_time() + (wanted.duration_s or 0.0)
        self._moving[wanted.topic] = wanted
        try:
            yield
        finally:
            del self._moving[wanted.topic]

    async def _check_that_nothing_moves(self, topic: str) -> None:
        drives = self._session.drives
        if drives.under_way is not None:
            # It may have ended since the last report.
            await drives.report(drives.under_way.goal_id)
        if (drive := drives.under_way) is not None:
            raise DRIVE_UNDER_WAY.error(goal_id=drive.goal_id, place=drive.place, topic=topic)
        # On another topic too: the base would follow one and the other by turns.
        moving = next(iter(self._moving), None)
        if moving is not None:
            raise PUBLICATION_UNDER_WAY.error(topic=moving, left_s=self._left_s(moving))

    def _left_s(self, topic: str) -> float | None:
        """Return how long another publication moves the robot on a topic; None without one."""
        other = self._moving.get(topic)
        return None if other is None else max(other.until_s - anyio.current_time(), 0.0)


async def check_frames(inquiry: RosInquiry, message: Message) -> None:
    """Return when TF has every frame that a goal is given in, or tells nothing that moves.

    Raises:
        LinkError: It has not; the goal would wait for ever, or be dropped without a word.
    """
    graph = await inquiry.fetch_topics()
    topics, wanted = graph.topics_of(TRANSFORMS), set(_frames_in(message))
    if not topics or not wanted:
        return
    heard = await hear_frames(
        inquiry.connection,
        topics,
        type_name=graph.dialect.type_name(TRANSFORMS),
        duration_s=FRAMES_COME_S,
        wanted=wanted,
    )
    known = sorted(heard.frames)
    strangers = sorted(wanted - set(known))
    if strangers and not all(link.is_static for link in heard.links.values()):
        near = find_nearest(strangers[0], known) or known[:MOST_NAMED]
        raise NO_FRAME.error(name=strangers[0][:80], n=len(known), near=", ".join(near))


def _frames_in(value: object) -> Iterator[str]:
    """Yield the frames in the headers of a message and of all within, without a leading slash."""
    if isinstance(value, list):
        for each in value:
            yield from _frames_in(each)
    if isinstance(value, Mapping):
        for name, each in value.items():
            if name == "frame_id" and isinstance(each, str) and each.strip("/"):
                yield each.strip("/")
            yield from _frames_in(each)
