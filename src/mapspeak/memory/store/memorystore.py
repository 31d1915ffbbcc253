"""What every memory of places promises, wherever it keeps them."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from mapspeak.memory.events import Event
from mapspeak.memory.frames import Frames
from mapspeak.memory.merging import Merge
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
