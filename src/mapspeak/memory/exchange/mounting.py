"""The frames of a second memory among those of a first one, aligned by their kept walls."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from mapspeak.geometry import Pose
from mapspeak.memory.alignment.comparing import MapRelation, compare_maps
from mapspeak.memory.events import Event
from mapspeak.memory.frames import FrameId, Frames, MapFrame
from mapspeak.memory.store.memorystore import MemoryStore
from mapspeak.memory.waypoint import SemanticMap
from mapspeak.spatial import OccupancyGrid

STILL = Pose(0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Mount:
    """Names of a second memory's frames in the united memory.

    Attributes:
        frames: Of the united memory.
        ids: New id of each frame that the second memory names; its own frame is None.
        walls: The maps to keep beside the united memory, by name.
        finding: Relation of the two memories' own frames, in words.
    """

    frames: Frames
    ids: Mapping[FrameId, FrameId]
    walls: Mapping[str, OccupancyGrid]
    finding: str

    def rename_places(self, places: SemanticMap) -> SemanticMap:
        """Return the second memory's places with their frames renamed."""
        waypoints = (
            replace(each, frame=self.ids[each.frame], map_id=None) for each in places.waypoints
        )
        return replace(places, waypoints=tuple(waypoints), map_id=None)

    def rename_event(self, event: Event) -> Event:
        """Return an event of the second memory without its id and with its frame renamed."""
        return replace(event, id="", frame=self.ids[event.frame])

    def rename_map(self, map_id: str | None, *, whole_map_id: str | None) -> str | None:
        """Return the new name of a map of the second memory's observations."""
        _, mark, of_frame = (map_id or "").rpartition("#")
        frame_id = self.ids.get(of_frame if mark and of_frame in self.ids else None)
        frame = None if frame_id is None else self.frames.by_id[frame_id]
        return whole_map_id if frame is None else frame.observed_map


def mount(first: MemoryStore, second: MemoryStore) -> Mount:
    """Lay the frames of a second memory beside those of a first one.

    A frame of the second memory becomes one of the first's if the walls of both agree unmoved; so
    does its own frame if one of both has no walls and both name the same map. Any other stays a
    separate frame, with a pose if the walls, or the second memory itself, determine it.

    Raises:
        SemanticMapError: A kept map is damaged.
    """
    whole, other = first.read(), second.read()
    mine, theirs = _load_kept(first), _load_kept(second)
    has_no_walls = None not in mine or None not in theirs
    is_named = has_no_walls and whole.map_id is not None and whole.map_id == other.map_id
    frames, finding = whole.frames, ""
    ids = dict[FrameId, FrameId]()
    for frame in _list_frames(second):
        frame_id = frame.id or None
        found = _find_motion(theirs[frame_id], mine) if frame_id in theirs else None
        is_own = frame_id is None and is_named and found is None
        if is_own or (found is not None and found[1] == STILL):
            ids[frame_id] = None if found is None else found[0]
            continue
        ids[frame_id] = new_id = frames.free_id()
        frames = frames.added(replace(frame, id=new_id, walls=None, pose=None, reference=None))
        if found is not None:
            frames = frames.aligned(new_id, found[0], motion=found[1])
        if frame_id is None:
            finding = _say_mounted(new_id, found)
    for frame in other.frames.items:
        of, into = ids[frame.id], ids[frame.reference]
        motion = other.frames.find_transform(of=frame.id, into=frame.reference)
        if motion is not None and frames.find_transform(of=of, into=into) is None:
            frames = frames.aligned(of, into, motion=motion)
    # Of two maps of one frame the first memory's is kept.
    kept = {ids[frame_id]: grid for frame_id, grid in theirs.items()} | mine
    walls = {}
    for number, (frame_id, grid) in enumerate(kept.items(), start=2):
        name = frames.own_walls if frame_id is None else f"map-{number}.yaml"
        walls[name] = grid
        if frame_id is not None:
            frames = frames.changed(frame_id, walls=name)
    return Mount(frames=frames, ids=ids, walls=walls, finding=finding)


def _list_frames(store: MemoryStore) -> tuple[MapFrame, ...]:
    """Return all frames that a memory names: its own, without an id, and those without an entry."""
    memory = store.read()
    entries = memory.frames.by_id
    named = (
        *entries,
        *(frame.reference for frame in memory.frames.items),
        *(place.frame for place in memory.waypoints),
        *(event.frame for event in store.read_events()),
    )
    others = dict.fromkeys(filter(None, named))
    own = MapFrame(id="", map_id=memory.map_id)
    return (own, *(entries.get(frame_id) or MapFrame(id=frame_id) for frame_id in others))


def _say_mounted(new_id: str, found: tuple[FrameId, Pose] | None) -> str:
    if found is None:
        return (
            "The second memory is of another map, or nothing tells how it lies: it stays apart, "
            f"as the frame {new_id}."
        )
    return (
        f"The second memory's map lies turned by {math.degrees(found[1].yaw_rad):.1f} "
        f"degrees, its origin at ({found[1].x:.2f}, {found[1].y:.2f}), as its walls tell."
    )


def _find_motion(
    kept: OccupancyGrid, others: Mapping[FrameId, OccupancyGrid]
) -> tuple[FrameId, Pose] | None:
    """Return the frame on whose walls a kept map surely fits, and the fit; prefer no motion."""
    compared = {frame_id: compare_maps(kept, other) for frame_id, other in others.items()}
    for frame_id, comparison in compared.items():
        if comparison.relation is MapRelation.SAME:
            return frame_id, STILL
    for frame_id, comparison in compared.items():
        if comparison.relation is MapRelation.MOVED and comparison.fit is not None:
            return frame_id, comparison.fit.new_from_old
    return None


def _load_kept(store: MemoryStore) -> dict[FrameId, OccupancyGrid]:
    names = store.read().frames.walls
    grids = {frame_id: store.walls.load(name) for frame_id, name in names.items()}
    return {frame_id: grid for frame_id, grid in grids.items() if grid is not None}
