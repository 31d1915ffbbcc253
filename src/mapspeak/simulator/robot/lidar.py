"""The LiDAR: ranges all around, by angular bucketing of the edges around it.

It stands for a 3-D LiDAR whose returns within the robot's height are flattened to one ring, as
`pointcloud_to_laserscan` does, so a table top is seen as well as a table leg. Ranges beyond the
reach are infinite, as in `sensor_msgs/LaserScan`.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Pose
from mapspeak.simulator.worlds.slices import Slice

FloatArray = NDArray[np.float64]

N_BEAMS = 720
MIN_RANGE_M = 0.1
MAX_RANGE_M = 20.0
NOISE_M = 0.01
_STEP_RAD = math.tau / N_BEAMS
_CORNER_SHARE = 1e-9
"""The share of a beam's step by which edges overlap, so that no beam slips through a corner."""

BEAM_ANGLES_RAD = -math.pi + _STEP_RAD * np.arange(N_BEAMS)
BEAM_ANGLES_RAD.setflags(write=False)
BEAM_DIRECTIONS = np.stack([np.cos(BEAM_ANGLES_RAD), np.sin(BEAM_ANGLES_RAD)], axis=1)
BEAM_DIRECTIONS.setflags(write=False)
BEAM_X, BEAM_Y = np.ascontiguousarray(BEAM_DIRECTIONS.T)


@dataclass(frozen=True, slots=True, eq=False)
class LidarScan:
    """One turn of the LiDAR; compared by identity.

    Attributes:
        ranges_m: Shape (720,), from straight behind counter-clockwise; infinite for no return.
        stamp_s: Robot time of the measurement.
    """

    ranges_m: FloatArray
    stamp_s: float

    def __post_init__(self) -> None:
        ranges = np.array(self.ranges_m, dtype=np.float64)
        ranges.setflags(write=False)
        object.__setattr__(self, "ranges_m", ranges)

    @property
    def is_return(self) -> NDArray[np.bool_]:
        """True for the beams that hit something."""
        return np.isfinite(self.ranges_m)

    @property
    def n_returns(self) -> int:
        """Number of beams that hit something."""
        return int(self.is_return.sum())

    @property
    def ends_in_base(self) -> FloatArray:
        """Where the beams end in the robot's own frame, shape (720, 2); at 0 without a return."""
        return BEAM_DIRECTIONS * np.where(self.is_return, self.ranges_m, 0.0)[:, None]

    @property
    def points_in_base(self) -> FloatArray:
        """The returns as points of shape (n, 2) in the robot's own frame."""
        seen = self.is_return
        return BEAM_DIRECTIONS[seen] * self.ranges_m[seen, None]


class Lidar:
    """A LiDAR at the robot's centre that measures with noise."""

    def __init__(self, solids: Slice, *, random: np.random.Generator) -> None:
        self._edges = solids.edges
        self._random = random

    def stand_among(self, solids: Slice) -> None:
        """Measure what is solid from now on."""
        self._edges = solids.edges

    def scan(self, world_from_base: Pose, *, stamp_s: float) -> LidarScan:
        """Measure from the robot's true pose."""
        ranges = measure_ranges(self._edges, world_from_base)
        ranges += self._random.normal(0.0, NOISE_M, N_BEAMS)
        ranges[(ranges < MIN_RANGE_M) | (ranges > MAX_RANGE_M)] = np.inf
        return LidarScan(ranges, stamp_s)


def measure_ranges(edges: FloatArray, world_from_base: Pose) -> FloatArray:
    """Return the exact distance along each of the 720 beams; infinite without a hit.

    Args:
        edges: As in `Slice.edges`.
        world_from_base: Pose of the LiDAR.
    """
    ranges = np.full(N_BEAMS, np.inf)
    starts, along = _edges_in_base(edges, world_from_base)
    edge, beam = _pair_edges_with_beams(starts, along)
    across = BEAM_X[beam] * along[edge, 1] - BEAM_Y[beam] * along[edge, 0]
    # A beam in line with an edge meets one of its ends, which belongs to a neighbour as well.
    across[np.abs(across) < 1e-12] = np.inf
    distance = _cross(starts, along)[edge] / across
    distance[distance <= 0] = np.inf
    np.minimum.at(ranges, beam, distance)
    return ranges


def _edges_in_base(edges: FloatArray, world_from_base: Pose) -> tuple[FloatArray, FloatArray]:
    """Return the edges' starts, and the vectors to their ends, turned into the robot's frame."""
    cos, sin = math.cos(world_from_base.yaw_rad), math.sin(world_from_base.yaw_rad)
    base_axes = np.array([[cos, -sin], [sin, cos]])
    starts = (edges[:, :2] - (world_from_base.x, world_from_base.y)) @ base_axes
    return starts, (edges[:, 2:] - edges[:, :2]) @ base_axes


def _pair_edges_with_beams(
    starts: FloatArray, along: FloatArray
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return every (edge, beam) whose beam points between the edge's two ends."""
    ends = starts + along
    from_rad = np.arctan2(starts[:, 1], starts[:, 0])
    turn_rad = np.arctan2(ends[:, 1], ends[:, 0]) - from_rad
    turn_rad = (turn_rad + math.pi) % math.tau - math.pi
    low_rad = from_rad + np.minimum(turn_rad, 0.0) + math.pi
    first = np.ceil(low_rad / _STEP_RAD - _CORNER_SHARE).astype(np.intp)
    last = np.floor((low_rad + np.abs(turn_rad)) / _STEP_RAD + _CORNER_SHARE).astype(np.intp)
    n_beams = np.maximum(last - first + 1, 0)
    edge = np.repeat(np.arange(len(starts)), n_beams)
    nth = np.arange(len(edge)) - np.repeat(np.cumsum(n_beams) - n_beams, n_beams)
    return edge, (first[edge] + nth) % N_BEAMS


def _cross(left: FloatArray, right: FloatArray) -> FloatArray:
    return left[:, 0] * right[:, 1] - left[:, 1] * right[:, 0]
