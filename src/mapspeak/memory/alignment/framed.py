"""A memory in the frame of the robot's map, with records that cannot be placed kept apart.

Only this module holds back records of other maps: readers get no waypoint, event or thing that is
not aligned with the robot's map.
"""

from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace

from mapspeak.memory.alignment.keeping import FrameKeeper
from mapspeak.memory.episodes.observation import MapPlacing
from mapspeak.memory.events import Event
from mapspeak.memory.frames import FrameId, Frames
from mapspeak.memory.store.memorystore import MemoryStore, Records, Result, WriteReceipt
from mapspeak.memory.waypoint import SemanticMap, Waypoint
from mapspeak.spatial import OccupancyGrid


class FramedMemory(MemoryStore):
    """A memory store that is read and written in the frame of the robot's map.

    Attributes:
        store: Holds the records, each in its own frame.
        keeper: Knows the frame of the robot's map.
    """

    def __init__(
        self,
        store: MemoryStore,
        *,
        name_robot: Callable[[], str] = str,
        lock: AbstractContextManager[object] | None = None,
    ) -> None:
        super().__init__(path=store.path, walls=store.walls, map_id=store.map_id)
        self.store = store
        self.keeper = FrameKeeper(store, name_robot=name_robot, lock=lock)
        self._read: _Read | None = None

    def meet(self, grid: OccupancyGrid) -> None:
        """Find out which frame the robot's map is in (see `FrameKeeper.meet`)."""
        self.keeper.meet(grid)

    def read(self) -> SemanticMap:
        """Return the remembered places in the frame of the robot's map; others are elsewhere.

        Before there is a map, all places are returned unmoved: no drive can use them yet.
        """
        memory = self.store.read()
        self.keeper.review(memory)
        here = (self.keeper.has_met, self.keeper.is_placed, self.keeper.frame)
        last = self._read
        if last is None or last.memory is not memory or last.here != here:
            is_same = last is not None and (last.here, last.memory.frames) == (here, memory.frames)
            last = self._read = self._place_all(memory, here, last if is_same else None)
        events = self.store.read_events()
        n_elsewhere = len(events) - len(self._place_events(events, memory.frames))
        return replace(last.told, n_events_elsewhere=n_elsewhere)

    def _place_all(
        self, memory: SemanticMap, here: tuple[object, ...], earlier: "_Read | None"
    ) -> "_Read":
        known = dict[int, _Shown]()
        if earlier is not None:
            known = dict(zip(map(id, earlier.memory.waypoints), earlier.shown, strict=True))
        shown = [
            known.get(id(each)) or self._show(each, memory.frames) for each in memory.waypoints
        ]
        told = replace(
            memory,
            waypoints=tuple(told for told, is_here in shown if is_here and told is not None),
            elsewhere=tuple(told for told, is_here in shown if not is_here and told is not None),
        )
        return _Read(memory=memory, here=here, told=told, shown=shown)

    def _show(self, waypoint: Waypoint, frames: Frames) -> "_Shown":
        if waypoint.is_gone:
            return None, False
        present = waypoint.present()
        placed = self._place(present, frames) if self.keeper.has_met else present
        return placed or present, placed is not None

    def read_events(self) -> tuple[Event, ...]:
        """Return the events in the frame of the robot's map, and no others.

        Events that people wrote without metres, in a file of no known map, apply everywhere:
        driving a closed way is worse than avoiding an open one.
        """
        memory = self.store.read()
        self.keeper.review(memory)
        return self._place_events(self.store.read_events(), memory.frames)

    def _place_events(self, events: Iterable[Event], frames: Frames) -> tuple[Event, ...]:
        if not self.keeper.has_met:
            return tuple(events)
        return tuple(filter(None, (self._place_event(each, frames) for each in events)))

    def _place_event(self, event: Event, frames: Frames) -> Event | None:
        keeper = self.keeper
        placed = frames.bring(event, keeper.frame) if keeper.is_placed else None
        if placed is not None or event.frame is not None or event.at or event.outlines:
            return placed
        return None if keeper.has_walls(None) else event

    def name_map(self) -> str | None:
        """Return the name of the robot's map in observations; begin a frame if needed.

        Raises:
            SemanticMapError: A new frame cannot be written.
        """
        frame_id = self.keeper.place()
        frame = None if frame_id is None else self.store.read().frames.by_id.get(frame_id)
        return self.map_id if frame is None else frame.observed_map

    def place_maps(self) -> tuple[MapPlacing, ...] | None:
        """Return how the maps of observations lie to the robot's; None before there is one."""
        if not self.keeper.has_met:
            return None
        memory, here = self.store.read(), self.keeper.frame
        own = dict.fromkeys((None, memory.map_id, self.map_id))
        named: list[tuple[FrameId, str | None]] = [(None, name) for name in own]
        named += [(frame.id, frame.observed_map) for frame in memory.frames.items]
        placings = []
        for frame_id, name in named if self.keeper.is_placed else ():
            motion = memory.frames.find_transform(of=frame_id, into=here)
            if motion is not None:
                placings.append(MapPlacing(name, motion))
        return tuple(placings)

    def change(
        self,
        change: Callable[[Records], Result],
        *,
        alone: bool = False,
        binding: str | None = None,
    ) -> Result:
        """Change records, each in the frame that it names."""
        return self.store.change(change, alone=alone, binding=binding)

    def write_event(self, event: Event) -> Event:
        """Write an event that is in the frame of the robot's map."""
        written = self.store.write_event(replace(event, frame=self.keeper.place()))
        placed = self.store.read().frames.bring(written, self.keeper.frame)
        assert placed is not None  # noqa: S101 - it was just written in this frame or one aligned
        return placed

    def join(
        self, waypoint: Waypoint, join: Callable[[Waypoint | None, Waypoint], Waypoint]
    ) -> WriteReceipt:
        """Write what becomes of a waypoint that is in the frame of the robot's map."""
        receipt = self.store.join(replace(waypoint, frame=self.keeper.place()), join)
        frames = self.store.read().frames
        written = self._place(receipt.waypoint, frames)
        before = receipt.previous and self._place(receipt.previous, frames)
        assert written is not None  # noqa: S101 - it was just written in this frame or one aligned
        # The room of a present sighting is a room of the robot's map.
        return WriteReceipt(
            waypoint=replace(written, room_id=waypoint.room_id).present(),
            previous=before and before.present(),
        )

    def _place(self, waypoint: Waypoint, frames: Frames) -> Waypoint | None:
        """Return a waypoint in the frame of the robot's map; None if its alignment is unknown."""
        here = self.keeper.frame
        if not self.keeper.is_placed:
            return None
        if waypoint.frame == here:
            return waypoint
        motion = frames.find_transform(of=waypoint.frame, into=here)
        if motion is None:
            return None
        return waypoint.moved(motion, here)


_Shown = tuple[Waypoint | None, bool]
"""A record as it is told, None where it is gone; whether it is on the robot's map."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Read:
    """What was read last.

    Attributes:
        here: What was known of the robot's map.
        shown: Each record of the memory: most are the very same the next time.
    """

    memory: SemanticMap
    here: tuple[object, ...]
    told: SemanticMap
    shown: list[_Shown]
