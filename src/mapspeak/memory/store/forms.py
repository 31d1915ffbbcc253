"""Forms of single values in a record: each parses its text and writes it.

Faults of a record are collected, with the path of keys and item numbers to each.
"""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime
from enum import StrEnum
from typing import Any

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point, wrap_angle
from mapspeak.memory.events import ID_RULE, Outline, is_event_id
from mapspeak.memory.laserfan import LaserFan
from mapspeak.memory.store.yamltext import Bare, Data, Path

_NUMBER = r"-?\d+(?:\.\d+)?"
_CORNER = re.compile(rf"\s*({_NUMBER})\s+({_NUMBER})\s*")
_FULL_TURN_DEG = 360.0
_TRUTHS = {"true": True, "yes": True, "on": True, "false": False, "no": False, "off": False}


@dataclass(frozen=True, slots=True)
class Wrong:
    """A fault of a record.

    Attributes:
        expected: Description of the fault, to follow the path.
    """

    path: Path
    expected: str
    value: object = None


class WrongError(Exception):
    """A value in a record does not have its form."""

    def __init__(self, *wrongs: Wrong) -> None:
        super().__init__()
        self.wrongs = wrongs

    def behind(self, step: int | str) -> list[Wrong]:
        """Return the faults with one more step at the front of their paths."""
        return [replace(each, path=(step, *each.path)) for each in self.wrongs]


@dataclass(frozen=True, slots=True)
class Form:
    """A form of values.

    Attributes:
        read: Parses the value in a record; raises `WrongError`.
        write: Returns a value's text for a record; None for an empty value.
    """

    read: Callable[[Any], object]
    write: Callable[[Any], Data]


def wrong(expected: str, value: object) -> WrongError:
    """Return the error for the fault of one value."""
    return WrongError(Wrong((), expected, value))


def _read_text(value: Data) -> str:
    if not isinstance(value, str):
        raise wrong("is not text", value)
    return str(value)


def _read_words(value: Data) -> str:
    text = _read_text(value)
    if not text.strip():
        raise wrong("is empty", value)
    return text


def _read_id(value: Data) -> str:
    # One that is empty is none, as ever.
    text = _read_text(value)
    if text and not is_event_id(text):
        raise wrong(f"is not {ID_RULE}", value)
    return text


def _read_number(value: Any) -> float:  # noqa: ANN401 - GeoJSON has numbers, YAML has text
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise wrong("is not a number", value) from None
    if not math.isfinite(number):
        raise wrong("is not a finite number", value)
    return number


def _read_distance(value: Data) -> float:
    number = _read_number(value)
    if number < 0:
        raise wrong("is below zero", value)
    return number


def _read_angle(value: Data) -> float:
    degrees = _read_number(value)
    if abs(degrees) > _FULL_TURN_DEG:
        raise wrong("is not an angle from -360 to 360 degrees", value)
    return math.radians(degrees)


def _read_count(value: Data) -> int:
    number = _read_distance(value)
    if not number.is_integer():
        raise wrong("is not a whole number", value)
    return int(number)


def _read_flag(value: Data) -> bool:
    truth = _TRUTHS.get(str(value).casefold())
    if truth is None:
        raise wrong("is not true or false", value)
    return truth


def _read_time(value: Data) -> datetime:
    try:
        time = datetime.fromisoformat(value) if isinstance(value, str) else None
    except ValueError:
        time = None
    if time is None or time.tzinfo is None:
        raise wrong("is not a date and time with a time zone", value)
    return time


def _read_laser(value: Data) -> LaserFan:
    if not isinstance(value, str):
        raise wrong("is wrong: It is no line of text", value)
    try:
        return LaserFan.read(value)
    except SemanticMapError as error:
        raise wrong(f"is wrong: {error.message[:-1]}", value) from error


def _read_outlines(value: Data) -> tuple[Outline, ...]:
    """Read "0.0 0.0, 4.0 0.0, 4.0 2.0"; the outlines of several parts have a ; between them."""
    parts = [part.split(",") for part in value.split(";")] if isinstance(value, str) else []
    if not parts or any(len(part) < 3 for part in parts):
        raise wrong("is not three corners or more, such as '0.0 0.0, 4.0 0.0, 4.0 2.0'", value)
    return tuple(tuple(map(_read_corner, part)) for part in parts)


def _read_corner(text: str) -> Point:
    found = _CORNER.fullmatch(text)
    if found is None:
        raise wrong(f"has the corner '{text.strip()}', which is not two numbers", None)
    return Point(float(found[1]), float(found[2]))


def _say_number(value: float | None, n_decimals: int = 3) -> Data:
    """Return a number with one decimal less where that one is a zero: 1.20, 1.205, 90.0."""
    if value is None:
        return None
    # Adding zero turns -0.0 into 0.0.
    return Bare(f"{round(value, n_decimals) + 0.0:.{n_decimals}f}".removesuffix("0"))


def _say_angle(angle_rad: float | None) -> Data:
    if angle_rad is None:
        return None
    degrees = round(math.degrees(wrap_angle(angle_rad)), 2)
    return _say_number(180.0 if degrees == -180.0 else degrees, 2)


def _say_outlines(outlines: tuple[Outline, ...]) -> Data:
    corners = (
        ", ".join(f"{_say_number(corner.x)} {_say_number(corner.y)}" for corner in outline)
        for outline in outlines
    )
    return "; ".join(corners)


def _same(value: str | None) -> Data:
    return value


TEXT, WORDS, ID = (Form(read, _same) for read in (_read_text, _read_words, _read_id))
NEEDED_ID = Form(lambda value: _read_id(_read_words(value)), _same)
NUMBER, DISTANCE = (Form(read, _say_number) for read in (_read_number, _read_distance))
BEARING = Form(_read_angle, _say_angle)
HEADING = Form(lambda value: wrap_angle(_read_angle(value)), _say_angle)
# A hundred metres away this still is a millimetre.
FINE_HEADING = Form(HEADING.read, lambda yaw_rad: Bare(f"{math.degrees(yaw_rad) + 0.0:.4f}"))
COUNT = Form(_read_count, lambda number: Bare(number) if number else None)
FLAG = Form(_read_flag, lambda is_so: Bare("true") if is_so else None)
TIME = Form(
    _read_time, lambda time: None if time is None else Bare(time.isoformat(timespec="seconds"))
)
LASER = Form(_read_laser, lambda fan: None if fan is None else fan.text)
OUTLINES = Form(_read_outlines, _say_outlines)


def one_of(words: type[StrEnum], *, unsaid: StrEnum | None = None) -> Form:
    """Return the form of a closed vocabulary.

    Args:
        unsaid: The default word, which is not written.
    """

    def read(value: Data) -> object:
        try:
            return words(str(value))
        except ValueError:
            raise wrong(f"is none of {', '.join(words)}", value) from None

    return Form(read, lambda word: None if word in (None, unsaid) else Bare(word))


def list_of(item: Form) -> Form:
    """Return the form of a list of values of a form."""

    def read(value: Data) -> tuple[object, ...]:
        if not isinstance(value, list):
            raise wrong("is not a list", value)
        items, wrongs = list[object](), list[Wrong]()
        for number, each in enumerate(value):
            try:
                items.append(item.read(each))
            except WrongError as error:
                wrongs += error.behind(number)
        if wrongs:
            raise WrongError(*wrongs)
        return tuple(items)

    return Form(read, lambda values: [item.write(each) for each in values])
