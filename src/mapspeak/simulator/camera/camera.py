"""The front camera, and the simulated detector that looks through it.

The detector is not an object detector. It knows which pixels show which object, and from nothing
else makes up what a trained detector would say: things too small, too far or hidden go unreported,
some that could be seen are missed, and directions and distances carry noise. Wherever its reports
show, they are called those of a simulated detector.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Pose
from mapspeak.robot import Detection
from mapspeak.simulator.camera.rasteriser import Viewpoint, look
from mapspeak.simulator.camera.scene import BUILDING, build_scene
from mapspeak.simulator.camera.shading import draw_picture
from mapspeak.simulator.worlds.models import find_kind
from mapspeak.simulator.worlds.world import World, WorldObject

Picture = NDArray[np.uint8]

HORIZONTAL_FOV_RAD = math.radians(85.0)
CAMERA_HEIGHT_M = 1.1


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SegmentedView:
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


class PinholeCamera:
    """A level pinhole camera. Building one prepares its world; pictures are quick then."""

    def __init__(self, world: World) -> None:
        self._scene = build_scene(world)

    def render(
        self, world_from_camera: Pose, *, width_px: int = 640, height_px: int = 480
    ) -> Picture:
        """Take a picture: red, green and blue, 0 to 255, shape (height, width, 3)."""
        return draw_picture(self._scene, _look_from(world_from_camera, width_px, height_px))

    def observe(
        self, world_from_camera: Pose, *, width_px: int = 640, height_px: int = 480
    ) -> SegmentedView:
        """Return which object each pixel shows, and no picture."""
        viewpoint = _look_from(world_from_camera, width_px, height_px)
        visibility = look(self._scene, viewpoint)
        owners = np.append(self._scene.triangles.owners[visibility.triangles], BUILDING)
        columns = (np.arange(width_px) + 0.5 - width_px / 2) / viewpoint.focal_px
        with np.errstate(divide="ignore"):
            depth_m = np.float32(1.0) / visibility.inverse_depth
        return SegmentedView(
            objects=self._scene.objects,
            object_ids=owners[visibility.rows],
            range_m=depth_m * np.hypot(1.0, columns).astype(np.float32),
            bearing_rad=-np.arctan(columns),
        )


def _look_from(world_from_camera: Pose, width_px: int, height_px: int) -> Viewpoint:
    return Viewpoint(
        pose=world_from_camera,
        height_m=CAMERA_HEIGHT_M,
        horizontal_fov_rad=HORIZONTAL_FOV_RAD,
        width_px=width_px,
        height_px=height_px,
    )


MAX_DETECTION_RANGE_M = 12.0
SMALLEST_AREA_RATIO = 0.0006
"""The share of the picture that a thing must take up: 184 of 640 x 480 pixels."""

_BEARING_NOISE_RAD = math.radians(0.5)
_RANGE_NOISE_RATIO = 0.03
_CONFIDENCE_NOISE_RATIO = 0.03
_CONFIDENCES = (0.5, 0.97)
"""Of a thing that can only just be seen, and of one that fills the picture."""
_MISSES = (0.25, 0.02)
"""How often such a thing is missed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sighting:
    """What is truly visible of one object.

    Attributes:
        kind: Of the object.
        area_ratio: The share of the picture that shows it.
        bearing_rad: The mean of its pixels.
        range_m: The median of its pixels.
    """

    kind: str
    area_ratio: float
    bearing_rad: float
    range_m: float


class SimulatedDetector:
    """Makes up what an object detector would report. Its noise and its misses come from a seed."""

    def __init__(self, *, random: np.random.Generator) -> None:
        self._random = random

    def detect(self, view: SegmentedView) -> tuple[Detection, ...]:
        """Return what the simulated detector reports of a view, from left to right."""
        sightings = sorted(_find_sightings(view), key=lambda sighting: -sighting.bearing_rad)
        return tuple(self._report(sighting) for sighting in sightings if self._notices(sighting))

    def _notices(self, sighting: _Sighting) -> bool:
        return self._random.random() >= _between(_MISSES, sighting.area_ratio)

    def _report(self, sighting: _Sighting) -> Detection:
        bearing, spread, doubt = self._random.normal(size=3)
        confidence = _between(_CONFIDENCES, sighting.area_ratio) + _CONFIDENCE_NOISE_RATIO * doubt
        return Detection(
            label=find_kind(sighting.kind).label,
            confidence_ratio=float(np.clip(confidence, 0.0, 1.0)),
            bearing_rad=sighting.bearing_rad + _BEARING_NOISE_RAD * bearing,
            range_m=sighting.range_m * max(1.0 + _RANGE_NOISE_RATIO * spread, 0.0),
        )


def _find_sightings(view: SegmentedView) -> Iterator[_Sighting]:
    """Return what can be seen of each object that is near enough and large enough."""
    n_pixels = view.object_ids.size
    for owner in np.unique(view.object_ids[view.object_ids >= 0]):
        shown = view.object_ids == owner
        area_ratio = np.count_nonzero(shown) / n_pixels
        range_m = float(np.median(view.range_m[shown]))
        if area_ratio >= SMALLEST_AREA_RATIO and range_m <= MAX_DETECTION_RANGE_M:
            yield _Sighting(
                kind=view.objects[owner].kind,
                area_ratio=area_ratio,
                bearing_rad=float(view.bearing_rad[np.nonzero(shown)[1]].mean()),
                range_m=range_m,
            )


def _between(ends: tuple[float, float], area_ratio: float) -> float:
    """Return a value between that of the smallest area and that of the whole picture.

    Half the way is gone at four times the smallest area.
    """
    smallest, whole = ends
    return whole + (smallest - whole) * math.sqrt(SMALLEST_AREA_RATIO / area_ratio)
