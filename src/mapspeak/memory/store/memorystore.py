"""The interface of every memory of places, and the behaviour that all share."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import Protocol, TypeVar

from mapspeak.errors import SemanticMapError
from mapspeak.memory.events import Event
from mapspeak.memory.frames import Frames, MapFrame
from mapspeak.memory.merging import Merge, merge_waypoint
from mapspeak.memory.quoting import clean_line, name_key, quote_name
from mapspeak.memory.store.reading import KeptContents
from mapspeak.memory.walls import KeptWalls
from mapspeak.memory.waypoint import SemanticMap, Waypoint

OneRecord = TypeVar("OneRecord", Waypoint, Event, MapFrame)
Result = TypeVar("Result")


@dataclass(frozen=True, slots=True, kw_only=True)
class WriteReceipt:
    """Result of a write, which is on the disk.

    Attributes:
        waypoint: As remembered, rounded to millimetres and hundredths of a degree.
        previous: The one of its name before; None where there was none or it was forgotten.
    """

    waypoint: Waypoint
    previous: Waypoint | None


class Records(Protocol):
    """The records of a memory during an atomic change."""

    @property
    def frames(self) -> Frames:
        """All of them."""

    def read(self) -> SemanticMap:
        """Return all places."""

    def read_events(self) -> Mapping[str, Event]:
        """Return all events by their ids."""

    def find_place(self, key: str) -> Waypoint | None:
        """Return the place under a `name_key`, locked against other writers."""

    def bind(self, map_id: str | None) -> None:
        """Bind the memory to the map of its waypoints, unless it already names one."""

    def put(self, record: OneRecord) -> OneRecord:
        """Write a record in place of the one with its key; return it as read back."""

    def rename_place(self, former_key: str, waypoint: Waypoint) -> None:
        """Write a place where the one of another `name_key` was, which is removed."""


class MemoryStore(ABC):
    """Places and events that outlive the server.

    All is synchronous, and safe between threads, processes and stores that are open at once. What
    changes something is done, and lasts, when it returns, or raises a `SemanticMapError` and
    changed nothing: the memory has a fault, cannot be written, or is held by another program.

    Args:
        path: The file, or what stands for it on this machine, beside which pictures and
            observations lie.
        walls: The walls of its frames.
        map_id: The map that the robot is on. None takes the memory for what it says it is.

    Attributes:
        kept: Keeps parsed records for a later session; None keeps nothing.
    """

    def __init__(self, *, path: Path, walls: KeptWalls, map_id: str | None) -> None:
        self.path = path
        self.walls = walls
        self.map_id = clean_line(map_id or "") or None
        self.kept: KeptContents | None = None

    @abstractmethod
    def read(self) -> SemanticMap:
        """Return all remembered places; cheap where nothing changed.

        A memory that cannot be read since gives the places read before, with a warning.

        Raises:
            SemanticMapError: It cannot be read, or has a fault and was never without one.
        """

    @abstractmethod
    def read_events(self) -> tuple[Event, ...]:
        """Return all events, also those that are over; as `read` otherwise."""

    @abstractmethod
    def change(
        self,
        change: Callable[[Records], Result],
        *,
        alone: bool = False,
        binding: str | None = None,
    ) -> Result:
        """Change records atomically, and return the result of the change.

        Args:
            change: Called once or more often.
            alone: No other writes meanwhile. Else none writes the places that are looked for.
            binding: The map that the memory may get bound to.
        """

    def write(self, waypoint: Waypoint) -> WriteReceipt:
        """Create a waypoint, or replace the one of that name.

        If the frame of the known one is aligned with the waypoint's, the record keeps its frame.
        If the alignment is unknown, both stay, the new one with a number behind its name.
        """
        return self.join(waypoint, lambda _, placed: placed)

    def write_all(self, change: Callable[[SemanticMap], Iterable[Waypoint]]) -> None:
        """Write many waypoints, all or none; each into the memory of its map.

        Args:
            change: Returns them, given all remembered places; called once or more often.
        """

        def write(records: Records) -> None:
            waypoints = tuple(change(records.read()))
            for waypoint in waypoints:
                records.bind(waypoint.map_id)
                records.put(waypoint)

        self.change(write, alone=True)

    def write_event(self, event: Event) -> Event:
        """Write an event, in place of the one of its id; return it with its id."""

        def write(records: Records) -> Event:
            events = records.read_events()
            placed = _event_in_its_frame(event, events.get(event.id), records.frames)
            records.bind(None if event.frame else self.map_id)
            return records.put(placed if placed.id else replace(placed, id=_free_id(events)))

        return self.change(write, alone=True)

    def remember(
        self, waypoint: Waypoint, *, gone: Iterable[str] = ()
    ) -> tuple[WriteReceipt, Merge]:
        """Join a waypoint with what is remembered under its name; of frames, see `write`.

        Changes by another program at the same moment are joined, too.

        Args:
            gone: Labels of landmarks that are not there any more.
        """
        labels = tuple(gone)
        merges: list[Merge] = []

        def join(before: Waypoint | None, placed: Waypoint) -> Waypoint:
            merges.append(merge_waypoint(before, placed, gone=labels))
            return merges[-1].waypoint

        return self.join(waypoint, join), merges[-1]

    def write_frames(self, change: Callable[[Frames], Frames]) -> Frames:
        """Write the frames, all or none; no record changes.

        Args:
            change: Returns the new frames, given the present ones; called once or more often.
        """

        def write(records: Records) -> Frames:
            known = records.frames.by_id
            for frame in change(records.frames).items:
                if known.get(frame.id) != frame:
                    records.put(frame)
            return records.frames

        return self.change(write, alone=True)

    def join(
        self, waypoint: Waypoint, join: Callable[[Waypoint | None, Waypoint], Waypoint]
    ) -> WriteReceipt:
        """Write what becomes of a waypoint beside the remembered one of its name.

        Args:
            join: Returns it, given the remembered one and the waypoint as a memory keeps it;
                called once or more often.
        """
        _require_same_map(waypoint, self.map_id)
        map_id = None if waypoint.frame else self.map_id or waypoint.map_id

        def write(records: Records) -> WriteReceipt:
            records.bind(map_id)
            placed = _in_its_frame(waypoint, records)
            previous = records.find_place(name_key(placed.name))
            written = records.put(join(previous, placed))
            is_new = previous is None or previous.is_gone
            return WriteReceipt(waypoint=written, previous=None if is_new else previous)

        return self.change(write, binding=map_id)


def _in_its_frame(waypoint: Waypoint, records: Records) -> Waypoint:
    """Return a waypoint as a memory keeps it: in the frame and under the name of its record.

    A record of its name in a frame of unknown alignment is another place: the waypoint gets a
    number behind its name.
    """
    for number in count(1):
        name = waypoint.name if number == 1 else f"{waypoint.name} ({number})"
        known = records.find_place(name_key(name))
        if known is None:
            return replace(waypoint, name=name)
        placed = records.frames.bring(waypoint, known.frame)
        if placed is not None:
            return replace(placed, name=name)
    raise AssertionError  # There is always a free number.


def _event_in_its_frame(event: Event, known: Event | None, frames: Frames) -> Event:
    """Return an event as a memory keeps it: in the frame of the record with its id."""
    placed = event if known is None else frames.bring(event, known.frame)
    if placed is None:
        raise SemanticMapError(
            f"The event {event.id} is of another map.", hint="Note another one for this map."
        )
    return placed


def _free_id(known_ids: Iterable[str]) -> str:
    """Return an id that no event has had: E1, E2, ..."""
    numbers = [int(each[1:]) for each in known_ids if each[:1] == "E" and each[1:].isdigit()]
    return f"E{max(numbers, default=0) + 1}"


def _require_same_map(waypoint: Waypoint, map_id: str | None) -> None:
    """Refuse a waypoint that is of another map than the robot."""
    if None not in (waypoint.map_id, map_id) and waypoint.map_id != map_id:
        raise SemanticMapError(
            f"The waypoint {quote_name(waypoint.name)} belongs to the map "
            f"{quote_name(waypoint.map_id or '')}, but the robot is on {quote_name(map_id or '')}.",
            hint="Write it where the robot is on that map.",
        )
