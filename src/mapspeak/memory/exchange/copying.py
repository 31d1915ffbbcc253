"""Copy a whole memory into an empty one, between any kinds of stores."""

from collections.abc import Iterator
from dataclasses import dataclass

from mapspeak.errors import SemanticMapError
from mapspeak.memory.alignment.keeping import KEY
from mapspeak.memory.store.memorystore import MemoryStore
from mapspeak.memory.walls import OWN_WALLS
from mapspeak.memory.waypoint import SemanticMap, Waypoint


@dataclass(frozen=True, slots=True, kw_only=True)
class Copied:
    """Numbers of copied records."""

    n_places: int
    n_events: int
    n_frames: int


def copy_memory(source: MemoryStore, target: MemoryStore) -> Copied:
    """Copy places, events, frames and their walls; pictures and observations stay where they are.

    Raises:
        SemanticMapError: The target is not empty, or one of them cannot be read or written.
    """
    places, events = source.read(), source.read_events()

    def fill(known: SemanticMap) -> Iterator[Waypoint]:
        if known.waypoints or known.frames.items:
            raise SemanticMapError(
                "The target has places already.", hint="Copy into a new file or database."
            )
        return iter(places.waypoints)

    if target.read_events():
        raise SemanticMapError(
            "The target has events already.", hint="Copy into a new file or database."
        )
    target.write_all(fill)
    _copy_walls(source, target, places)
    if places.frames.items:
        target.write_frames(lambda _: places.frames)
    for event in events:
        target.write_event(event)
    return Copied(
        n_places=len(places.waypoints), n_events=len(events), n_frames=len(places.frames.items)
    )


def _copy_walls(source: MemoryStore, target: MemoryStore, places: SemanticMap) -> None:
    own = source.read_entry(KEY) or OWN_WALLS
    named = ((frame.walls, frame.walls) for frame in places.frames.items)
    for name, copy in ((own, OWN_WALLS), *named):
        grid = None if name is None else source.walls.load(name)
        if grid is not None and copy is not None:
            target.walls.keep(grid, copy)
