"""The front camera: pictures of a world, and which object each pixel shows."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Pose
from mapspeak.simulator.rendering import BUILDING, Viewpoint, build_scene, draw_picture, look
from mapspeak.simulator.world import World, WorldObject

__all__ = ["CAMERA_HEIGHT_M", "HORIZONTAL_FOV_RAD", "Camera", "View"]

Picture = NDArray[np.uint8]

HORIZONTAL_FOV_RAD = math.radians(85.0)
CAMERA_HEIGHT_M = 1.1


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class View:
    """Which object each pixel shows, and how far it is. Never leaves the simulator.

    Attributes:
        objects: The world's objects.
        object_ids: Which of them each pixel shows, shape (height, width); -1 for none.
        range_m: Along the floor from the camera to what the pixel shows; infinite for nothing.
        bearing_rad: Of each column from the camera's heading, left positive, shape (width,).
    """

    objects: tuple[WorldObject, ...]
    object_ids: NDArray[np.intp]
    range_m: NDArray[np.float32]
    bearing_rad: NDArray[np.float64]


class Camera:
    """A level pinhole camera. Building one prepares its world; pictures are quick then."""

    def __init__(self, world: World) -> None:
        self._scene = build_scene(world)

    def render(
        self,
        world_from_camera: Pose,
        *,
        width_px: int = 640,
        height_px: int = 480,
        horizontal_fov_rad: float = HORIZONTAL_FOV_RAD,
        camera_height_m: float = CAMERA_HEIGHT_M,
    ) -> Picture:
        """Takes a picture: red, green and blue, 0 to 255, shape (height, width, 3)."""
        viewpoint = Viewpoint(
            pose=world_from_camera,
            height_m=camera_height_m,
            horizontal_fov_rad=horizontal_fov_rad,
            width_px=width_px,
            height_px=height_px,
        )
        return draw_picture(self._scene, viewpoint)

    def observe(
        self,
        world_from_camera: Pose,
        *,
        width_px: int = 640,
        height_px: int = 480,
        horizontal_fov_rad: float = HORIZONTAL_FOV_RAD,
        camera_height_m: float = CAMERA_HEIGHT_M,
    ) -> View:
        """Gives which object each pixel shows, and no picture."""
        viewpoint = Viewpoint(
            pose=world_from_camera,
            height_m=camera_height_m,
            horizontal_fov_rad=horizontal_fov_rad,
            width_px=width_px,
            height_px=height_px,
        )
        visibility = look(self._scene, viewpoint)
        owners = np.append(self._scene.triangles.owners[visibility.triangles], BUILDING)
        columns = (np.arange(width_px) + 0.5 - width_px / 2) / viewpoint.focal_px
        with np.errstate(divide="ignore"):
            depth_m = np.float32(1.0) / visibility.inverse_depth
        return View(
            objects=self._scene.objects,
            object_ids=owners[visibility.rows],
            range_m=depth_m * np.hypot(1.0, columns).astype(np.float32),
            bearing_rad=-np.arctan(columns),
        )
