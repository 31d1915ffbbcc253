"""Checking, waiting for, and waiting: the skills of missions that only look at facts."""

from collections.abc import Mapping
from datetime import datetime

from mapspeak.errors import SkillError
from mapspeak.skill import (
    JsonValue,
    OnProgress,
    ParameterKind,
    SkillCode,
    SkillEffect,
    SkillOutcome,
    SkillParameter,
    SkillSpec,
    SkillState,
)
from mapspeak.skills.comparing import Comparison
from mapspeak.skills.facts import Facts

CHECK_EVERY_S = 1.0
MOST_WAIT_S = 86_400.0


def _ratio(name: str) -> SkillParameter:
    return SkillParameter(name=name, kind=ParameterKind.NUMBER, unit="0 to 1", least=0, most=1)


def _text(name: str, said: str, *, most: int = 200) -> SkillParameter:
    return SkillParameter(name=name, kind=ParameterKind.TEXT, description=said, most=most)


def _number(name: str, said: str, default: float | None = None) -> SkillParameter:
    return SkillParameter(name=name, kind=ParameterKind.NUMBER, description=said, default=default)


CONDITIONS = (
    _ratio("battery_above"),
    _ratio("battery_below"),
    _text("in_room", "an id or a name"),
    _text("near", "a place"),
    _number("within_m", "of near", 1.0),
    _text("event", "words of an event that lasts now"),
    _text("sees", "a thing that the robot's detector reports now"),
    _text("time_from", "such as 22:00", most=5),
    _text("time_until", "such as 06:00", most=5),
    _text("value", "a result, such as {door.answer}", most=1000),
    _text("is", "what the value is", most=1000),
    _number("above", "of the value"),
    _number("below", "of the value"),
    SkillParameter(name="not", kind=ParameterKind.FLAG, description="none of it", default=False),
)
CHECK = SkillSpec(
    name="check",
    description="Succeeds where all that is given holds now",
    effect=SkillEffect.READS,
    timeout_s=60.0,
    parameters=CONDITIONS,
)
WAIT_FOR = SkillSpec(
    name="wait_for",
    description="Waits until all that is given holds",
    effect=SkillEffect.READS,
    timeout_s=MOST_WAIT_S,
    parameters=(
        *CONDITIONS,
        SkillParameter(
            name="within_s",
            kind=ParameterKind.NUMBER,
            unit="s",
            least=1,
            most=MOST_WAIT_S,
            default=600.0,
        ),
    ),
)
WAIT = SkillSpec(
    name="wait",
    description="Waits",
    effect=SkillEffect.READS,
    timeout_s=MOST_WAIT_S + 60,
    parameters=(
        SkillParameter(
            name="duration_s",
            kind=ParameterKind.NUMBER,
            unit="s",
            least=0,
            most=MOST_WAIT_S,
            is_required=True,
        ),
    ),
)


async def holds(wanted: Mapping[str, JsonValue], facts: Facts) -> bool:
    """Return True where a condition holds now.

    Args:
        wanted: By the names of `CONDITIONS`.

    Raises:
        SkillError: Nothing is wanted, or a time of day is none.
    """
    named = [name for name in wanted if name not in ("not", "within_m", "within_s")]
    if not named:
        raise SkillError(
            "A condition needs something that is to hold.",
            hint=f"Give one of: {', '.join(each.name for each in CONDITIONS)}.",
        )
    for name in named:
        if not await _holds(name, wanted, facts):
            return bool(wanted.get("not", False))
    return not wanted.get("not", False)


async def _holds(name: str, wanted: Mapping[str, JsonValue], facts: Facts) -> bool:
    value = wanted[name]
    if name in ("battery_above", "battery_below"):
        battery = await facts.fetch_battery()
        is_above = name == "battery_above"
        return battery is not None and (battery > value if is_above else battery < value)
    if name in ("time_from", "time_until"):
        return _is_time(wanted, facts.read_calendar())
    if name == "near":
        return await facts.is_near(value, wanted.get("within_m", 1.0))
    asked = {"in_room": facts.is_in, "event": facts.has_event, "sees": facts.sees}
    return await asked[name](value) if name in asked else _compare(wanted)


def _compare(wanted: Mapping[str, JsonValue]) -> bool:
    if "value" not in wanted:
        raise SkillError("is, above and below need a value.", hint="Write value: '{name}'.")
    value = wanted["value"]
    if ("above" in wanted or "below" in wanted) and isinstance(value, str):
        try:
            value = float(value)
        except ValueError:
            return False
    wants = Comparison("", wanted.get("is"), wanted.get("above"), wanted.get("below"))
    return wants.holds_of(value)


def _is_time(wanted: Mapping[str, JsonValue], now: datetime | None) -> bool:
    if now is None:
        return False
    begins, ends = (_minutes(wanted.get(key)) for key in ("time_from", "time_until"))
    minute = now.hour * 60 + now.minute
    begins, ends = begins or 0, 24 * 60 if ends is None else ends
    return begins <= minute < ends if begins < ends else minute >= begins or minute < ends


def _minutes(said: JsonValue) -> int | None:
    if said is None:
        return None
    try:
        at = datetime.strptime(said, "%H:%M")  # noqa: DTZ007 - a time of day has no zone
    except ValueError as error:
        raise SkillError(f"{said!r} is no time of day.", hint="Write it as 22:00.") from error
    return at.hour * 60 + at.minute


class CheckSkill:
    """Looks once."""

    spec = CHECK

    def __init__(self, facts: Facts) -> None:
        self._facts = facts

    async def run(
        self, arguments: Mapping[str, JsonValue], on_progress: OnProgress
    ) -> SkillOutcome:
        """Succeed where it holds."""
        del on_progress
        return _outcome(is_met=await holds(arguments, self._facts))


class WaitForSkill:
    """Looks again and again."""

    spec = WAIT_FOR

    def __init__(self, facts: Facts) -> None:
        self._facts = facts

    async def run(
        self, arguments: Mapping[str, JsonValue], on_progress: OnProgress
    ) -> SkillOutcome:
        """Succeed as soon as it holds; fail when it has not in time."""
        del on_progress
        until_s = self._facts.now_s + arguments["within_s"]
        while not (is_met := await holds(arguments, self._facts)) and self._facts.now_s < until_s:
            await self._facts.sleep(CHECK_EVERY_S)
        return _outcome(is_met=is_met)


class WaitSkill:
    """Lets time pass."""

    spec = WAIT

    def __init__(self, facts: Facts) -> None:
        self._facts = facts

    async def run(
        self, arguments: Mapping[str, JsonValue], on_progress: OnProgress
    ) -> SkillOutcome:
        """Wait by the robot's clock."""
        del on_progress
        await self._facts.sleep(arguments["duration_s"])
        return SkillOutcome(state=SkillState.SUCCEEDED)


def _outcome(*, is_met: bool) -> SkillOutcome:
    if is_met:
        return SkillOutcome(state=SkillState.SUCCEEDED)
    return SkillOutcome(state=SkillState.FAILED, code=SkillCode.NOT_ACHIEVED)
