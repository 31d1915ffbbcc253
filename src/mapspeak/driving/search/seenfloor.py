"""Which floor the camera has looked at from near: what a LiDAR has mapped nobody has seen yet."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.grid import IntArray, Mask
from mapspeak.spatial.visibility import cast_rays

REACH_M = 4.0
"""Things are known from no farther, whatever the camera shows of the background."""
HALF_VIEW_RAD = math.radians(30)
"""Half the opening of a common camera, where the robot does not say."""
LOOKED_NEAR_M = 0.4
LOOKED_RAD = math.radians(15)
SAME_PLACE_M = 0.1
SAME_HEADING_RAD = math.radians(2)


@dataclass(frozen=True, slots=True)
class _View:
    pose: Pose
    half_rad: float

    def is_like(self, other: "_View") -> bool:
        """Return True when there is no need to remember both."""
        turn_rad = abs(wrap_angle(self.pose.yaw_rad - other.pose.yaw_rad))
        is_near = self.pose.point.distance_to(other.pose.point) <= SAME_PLACE_M
        return is_near and turn_rad <= SAME_HEADING_RAD


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
        self._views: list[_View] = []
        self._looks: list[Pose] = []
        self._earlier: list[_View] = []
        for pose, fov_rad in earlier:
            self._earlier.append(self._view(pose, fov_rad))

    def add(self, pose: Pose, fov_rad: float | None) -> None:
        """Note a look; one like an earlier one adds nothing.

        Args:
            pose: Of the camera, in the map frame.
            fov_rad: Its opening; None where the robot does not say.
        """
        view = self._view(pose, fov_rad)
        if not any(view.is_like(other) for other in self._views):
            self._views.append(view)

    def _view(self, pose: Pose, fov_rad: float | None) -> _View:
        if fov_rad is not None:
            self.half_view_rad = fov_rad / 2
        return _View(pose, self.half_view_rad)

    @property
    def n_earlier(self) -> int:
        """How many looks from before count."""
        return len(self._earlier)

    def forget_earlier(self) -> None:
        """Let only looks of this search count from now on."""
        self._earlier.clear()

    def has_look_from(self, pose: Pose) -> bool:
        """Return True when somebody was shown what is to be seen in a pose."""
        return any(
            look.point.distance_to(pose.point) <= LOOKED_NEAR_M
            and abs(wrap_angle(look.yaw_rad - pose.yaw_rad)) <= LOOKED_RAD
            for look in self._looks
        )

    def add_look(self, pose: Pose, fov_rad: float | None) -> None:
        """Note a picture that somebody was shown.

        Args:
            pose: Of the camera, in the map frame.
            fov_rad: Its opening; None where the robot does not say.
        """
        self._looks.append(pose)
        self.add(pose, fov_rad)

    def mask_on(self, grid: OccupancyGrid, *, around: Point | None = None) -> Mask:
        """Return the free cells of a map that were looked at from near, as a mask.

        Args:
            grid: The map.
            around: Only what can be seen from near here matters; None where all does.
        """
        seen = np.zeros(grid.cells.shape, dtype=np.bool_)
        for view in (*self._views, *self._earlier):
            if around is not None and view.pose.point.distance_to(around) > 2 * REACH_M:
                continue
            seen.flat[_cells_in_view(grid, view)] = True
        return seen


def _cells_in_view(grid: OccupancyGrid, view: _View) -> IntArray:
    """Return flat indices of the free cells that a look shows."""
    # Where rays are furthest apart they are still nearer to each other than cells are.
    n_rays = math.ceil(2 * view.half_rad * REACH_M / grid.resolution_m * 1.2)
    angles = view.pose.yaw_rad + np.linspace(-view.half_rad, view.half_rad, n_rays)
    steps_m = np.arange(0.0, REACH_M, grid.resolution_m * 0.9)
    place = np.array([[view.pose.x, view.pose.y]])
    rays = cast_rays(
        grid.cells.shape,
        grid.fractional_cells_at(place),
        angles_rad=angles - grid.origin.yaw_rad,
        steps=steps_m / grid.resolution_m,
    )
    return rays.cells[rays.follow(grid.free)]
