"""Skills and facts that a test has in its hands."""

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from datetime import datetime

import anyio

from guarding import MONDAY_NOON
from mapspeak.skill import (
    JsonValue,
    OnProgress,
    Skill,
    SkillEffect,
    SkillOutcome,
    SkillProgress,
    SkillSpec,
)
from mapspeak.skills.guarding import is_as_wanted

Doing = Callable[[Mapping[str, JsonValue]], Awaitable[SkillOutcome]]


def spec(name: str = "lift", **more: object) -> SkillSpec:
    """Gives what is known of a skill, as far as a test says."""
    known = {"description": "", "effect": SkillEffect.MOVES, "timeout_s": 10.0}
    return SkillSpec(name=name, **(known | more))  # type: ignore[arg-type]


class FakeSkill(Skill):
    """Keeps what it was given, and ends as a test says."""

    __setattr__ = object.__setattr__

    def __init__(
        self,
        spec: SkillSpec,
        do: Doing | None = None,
        outputs: Mapping[str, JsonValue] | None = None,
    ) -> None:
        super().__init__(spec, self._run)
        self.do = do
        self.outputs = outputs or {}
        self.given: list[Mapping[str, JsonValue]] = []
        self.n_ended = 0

    async def _run(
        self, arguments: Mapping[str, JsonValue], on_progress: OnProgress
    ) -> SkillOutcome:
        self.given.append(arguments)
        on_progress(SkillProgress())
        try:
            if self.do is not None:
                return await self.do(arguments)
        finally:
            self.n_ended += 1
        return SkillOutcome(outputs=self.outputs)


async def never(_arguments: Mapping[str, JsonValue]) -> SkillOutcome:
    """Ends only when it is cancelled."""
    await anyio.sleep_forever()
    raise AssertionError


@dataclass
class FakeFacts:
    """Facts as a test sets them; time passes with every look at the clock, and in every sleep."""

    passes_s: float = 0.0
    time_s: float = 100.0
    battery: float | None = None
    stands: bool = True
    rooms: set[str] = field(default_factory=set)
    near: set[str] = field(default_factory=set)
    events: set[str] = field(default_factory=set)
    seen: set[str] = field(default_factory=set)
    calendar: datetime | None = MONDAY_NOON

    @property
    def now_s(self) -> float:
        self.time_s += self.passes_s
        return self.time_s

    async def sleep(self, duration_s: float) -> None:
        await anyio.lowlevel.checkpoint()
        self.time_s += duration_s

    def read_calendar(self) -> datetime | None:
        return self.calendar

    async def holds(self, name: str, wanted: Mapping[str, JsonValue]) -> bool | None:
        value = wanted[name]
        if name in ("battery_above", "battery_below"):
            key = name.removeprefix("battery_")
            return None if self.battery is None else is_as_wanted(self.battery, {key: value})
        if name == "standing":
            return self.stands is value
        if name == "near":
            return wanted.get("within_m", 1.0) > 0 and value in self.near
        return value in {"in_room": self.rooms, "event": self.events, "sees": self.seen}[name]


def tell_nobody(_progress: SkillProgress) -> None:
    """Takes progress that a test does not look at."""
