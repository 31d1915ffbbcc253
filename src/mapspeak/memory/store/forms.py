"""Forms of single values in a record: how each is read, with pydantic's schemas, and written."""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from datetime import MAXYEAR, MINYEAR, datetime
from enum import StrEnum
from typing import Any

from pydantic_core import CoreSchema, core_schema

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point, wrap_angle
from mapspeak.memory.events import ID_RULE, Outline, is_event_id
from mapspeak.memory.laserfan import LaserFan
from mapspeak.memory.store.yamltext import Bare, Data

_NUMBER = r"-?\d+(?:\.\d+)?"
_CORNER = re.compile(rf"\s*({_NUMBER})\s+({_NUMBER})\s*")
_FULL_TURN_DEG = 360.0

EXPECTED = {
    "missing": "is missing",
    "extra": "is not a key that belongs here",
    "dict": "is not a mapping of keys to values",
    "tuple": "is not a list",
    "string": "is not text",
    "float": "is not a number",
    "finite": "is not a finite number",
    "greater": "is below zero",
    "int": "is not a whole number",
    "bool": "is not true or false",
    "value": "{error}",
}
"""Descriptions of faults, to follow the path to each, by how pydantic's names for them begin."""


@dataclass(frozen=True, slots=True)
class Form:
    """A form of values.

    Attributes:
        schema: Parses the value in a record.
        write: Returns a value's text for a record; None for an empty value.
    """

    schema: CoreSchema
    write: Callable[[Any], Data]


def _read_words(text: str) -> str:
    if not text.strip():
        raise ValueError("is empty")
    return str(text)


def _read_id(text: str) -> str:
    # One that is empty is none, as ever.
    if text and not is_event_id(text):
        raise ValueError(f"is not {ID_RULE}")
    return str(text)


def _read_angle(degrees: float) -> float:
    if abs(degrees) > _FULL_TURN_DEG:
        raise ValueError("is not an angle from -360 to 360 degrees")
    return math.radians(degrees)


def _read_time(value: Data) -> datetime:
    try:
        time = datetime.fromisoformat(value) if isinstance(value, str) else None
    except ValueError:
        time = None
    # Of other years some zones have no time.
    if time is None or time.tzinfo is None or not MINYEAR < time.year < MAXYEAR:
        raise ValueError("is not a date and time with a time zone, before the year 9999")
    return time


def _read_laser(value: Data) -> LaserFan:
    if not isinstance(value, str):
        raise ValueError("is wrong: It is no line of text")  # noqa: TRY004 - pydantic tells it
    try:
        return LaserFan.read(value)
    except SemanticMapError as error:
        raise ValueError(f"is wrong: {error.message[:-1]}") from error


def _read_outlines(value: Data) -> tuple[Outline, ...]:
    """Read "0.0 0.0, 4.0 0.0, 4.0 2.0"; the outlines of several parts have a ; between them."""
    parts = [part.split(",") for part in value.split(";")] if isinstance(value, str) else []
    if not parts or any(len(part) < 3 for part in parts):
        raise ValueError("is not three corners or more, such as '0.0 0.0, 4.0 0.0, 4.0 2.0'")
    return tuple(tuple(map(_read_corner, part)) for part in parts)


def _read_corner(text: str) -> Point:
    found = _CORNER.fullmatch(text)
    if found is None:
        raise ValueError(f"has the corner '{text.strip()}', which is not two numbers")
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


_after = core_schema.no_info_after_validator_function
_plain = core_schema.no_info_plain_validator_function
_text, _number = core_schema.str_schema(), core_schema.float_schema(allow_inf_nan=False)
_angle = _after(_read_angle, _number)

TEXT, WORDS, ID = (Form(_after(read, _text), _same) for read in (str, _read_words, _read_id))
NEEDED_ID = Form(_after(_read_id, WORDS.schema), _same)
NUMBER = Form(_number, _say_number)
DISTANCE = Form(core_schema.float_schema(allow_inf_nan=False, ge=0), _say_number)
BEARING = Form(_angle, _say_angle)
HEADING = Form(_after(wrap_angle, _angle), _say_angle)
# A hundred metres away this still is a millimetre.
FINE_HEADING = Form(HEADING.schema, lambda yaw_rad: Bare(f"{math.degrees(yaw_rad) + 0.0:.4f}"))
COUNT = Form(core_schema.int_schema(ge=0), lambda number: Bare(number) if number else None)
FLAG = Form(core_schema.bool_schema(), lambda is_so: Bare("true") if is_so else None)
TIME = Form(
    _plain(_read_time),
    lambda time: None if time is None else Bare(time.isoformat(timespec="seconds")),
)
LASER = Form(_plain(_read_laser), lambda fan: None if fan is None else fan.text)
OUTLINES = Form(_plain(_read_outlines), _say_outlines)


def one_of(words: type[StrEnum], *, unsaid: StrEnum | None = None) -> Form:
    """Return the form of a closed vocabulary.

    Args:
        unsaid: The default word, which is not written.
    """

    def read(value: Data) -> StrEnum:
        try:
            return words(str(value))
        except ValueError:
            raise ValueError(f"is none of {', '.join(words)}") from None

    return Form(_plain(read), lambda word: None if word in (None, unsaid) else Bare(word))


def list_of(item: Form) -> Form:
    """Return the form of a list of values of a form."""
    schema = core_schema.tuple_schema([item.schema], variadic_item_index=0)
    return Form(schema, lambda values: [item.write(each) for each in values])
