"""Listening to a topic for one message or for a time, and how old a message is by its stamp."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros.activity import Subscription
from mapspeak.ros.messages.fields import Message, read_stamp
from mapspeak.ros.port import RosConnection

RENEW_S = (2.0, 3.0)
"""For a first message, in wall time, before a topic is asked for anew: a latched one may have been
missed, and a large one may come only when it is asked for otherwise."""
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


def say_rate(rate_hz: float) -> str:
    """Return a rate with three digits: 13.5 Hz is no 14 Hz."""
    return f"{rate_hz:.0f} Hz" if rate_hz >= 1000.0 else f"{f'{rate_hz:#.3g}'.rstrip('.')} Hz"


async def hear(
    connection: RosConnection,
    topic: str,
    *,
    type_name: str,
    n: int,
    wait_s: float,
    duration_s: float,
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
    subscription = connection.subscribe(topic, type_name=type_name)
    started_s = anyio.current_time()
    try:
        collector = _Collector(subscription, n)
        limit_s = duration_s or wait_s
        until = n if duration_s == 0 else None
        if duration_s == 0:
            collector.take_known()
        with anyio.move_on_after(limit_s):
            await _wait_for_first(connection, subscription, collector, renew_s)
            await collector.collect(until)
        return collector.result(started_s)
    finally:
        connection.unsubscribe(subscription)


class _Collector:
    def __init__(self, subscription: Subscription, n: int) -> None:
        self._subscription = subscription
        self._n_seen = self._n_before = subscription.n_received
        self._first: tuple[int, float] | None = None
        self.messages: deque[Message] = deque(maxlen=n)

    def take_known(self) -> None:
        """Take the message that is there already."""
        if self._subscription.latest is not None:
            self.messages.append(self._subscription.latest)

    async def collect(self, until: int | None) -> None:
        """Take messages as they come, until there are enough or it is cancelled."""
        while until is None or len(self.messages) < until:
            await self.take_next(timeout_s=60.0)

    async def take_next(self, *, timeout_s: float) -> bool:
        """Take the next message; False when none came in time."""
        try:
            message = await self._subscription.wait_for_more_than(self._n_seen, timeout_s=timeout_s)
        except LinkError:
            return False
        self._n_seen = self._subscription.n_received
        if self._first is None:
            self._first = (self._n_seen, self._subscription.arrived_s)
        self.messages.append(message)
        return True

    def result(self, started_s: float) -> Heard:
        """Return the messages since a moment of the event loop's clock."""
        now_s, known = anyio.current_time(), self._subscription
        return Heard(
            messages=tuple(self.messages),
            n_received=known.n_received - self._n_before,
            listened_s=now_s - started_s,
            age_s=now_s - known.arrived_s,
            known_for_s=now_s - known.begun_s,
            period_s=self._find_period(),
        )

    def _find_period(self) -> float | None:
        """Return the mean time between messages: by those that came, else by all ever heard."""
        known = self._subscription
        n_first, first_s = self._first or (0, known.begun_s)
        n_between, passed_s = known.n_received - n_first, known.arrived_s - first_s
        is_told = n_between >= (1 if self._first else 2) and passed_s > 0.0
        return passed_s / n_between if is_told else None


async def _wait_for_first(
    connection: RosConnection,
    subscription: Subscription,
    collector: _Collector,
    renew_s: tuple[float, ...],
) -> None:
    for patience_s in renew_s:
        if subscription.latest is not None or collector.messages:
            return
        if not await collector.take_next(timeout_s=patience_s):
            connection.renew(subscription)


LATE_PERIODS = 3.0
LEAST_LATE_S = 0.5
"""A way over a network takes some time, and so does an answer."""
OLD_S = 2.0
"""A message whose rate is not known may be so old without a word."""


def stamp_of(message: Message) -> float | None:
    """Return a message's own time in seconds of robot time; None where it has none."""
    header = message.get("header")
    holder = header if isinstance(header, Mapping) else message
    stamp = holder.get("stamp")
    if not isinstance(stamp, Mapping):
        return None
    try:
        return read_stamp(stamp)
    except LinkError:
        return None


def say_stamp(
    message: Message, *, now_s: float, age_s: float = 0.0, period_s: float | None = None
) -> str:
    """Say a message's stamp and how far it is off; empty where it has none.

    Args:
        message: Of any type.
        now_s: Robot time.
        age_s: Since the message came.
        period_s: Between two messages of its topic; None where that is not known.
    """
    stamp_s = stamp_of(message)
    if stamp_s is None:
        return ""
    if stamp_s == 0.0:
        return "stamp 0: not set"
    lag_s = now_s - stamp_s
    return f"stamp {stamp_s:.3f} s, {say_lag(lag_s)}{_judge(lag_s - age_s, period_s)}"


def say_lag(lag_s: float) -> str:
    """Say how far a stamp is from robot time."""
    where = "behind" if lag_s >= 0.0 else "ahead of"
    return f"{abs(lag_s):.2f} s {where} robot time"


def _judge(old_s: float, period_s: float | None) -> str:
    """Say that a message was too old, or too new, when it came."""
    if old_s < -LEAST_LATE_S:
        return f" - AHEAD: {-old_s:.1f} s in the future when it came"
    if period_s is None:
        return (
            f" - it was {old_s:.1f} s old when it came: kept for latecomers, or late"
            if old_s > OLD_S
            else ""
        )
    if old_s <= max(LATE_PERIODS * period_s, LEAST_LATE_S):
        return ""
    return f" - LATE: {old_s:.1f} s old when it came, though one comes every {period_s:.3g} s"
