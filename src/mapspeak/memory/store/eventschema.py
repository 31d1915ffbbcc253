"""What one event of the semantic map file must say; turned into an `Event`, and back."""

import re
from typing import Annotated

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    FiniteFloat,
    ValidationError,
)

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point
from mapspeak.memory.events import ID_RULE, Effect, Event, Every, Outline, is_event_id
from mapspeak.memory.quoting import quote_name
from mapspeak.memory.store.schema import Time, length_text, time_text
from mapspeak.memory.store.tree import Data, ListNode, MappingNode, Node, TextError

EventNode = tuple[Event, Node]
"""An event and where it stands in the text."""

_NUMBER = r"-?\d+(?:\.\d+)?"
_CORNER = re.compile(rf"\s*({_NUMBER})\s+({_NUMBER})\s*")
_EXAMPLE = "- {text: the floor is wet, place: C1, effect: closed, until: 2026-11-22T14:00:00+01:00}"


def _outlines_of(value: object) -> tuple[Outline, ...]:
    """Read "0.0 0.0, 4.0 0.0, 4.0 2.0"; the outlines of several parts have a ; between them."""
    parts = value.split(";") if isinstance(value, str) else []
    outlines = tuple(tuple(map(_corner_of, part.split(","))) for part in parts)
    if value is not None and (not outlines or any(len(outline) < 3 for outline in outlines)):
        message = "is not three corners or more, such as '0.0 0.0, 4.0 0.0, 4.0 2.0'"
        raise ValueError(message)
    return outlines


def _corner_of(text: str) -> Point:
    found = _CORNER.fullmatch(text)
    if found is None:
        message = f"has the corner '{text.strip()}', which is not two numbers"
        raise ValueError(message)
    return Point(float(found[1]), float(found[2]))


def _event_id(value: str | None) -> str | None:
    # One that is empty is none, as ever.
    if value and not is_event_id(value):
        message = f"is not {ID_RULE}"
        raise ValueError(message)
    return value


class _PointEntry(BaseModel):
    model_config = ConfigDict(extra="forbid")

    x: FiniteFloat
    y: FiniteFloat


class _EventEntry(BaseModel):
    """One item of the list `events`, strictly: with an overlooked `untill` it would never end."""

    model_config = ConfigDict(extra="forbid")

    id: Annotated[str | None, AfterValidator(_event_id)] = None
    text: Annotated[str, Field(pattern=r"\S")]
    place: str | None = None
    effect: Effect = Effect.NONE
    at: _PointEntry | None = None
    outline: Annotated[tuple[Outline, ...], BeforeValidator(_outlines_of)] = ()
    begins: Annotated[Time, Field(alias="from")] = None
    until: Time = None
    every: Every = Every.ONCE
    source: str | None = None
    recorded_at: Time = None
    frame: str | None = None

    def to_event(self, number: int) -> Event:
        return Event(
            id=self.id or f"E{number}",
            text=self.text,
            place=self.place or "",
            effect=self.effect,
            at=None if self.at is None else Point(self.at.x, self.at.y),
            outlines=self.outline,
            begins=self.begins,
            until=self.until,
            every=self.every,
            source=self.source or "",
            recorded_at=self.recorded_at,
            frame=self.frame,
        )


def read_events(root: MappingNode | None) -> tuple[EventNode, ...]:
    """Return the events of a file's top mapping; those that people wrote get ids by their order.

    Raises:
        TextError: One of them does not say what it must, or two have the same id.
    """
    node = root.find_value("events") if root else None
    if node is None or not node.data:
        return ()
    if not isinstance(node, ListNode):
        message = "The key 'events' is not a list."
        raise TextError(message, hint=f"Write each event like `{_EXAMPLE}`.", offset=node.start)
    events: dict[str, EventNode] = {}
    for number, item in enumerate(node.items, start=1):
        try:
            event = _EventEntry.model_validate(item.data).to_event(number)
        except ValidationError as error:
            raise _fault_in(item, error) from error
        except SemanticMapError as error:
            raise TextError(error.message, hint=error.hint, offset=item.start) from error
        if event.id in events:
            raise TextError(
                f"Two events have the id '{event.id}'.",
                hint="Give one of them another id, or none.",
                offset=item.start,
                other_offset=events[event.id][1].start,
            )
        events[event.id] = (event, item)
    return tuple(events.values())


def event_from(data: Data) -> Event:
    """Return the event that a record with an id describes.

    Raises:
        ValidationError: The record does not say what it must.
    """
    return _EventEntry.model_validate(data).to_event(0)


def event_data(event: Event) -> dict[str, Data]:
    """Return what a record says of an event: millimetres and seconds."""
    entries: dict[str, Data] = {
        "id": event.id,
        "text": event.text,
        "place": event.place,
        "effect": event.effect.value,
        "at": None
        if event.at is None
        else {"x": length_text(event.at.x), "y": length_text(event.at.y)},
        "outline": "; ".join(map(_outline_text, event.outlines)),
        "from": time_text(event.begins),
        "until": time_text(event.until),
        "every": "" if event.every is Every.ONCE else event.every.value,
        "source": event.source,
        "recorded_at": time_text(event.recorded_at),
        "frame": event.frame,
    }
    return {key: value for key, value in entries.items() if value}


def _fault_in(item: Node, error: ValidationError) -> TextError:
    first = error.errors()[0]
    key = str(first["loc"][0]) if first["loc"] else ""
    value = item.find_value(key) if isinstance(item, MappingNode) else None
    is_extra = first["type"] == "extra_forbidden"
    said = "no such key" if is_extra else first["msg"].removeprefix("Value error, ")
    what = f"The event's {quote_name(key)}: {said}." if key else "This is not an event."
    place = value or item
    return TextError(what, hint=f"Write it like `{_EXAMPLE}`.", offset=place.start)


def _outline_text(outline: Outline) -> str:
    return ", ".join(f"{length_text(corner.x)} {length_text(corner.y)}" for corner in outline)
