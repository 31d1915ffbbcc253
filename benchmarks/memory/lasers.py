"""The laser that an observer in a simulated building carries: what it truly meets, with noise."""

import numpy as np

from benchmarks.memory.sites import Site
from mapspeak.geometry import Pose, wrap_angle
from mapspeak.memory import LaserRing, build_ring
from mapspeak.simulator import BEAM_ANGLES_RAD
from mapspeak.simulator.robot.lidar import MAX_RANGE_M, NOISE_M, measure_ranges
from mapspeak.simulator.worlds.slices import slice_world

__all__ = ["BODY_LIDAR_M", "FLAT_LASER_M", "Laser"]

BODY_LIDAR_M = (0.02, 1.2)
"""What a 3-D LiDAR meets at the robot's own height, flattened to a ring: the simulated robot's."""
FLAT_LASER_M = (0.18, 0.2)
"""What a laser meets that turns in one plane near the floor: legs of tables, not their tops."""
POSE_M, POSE_RAD = 0.03, np.radians(1.0)
"""How far off the robot takes itself to be when the laser turns."""


class Laser:
    """One laser in one building.

    Args:
        site: The building.
        band_m: Between which heights it looks.
        seed: Of its noise, which takes nothing from the observer's own.
    """

    def __init__(self, site: Site, *, band_m: tuple[float, float], seed: int) -> None:
        self._world_from_map = site.world.start
        self._edges = slice_world(site.world, low_m=band_m[0], high_m=band_m[1]).edges
        self._random = np.random.default_rng([seed, 77])

    def turn(self, pose: Pose) -> LaserRing:
        """Return what it meets where the robot takes itself to stand at a pose of the map."""
        x_m, y_m = POSE_M * self._random.normal(size=2)
        yaw_rad = wrap_angle(pose.yaw_rad + POSE_RAD * float(self._random.normal()))
        truly = self._world_from_map @ Pose(pose.x + x_m, pose.y + y_m, yaw_rad)
        ranges_m = measure_ranges(self._edges, truly)
        ranges_m += self._random.normal(0.0, NOISE_M, len(ranges_m))
        ranges_m[ranges_m > MAX_RANGE_M] = np.inf
        return build_ring(
            pose,
            angles_rad=BEAM_ANGLES_RAD.astype(np.float64),
            ranges_m=np.maximum(ranges_m, 0.0),
            reach_m=MAX_RANGE_M,
        )
