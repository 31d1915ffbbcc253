"""What streams carry: written anew for each message, with its stamp."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from mapspeak.geometry import Pose
from mapspeak.ros.messages.fields import Dialect, Message, write_header
from mapspeak.ros.messages.grids import write_grid
from mapspeak.ros.messages.poses import FrameTransform, write_transforms
from mapspeak.spatial import OccupancyGrid


class Content(Protocol):
    """What a message says."""

    def write(self, stamp_s: float, dialect: Dialect) -> Message:
        """Return the message; fields that are left out hold their defaults.

        Args:
            stamp_s: Its time, in seconds of the robot's clock.
            dialect: In whose words.
        """
        ...


@dataclass(frozen=True, slots=True)
class Fields:
    """Plain fields.

    Attributes:
        values: By name.
        frame_id: Of its header; None for a message without one.
    """

    values: Mapping[str, Any] = field(default_factory=dict)
    frame_id: str | None = None

    def write(self, stamp_s: float, dialect: Dialect) -> Message:
        """Return the fields, with a header where there is one."""
        if self.frame_id is None:
            return dict(self.values)
        return {"header": write_header(self.frame_id, stamp_s, dialect=dialect), **self.values}


@dataclass(frozen=True, slots=True)
class Transform:
    """One transform between two frames.

    Attributes:
        parent: The frame that it is told in.
        child: The frame that it tells of.
        pose: Of the child in the parent.
    """

    parent: str
    child: str
    pose: Pose


@dataclass(frozen=True, slots=True)
class Transforms:
    """Transforms that are told together.

    Attributes:
        all: Each of them.
    """

    all: tuple[Transform, ...]

    def write(self, stamp_s: float, dialect: Dialect) -> Message:
        """Return them, all with the same stamp."""
        told = [
            FrameTransform(
                parent_from_child=each.pose, parent=each.parent, child=each.child, stamp_s=stamp_s
            )
            for each in self.all
        ]
        return write_transforms(told, dialect=dialect)


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """A grid.

    Attributes:
        grid: Which.
    """

    grid: OccupancyGrid

    def write(self, stamp_s: float, dialect: Dialect) -> Message:
        """Return the grid as it is."""
        del stamp_s
        return write_grid(self.grid, dialect=dialect)


@dataclass(frozen=True, slots=True)
class Beams:
    """A laser scan all round, of walls at one distance.

    Attributes:
        frame_id: The scanner's frame.
        n_beams: How many.
        range_m: How far away the walls are.
    """

    frame_id: str
    n_beams: int
    range_m: float

    def write(self, stamp_s: float, dialect: Dialect) -> Message:
        """Return the scan."""
        return {
            "header": write_header(self.frame_id, stamp_s, dialect=dialect),
            "angle_min": -3.14,
            "angle_max": 3.14,
            "angle_increment": 6.28 / (self.n_beams - 1),
            "range_min": 0.05,
            "range_max": 12.0,
            "ranges": [self.range_m] * self.n_beams,
        }
