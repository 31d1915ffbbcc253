"""Frames of records, and the transforms between them.

A memory's own frame has no id (None) and no entry: records belong to it unless they name another
one. Every other frame is `{id, map, robot, walls, pose, in}`. Its pose is that of its origin in the
frame `in`, by default the memory's own; without a pose its transform is unknown.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol, Self, TypeVar

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose

FrameId = str | None
"""None is the memory's own frame."""
OWN_WALLS = "map.yaml"
"""Default name of the kept map of the memory's own frame."""


class _Framed(Protocol):
    @property
    def frame(self) -> FrameId: ...

    def moved(self, motion: Pose, into: FrameId = None) -> Self: ...


AnyFramed = TypeVar("AnyFramed", bound=_Framed)


@dataclass(frozen=True, slots=True, kw_only=True)
class MapFrame:
    """A frame beside the memory's own.

    Attributes:
        map_id: The name of its map, if it has one.
        robot: The robot that made the map.
        walls: The name of the kept map of its walls; None if no map was worth keeping.
        pose: Of its origin in the frame `reference`; None while unknown.
    """

    id: str
    map_id: str | None = None
    robot: str | None = None
    walls: str | None = None
    pose: Pose | None = None
    reference: FrameId = None

    @property
    def observed_map(self) -> str:
        """Name of this frame's map in observations: "house#F2"."""
        return f"{self.map_id or ''}#{self.id}"


@dataclass(frozen=True)
class Frames:
    """All frames of a memory beside its own: forests of frames whose relation is known.

    Attributes:
        own_walls: The name of the kept map of the memory's own frame.
    """

    items: tuple[MapFrame, ...] = ()
    own_walls: str = OWN_WALLS

    @cached_property
    def by_id(self) -> Mapping[str, MapFrame]:
        """Each frame under its id."""
        return {frame.id: frame for frame in self.items}

    @property
    def walls(self) -> Mapping[FrameId, str]:
        """The names of kept maps by their frames, the memory's own first."""
        return {None: self.own_walls} | {each.id: each.walls for each in self.items if each.walls}

    def find_root(self, frame_id: FrameId) -> tuple[FrameId, Pose]:
        """Return the root of a frame, and its pose there.

        A frame without an entry is its own root; frames in a cycle share no root with others.
        """
        pose, seen = Pose(0.0, 0.0), {frame_id}
        while frame_id is not None:
            frame = self.by_id.get(frame_id)
            if frame is None or frame.pose is None or frame.reference in seen:
                break
            pose, frame_id = frame.pose @ pose, frame.reference
            seen.add(frame_id)
        return frame_id, pose

    def find_transform(self, *, of: FrameId, into: FrameId) -> Pose | None:
        """Return the transform that moves poses of a frame into another, or None."""
        if of == into:
            return Pose(0.0, 0.0)
        (root, pose), (other_root, other_pose) = self.find_root(of), self.find_root(into)
        return other_pose.inverse() @ pose if root == other_root else None

    def bring(self, record: AnyFramed, into: FrameId) -> AnyFramed | None:
        """Return a record in another frame; None if unknown."""
        if record.frame == into:
            return record
        motion = self.find_transform(of=record.frame, into=into)
        return None if motion is None else record.moved(motion, into)

    def added(self, frame: MapFrame) -> "Frames":
        """Return them with another frame."""
        return replace(self, items=(*self.items, frame))

    def changed(self, frame_id: str, **entries: object) -> "Frames":
        """Return them with one frame changed."""
        items = (
            replace(each, **entries) if each.id == frame_id else each  # type: ignore[arg-type]  # as replace takes them
            for each in self.items
        )
        return replace(self, items=tuple(items))

    def aligned(self, of: FrameId, into: FrameId, *, motion: Pose) -> "Frames":
        """Return them with a transform between two frames that had none so far.

        Args:
            of: The moved frame; all frames with the same root follow it.
            into: The other frame.
            motion: Moves poses of the former into the latter.

        Raises:
            SemanticMapError: The frame has no entry.
        """
        (root, pose), (other_root, other_pose) = self.find_root(of), self.find_root(into)
        other_from_root = other_pose @ motion @ pose.inverse()
        if root is None:
            # The memory's own frame is always a root.
            root, other_root = other_root, root
            other_from_root = other_from_root.inverse()
        if root is None or root not in self.by_id:
            message = f"The memory says nothing of its frame {root}."
            raise SemanticMapError(message, hint="Add it to the list `frames` of the file.")
        return self.changed(root, pose=other_from_root, reference=other_root)

    def free_id(self) -> str:
        """Return an id that no frame has yet: F2, F3, ..."""
        number = len(self.items) + 2
        while f"F{number}" in self.by_id:
            number += 1
        return f"F{number}"


NO_FRAMES = Frames()
