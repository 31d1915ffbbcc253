"""Copy a whole memory into an empty one, between any kinds of stores."""

from collections.abc import Iterator
from dataclasses import dataclass

from mapspeak.errors import SemanticMapError
from mapspeak.memory.frames import OWN_WALLS
from mapspeak.memory.store.memorystore import MemoryStore
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
    for frame_id, name in places.frames.walls.items():
        grid = source.walls.load(name)
        if grid is not None:
            target.walls.keep(grid, OWN_WALLS if frame_id is None else name)
    if places.frames.items:
        target.write_frames(lambda _: places.frames)
    for event in events:
        target.write_event(event)
    return Copied(
        n_places=len(places.waypoints), n_events=len(events), n_frames=len(places.frames.items)
    )
