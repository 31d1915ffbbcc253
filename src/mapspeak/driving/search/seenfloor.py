"""Floor that the camera has seen from near; what the lidar has mapped may not have been seen."""

import math
from collections.abc import Iterable

import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.fieldofview import HALF_VIEW_RAD
from mapspeak.spatial.grid import IntArray, Mask
from mapspeak.spatial.visibility import cast_rays

REACH_M = 4.0
"""Things are known from no farther, whatever the camera shows of the background."""
LOOKED_NEAR_M = 0.4
LOOKED_RAD = math.radians(15)
SAME_PLACE_M = 0.1
SAME_HEADING_RAD = math.radians(2)


class SeenFloor:
    """All looks of the camera so far.

    Args:
        earlier: Looks from before the search, which count until `forget_earlier`: the pose of the
            camera in the map frame, and its opening, None where the robot does not say.

    Attributes:
        half_view_rad: Half the opening of the camera, by its latest picture.
    """

    def __init__(self, *, earlier: Iterable[tuple[Pose, float | None]] = ()) -> None:
        self.half_view_rad = HALF_VIEW_RAD
        self._views: list[tuple[Pose, float]] = []
        self._looks: list[Pose] = []
        self._earlier = [(pose, self._half_view(fov_rad)) for pose, fov_rad in earlier]

    def add(self, pose: Pose, fov_rad: float | None) -> None:
        """Note a look by the camera's pose and opening; one like an earlier one adds nothing."""
        half_rad = self._half_view(fov_rad)
        known = (each for each, _ in self._views)
        if not any(
            pose.is_near(each, off_m=SAME_PLACE_M, turn_rad=SAME_HEADING_RAD) for each in known
        ):
            self._views.append((pose, half_rad))

    def _half_view(self, fov_rad: float | None) -> float:
        if fov_rad is not None:
            self.half_view_rad = fov_rad / 2
        return self.half_view_rad

    @property
    def n_earlier(self) -> int:
        """How many looks from before count."""
        return len(self._earlier)

    def forget_earlier(self) -> None:
        """Let only looks of this search count from now on."""
        self._earlier.clear()

    def has_look_from(self, pose: Pose) -> bool:
        """Return True if the caller was shown a picture from this pose."""
        return any(
            look.is_near(pose, off_m=LOOKED_NEAR_M, turn_rad=LOOKED_RAD) for look in self._looks
        )

    def add_look(self, pose: Pose, fov_rad: float | None) -> None:
        """Note a picture that the caller was shown."""
        self._looks.append(pose)
        self.add(pose, fov_rad)

    def mask_on(self, grid: OccupancyGrid, *, around: Point | None = None) -> Mask:
        """Return the free cells of a map that were looked at from near, as a mask.

        Args:
            around: Only what can be seen from near here matters; None where all does.
        """
        seen = np.zeros(grid.cells.shape, dtype=np.bool_)
        for pose, half_rad in (*self._views, *self._earlier):
            if around is None or pose.point.distance_to(around) <= 2 * REACH_M:
                seen.flat[_cells_in_view(grid, pose, half_rad)] = True
        return seen


def _cells_in_view(grid: OccupancyGrid, pose: Pose, half_rad: float) -> IntArray:
    """Return flat indices of the free cells that a look shows."""
    # Where rays are furthest apart they are still nearer to each other than cells are.
    n_rays = math.ceil(2 * half_rad * REACH_M / grid.resolution_m * 1.2)
    angles = pose.yaw_rad + np.linspace(-half_rad, half_rad, n_rays)
    steps_m = np.arange(0.0, REACH_M, grid.resolution_m * 0.9)
    place = np.array([[pose.x, pose.y]])
    rays = cast_rays(
        grid.cells.shape,
        grid.fractional_cells_at(place),
        angles_rad=angles - grid.origin.yaw_rad,
        steps=steps_m / grid.resolution_m,
    )
    return rays.cells[rays.follow(grid.free)]
