"""Listening to topics: for one message, for a time, or for the frames of TF."""

from collections import deque
from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros.activity import Subscription
from mapspeak.ros.messages.fields import Message
from mapspeak.ros.messages.poses import read_transforms
from mapspeak.ros.port import RosConnection
from mapspeak.ros.transforms import TransformTree

RENEW_S = (2.0, 3.0)
"""For a first message, in wall time, before a topic is asked for anew: a latched one may have been
missed, and a large one may come only when it is asked for otherwise."""
LONG_S = 60.0
SILENT_PERIODS = 3.0
LEAST_SILENCE_S = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Heard:
    """The messages of a topic; all times in wall time.

    Attributes:
        messages: The latest, in their order.
        n_received: All that came while we listened; 0 when the latest had come before.
        listened_s: How long we listened.
        age_s: Since the latest came; infinite where none came.
        known_for_s: Since the first of our subscriptions to the topic.
        period_s: Between two messages; None where fewer than two came.
    """

    messages: tuple[Message, ...]
    n_received: int
    listened_s: float
    age_s: float
    known_for_s: float
    period_s: float | None

    @property
    def rate_hz(self) -> float:
        """Messages a second, by the times between them; without these, by their number."""
        if self.period_s is None:
            return self.n_received / self.listened_s
        return 1.0 / self.period_s

    @property
    def has_stopped(self) -> bool:
        """True when the latest is longer ago than the times between them explain."""
        if self.period_s is None:
            return False
        return self.age_s > max(SILENT_PERIODS * self.period_s, LEAST_SILENCE_S)


async def hear(
    connection: RosConnection,
    topic: str,
    *,
    type_name: str,
    n: int = 1,
    wait_s: float,
    duration_s: float = 0.0,
    renew_s: tuple[float, ...] = RENEW_S,
) -> Heard:
    """Return the latest messages of a topic, all times in wall time.

    Args:
        connection: To listen with.
        topic: Its full name.
        type_name: As this ROS writes it.
        n: How many messages are wanted at most.
        wait_s: Without a duration: how long to wait for them.
        duration_s: How long to listen; 0 ends with the last wanted message. With a subscription
            already open, a topic's latest message counts.
        renew_s: Waits for a first message, after each of which the topic is asked for anew.
    """
    known = connection.subscribe(topic, type_name=type_name)
    started_s, n_before = anyio.current_time(), known.n_received
    latest = [known.latest] if known.latest is not None and not duration_s else []
    messages: deque[Message] = deque(latest, maxlen=n)
    n_seen, first, waits_s = n_before, (0, known.begun_s), iter(renew_s)
    try:
        with anyio.move_on_after(duration_s or wait_s):
            while duration_s or len(messages) < n:
                timeout_s = LONG_S if known.latest is not None else next(waits_s, LONG_S)
                try:
                    message = await known.wait_for_more_than(n_seen, timeout_s=timeout_s)
                except LinkError:
                    connection.renew(known)
                    continue
                n_seen = known.n_received
                first = first if first[0] else (n_seen, known.arrived_s)
                messages.append(message)
    finally:
        connection.unsubscribe(known)
    now_s = anyio.current_time()
    return Heard(
        messages=tuple(messages),
        n_received=known.n_received - n_before,
        listened_s=now_s - started_s,
        age_s=now_s - known.arrived_s,
        known_for_s=now_s - known.begun_s,
        period_s=_find_period(known, *first),
    )


def _find_period(known: Subscription, n_first: int, first_s: float) -> float | None:
    """Return the mean time between messages: by those that came, else by all ever heard."""
    n_between, passed_s = known.n_received - n_first, known.arrived_s - first_s
    is_told = n_between >= (1 if n_first else 2) and passed_s > 0.0
    return passed_s / n_between if is_told else None


@dataclass(slots=True, kw_only=True)
class FrameLink:
    """A transform between two frames, as often as it came.

    Attributes:
        parent: The frame in which the child lies.
        child: A frame.
        is_static: It came as one that never changes.
        stamp_s: The latest time that was written on it, robot time.
        n: How often it came.
        first_s: When it came first, by the event loop's clock.
        last_s: When it came last.
    """

    parent: str
    child: str
    is_static: bool
    stamp_s: float
    first_s: float
    last_s: float
    n: int = 1

    @property
    def period_s(self) -> float | None:
        """Between two of them; None where one came only."""
        return (self.last_s - self.first_s) / (self.n - 1) if self.n > 1 else None


class HeardFrames:
    """The transforms that came in a time: how often, and where they put the frames."""

    def __init__(self) -> None:
        self.links: dict[tuple[str, str, bool], FrameLink] = {}
        self.tree = TransformTree()

    @property
    def frames(self) -> set[str]:
        """The frames that have been heard of."""
        return {frame for parent, child, _ in self.links for frame in (parent, child)}

    def take(self, message: Message, *, is_static: bool, now_s: float) -> None:
        """Count the transforms of a message that came at a time of the event loop's clock."""
        try:
            transforms = read_transforms(message)
        except LinkError:
            return  # Whoever reads the topic is told the fault.
        self.tree.take(transforms, is_static=is_static)
        for each in transforms:
            key = (each.parent, each.child, is_static)
            if link := self.links.get(key):
                link.n += 1
                link.last_s, link.stamp_s = now_s, max(link.stamp_s, each.stamp_s)
            else:
                self.links[key] = FrameLink(
                    parent=each.parent,
                    child=each.child,
                    is_static=is_static,
                    stamp_s=each.stamp_s,
                    first_s=now_s,
                    last_s=now_s,
                )


async def hear_frames(
    connection: RosConnection,
    topics: Sequence[str],
    *,
    type_name: str,
    duration_s: float,
    wanted: AbstractSet[str] = frozenset(),
) -> HeardFrames:
    """Return the transforms that come in a time, latched ones included.

    Args:
        connection: To listen with.
        topics: Those whose name ends in "_static" hold transforms that never change.
        type_name: Of all these topics, as this ROS writes it.
        duration_s: In wall time.
        wanted: Once all these frames have come, it ends; empty to listen for the whole time.
    """
    heard = HeardFrames()

    async def listen(topic: str) -> None:
        is_static = topic.endswith("_static")
        subscription = connection.subscribe(topic, type_name=type_name)
        n_seen = subscription.n_received
        try:
            if is_static and n_seen:
                # Several nodes keep one each, and only the latest of them is at hand.
                connection.renew(subscription)
            while True:
                message = await subscription.wait_for_more_than(n_seen, timeout_s=LONG_S)
                n_seen = subscription.n_received
                heard.take(message, is_static=is_static, now_s=subscription.arrived_s)
                if wanted and wanted <= heard.frames:
                    tasks.cancel_scope.cancel()
        finally:
            connection.unsubscribe(subscription)

    with anyio.move_on_after(duration_s):
        async with anyio.create_task_group() as tasks:
            for topic in topics:
                tasks.start_soon(listen, topic)
    return heard
