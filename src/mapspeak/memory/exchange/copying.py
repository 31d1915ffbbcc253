"""Copy a whole memory into an empty one, between any kinds of stores."""

from dataclasses import dataclass

from mapspeak.errors import SemanticMapError
from mapspeak.memory.frames import OWN_WALLS
from mapspeak.memory.store.memorystore import MemoryStore, Records


@dataclass(frozen=True, slots=True, kw_only=True)
class Copied:
    """Numbers of copied records."""

    n_places: int
    n_events: int
    n_frames: int


def copy_memory(source: MemoryStore, target: MemoryStore) -> Copied:
    """Copy places, events, frames and their walls, all or none.

    Pictures and observations stay where they are.

    Raises:
        SemanticMapError: The target is not empty, or one of them cannot be read or written.
    """
    places, events = source.read(), source.read_events()

    def fill(records: Records) -> None:
        _require_empty(records)
        records.bind(places.map_id)
        for frame in places.frames.items:
            records.put(frame)
        for place in places.waypoints:
            records.put(place)
        for event in events:
            records.put(event)

    target.change(_require_empty, alone=True)
    # The walls first: records without them are of no map.
    for frame_id, name in places.frames.walls.items():
        grid = source.walls.load(name)
        if grid is not None:
            target.walls.keep(grid, OWN_WALLS if frame_id is None else name)
    target.change(fill, alone=True)
    return Copied(
        n_places=len(places.waypoints), n_events=len(events), n_frames=len(places.frames.items)
    )


def _require_empty(records: Records) -> None:
    known = records.read()
    has_places = known.waypoints or known.frames.items
    if has_places or records.read_events():
        raise SemanticMapError(
            f"The target has {'places' if has_places else 'events'} already.",
            hint="Copy into a new file or database.",
        )
