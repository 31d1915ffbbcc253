"""The facts that conditions of skills and missions check, and a stopwatch in robot time."""

from collections.abc import Iterable
from datetime import datetime
from typing import Protocol

import anyio

from mapspeak.skill import Precondition, PreconditionKind

LOOK_S = 0.05
"""Wall time between two looks at the robot's clock."""
STILL_S = 1.0
"""Wall time after which a clock that shows the same stands still."""


class Facts(Protocol):
    """The present facts, as far as the robot and its memory know."""

    @property
    def now_s(self) -> float:
        """Robot time."""

    async def sleep(self, duration_s: float) -> None:
        """Return when that much robot time has passed."""

    def read_calendar(self) -> datetime | None:
        """Return the operator's time; None where that is not known."""

    async def fetch_battery(self) -> float | None:
        """Return how full the battery is, from 0 to 1; None where nothing tells it."""

    async def is_standing(self) -> bool:
        """Return True while no drive is under way."""

    async def is_in(self, room: str) -> bool:
        """Return True where the robot is in a room, by its id or its name."""

    async def is_near(self, place: str, within_m: float) -> bool:
        """Return True where the robot is so near to a place, in a straight line."""

    async def has_event(self, words: str) -> bool:
        """Return True while an event lasts in whose words these stand."""

    async def sees(self, label: str) -> bool:
        """Return True where the robot's detector reports such a thing now."""


async def find_unmet(preconditions: Iterable[Precondition], facts: Facts) -> Precondition | None:
    """Return the first precondition that does not hold; one that is unknown does not."""
    for each in preconditions:
        match each.kind:
            case PreconditionKind.BATTERY_ABOVE:
                battery = await facts.fetch_battery()
                is_met = battery is not None and battery > (each.ratio or 0.0)
            case PreconditionKind.STANDING:
                is_met = await facts.is_standing()
            case PreconditionKind.IN_ROOM:
                is_met = await facts.is_in(each.room)
        if not is_met:
            return each
    return None


class Stopwatch:
    """Counts robot time and, while the robot's clock stands still, wall time."""

    def __init__(self, facts: Facts) -> None:
        self._facts = facts
        self._begun_s = self._seen_s = facts.now_s
        self._moved_s = anyio.current_time()
        self._still_s = 0.0

    def read_s(self) -> float:
        """Return how much time has passed."""
        now_s, wall_s = self._facts.now_s, anyio.current_time()
        if now_s != self._seen_s:
            self._seen_s, self._moved_s = now_s, wall_s
        elif wall_s - self._moved_s > STILL_S:
            self._still_s += wall_s - self._moved_s
            self._moved_s = wall_s
        return now_s - self._begun_s + self._still_s

    async def wait(self, duration_s: float) -> None:
        """Return when this time has passed since the beginning; do not advance robot time."""
        # No event tells of time that passes at the robot.
        while self.read_s() < duration_s:  # noqa: ASYNC110
            await anyio.sleep(LOOK_S)
