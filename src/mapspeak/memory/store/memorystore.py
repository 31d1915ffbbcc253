"""What every memory of places promises, wherever it keeps them."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import Protocol

from mapspeak.errors import SemanticMapError
from mapspeak.memory.events import Event
from mapspeak.memory.frames import Frames
from mapspeak.memory.merging import Merge
from mapspeak.memory.quoting import name_key, quote_name
from mapspeak.memory.walls import KeptWalls
from mapspeak.memory.waypoint import SemanticMap, Waypoint


@dataclass(frozen=True, slots=True, kw_only=True)
class WriteReceipt:
    """What a write did; it is on the disk.

    Attributes:
        waypoint: As it is remembered from now on: millimetres, hundredths of a degree.
    """

    waypoint: Waypoint
    previous: Waypoint | None


class MemoryStore(Protocol):
    """Places and events that outlive the server.

    All is synchronous, and safe between threads, processes and stores that are open at once. What
    changes something is done, and lasts, when it returns, or raises a `SemanticMapError` and
    changed nothing: the memory has a fault, cannot be written, or is held
    by another program.
    """

    @property
    def path(self) -> Path:
        """The file, or what stands for it, beside which pictures and observations lie."""

    @property
    def map_id(self) -> str | None:
        """The map that the robot is on; None takes the memory for what it says it is."""

    @property
    def walls(self) -> KeptWalls:
        """The walls of its frames."""

    def read(self) -> SemanticMap:
        """Return all remembered places; cheap where nothing changed.

        Raises:
            SemanticMapError: The memory cannot be read, or has a fault and was never without one.
        """

    def read_events(self) -> tuple[Event, ...]:
        """Return all events, also those that are over; as `read` otherwise."""

    def read_entry(self, key: str) -> str | None:
        """Return what the memory says under a key of its own, such as `snapshot`; as `read`."""

    def write(self, waypoint: Waypoint) -> WriteReceipt:
        """Create a waypoint, or put it in place of the one of that name.

        Where the known one is of a frame that is aligned with the waypoint's, it stays in its own.
        Where that is not known, both stay, the new one with a number behind its name.
        """

    def write_all(self, change: Callable[[SemanticMap], Iterable[Waypoint]]) -> None:
        """Write many waypoints, all or none.

        Args:
            change: Tells which, from all that are remembered; called once or more often.
        """

    def write_event(self, event: Event) -> Event:
        """Write an event, in place of the one of its id; return it with its id."""

    def remember(
        self, waypoint: Waypoint, *, gone: Iterable[str] = ()
    ) -> tuple[WriteReceipt, Merge]:
        """Join a waypoint with what is remembered under its name; of frames, see `write`.

        What another program remembers of it in the same moment is joined, too.

        Args:
            gone: Labels of landmarks that are not there any more.
        """

    def remove(self, name: str) -> Waypoint | None:
        """Forget a waypoint; return it, or None where none has that name. `write` undoes it."""

    def write_frames(self, change: Callable[[Frames], Frames]) -> Frames:
        """Write what is known of frames, all or nothing; no record changes.

        Args:
            change: Tells how they read, from how they do; called once or more often.
        """


def in_its_frame(
    waypoint: Waypoint, *, find_known: Callable[[str], Waypoint | None], frames: Frames
) -> Waypoint:
    """Return a waypoint as a memory keeps it: in the frame and under the name of its record.

    A record of its name in a frame of which it is not known how it lies is another place: the
    waypoint gets a number behind its name.

    Args:
        find_known: Finds what is remembered under a `name_key`.
    """
    for number in count(1):
        name = waypoint.name if number == 1 else f"{waypoint.name} ({number})"
        known = find_known(name_key(name))
        if known is None:
            return replace(waypoint, name=name)
        motion = frames.find_transform(of=waypoint.frame, into=known.frame)
        if motion is not None:
            is_moved = known.frame != waypoint.frame
            placed = waypoint.moved(motion) if is_moved else waypoint
            return replace(placed, name=name, frame=known.frame, room_id=waypoint.room_id)
    raise AssertionError  # Numbers do not end.


def event_in_its_frame(event: Event, known: Event | None, frames: Frames) -> Event:
    """Return an event as a memory keeps it: in the frame of what is known under its id.

    Raises:
        SemanticMapError: It is not known how the event's frame lies to that.
    """
    if known is None or known.frame == event.frame:
        return event
    motion = frames.find_transform(of=event.frame, into=known.frame)
    if motion is None:
        raise SemanticMapError(
            f"The event {event.id} is of another map.", hint="Note another one for this map."
        )
    return replace(event.moved(motion), frame=known.frame)


def free_event_id(known_ids: Iterable[str]) -> str:
    """Return an id that no event has had: E1, E2, ..."""
    numbers = [int(each[1:]) for each in known_ids if each[:1] == "E" and each[1:].isdigit()]
    return f"E{max(numbers, default=0) + 1}"


def require_same_map(waypoint: Waypoint, map_id: str | None) -> None:
    """Refuse a waypoint that is of another map than the robot.

    Raises:
        SemanticMapError: It is.
    """
    if None not in (waypoint.map_id, map_id) and waypoint.map_id != map_id:
        raise SemanticMapError(
            f"The waypoint {quote_name(waypoint.name)} belongs to the map "
            f"{quote_name(waypoint.map_id or '')}, but the robot is on {quote_name(map_id or '')}.",
            hint="Write it where the robot is on that map.",
        )
