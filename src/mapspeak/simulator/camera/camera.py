"""The front camera, and the simulated detector that looks through it.

The detector is not an object detector. It knows which pixels show which object, and from nothing
else simulates the reports of a trained detector: things too small, too far or hidden go unreported,
some visible ones are missed, and directions and distances carry noise. Its reports are always
labelled as those of a simulated detector.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Pose
from mapspeak.robot import Detection
from mapspeak.simulator.camera.rasteriser import FloatArray, IntArray, Viewpoint, Visibility, look
from mapspeak.simulator.camera.scene import BUILDING, PLAIN, Scene, build_scene
from mapspeak.simulator.worlds.models import find_kind
from mapspeak.simulator.worlds.world import World, WorldObject

Picture = NDArray[np.uint8]
Float32Array = NDArray[np.float32]
AnyFloats = NDArray[np.floating[Any]]

HORIZONTAL_FOV_RAD = math.radians(85.0)
CAMERA_HEIGHT_M = 1.1
FRONT, REAR = "front", "rear"
CAMERAS = {FRONT: Pose(0.0, 0.0), REAR: Pose(0.0, 0.0, math.pi)}
"""By their names: where each looks, on the robot. All are alike, on one mast."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SegmentedView:
    """The object at each pixel, and its distance. Never leaves the simulator.

    Attributes:
        object_ids: Object at each pixel, shape (height, width); -1 for none.
        range_m: Distance along the floor from the camera to the surface; infinite for nothing.
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
        """Return the object at each pixel, without drawing a picture."""
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


def measure_shares_in_view(world: World, pose: Pose) -> dict[str, float]:
    """Return the share of the camera's picture that each thing in it takes up, by its name.

    Args:
        pose: Of the robot, in the world's own frame.
    """
    view = PinholeCamera(world).observe(pose, width_px=320, height_px=240)
    numbers, counts = np.unique(view.object_ids[view.object_ids >= 0], return_counts=True)
    shares = counts / view.object_ids.size
    return {
        view.objects[number].name: float(share)
        for number, share in zip(numbers, shares, strict=True)
    }


MAX_DETECTION_RANGE_M = 12.0
SMALLEST_AREA_RATIO = 0.0006
"""The share of the picture that a thing must take up: 184 of 640 x 480 pixels."""

_BEARING_NOISE_RAD = math.radians(0.5)
_RANGE_NOISE_RATIO = 0.03
_CONFIDENCE_NOISE_RATIO = 0.03
_CONFIDENCES = (0.5, 0.97)
"""For a thing that is just visible, and for one that fills the picture."""
_MISSES = (0.25, 0.02)
"""Miss rates of such things."""


class SimulatedDetector:
    """Simulates the reports of an object detector, with seeded noise and misses."""

    def __init__(self, *, random: np.random.Generator) -> None:
        self._random = random

    def detect(self, view: SegmentedView) -> tuple[Detection, ...]:
        """Return what the simulated detector reports of a view, from left to right."""
        sightings = sorted(_find_sightings(view), key=lambda sighting: -sighting[0].bearing_rad)
        return tuple(
            self._blur(seen)
            for seen, area_ratio in sightings
            if self._random.random() >= _between(_MISSES, area_ratio)
        )

    def _blur(self, seen: Detection) -> Detection:
        """Return a detection with noise on all measured values."""
        bearing, spread, doubt = self._random.normal(size=3)
        confidence = seen.confidence_ratio + _CONFIDENCE_NOISE_RATIO * doubt
        return replace(
            seen,
            confidence_ratio=float(np.clip(confidence, 0.0, 1.0)),
            bearing_rad=seen.bearing_rad + _BEARING_NOISE_RAD * bearing,
            range_m=(seen.range_m or 0.0) * max(1.0 + _RANGE_NOISE_RATIO * spread, 0.0),
        )


def _find_sightings(view: SegmentedView) -> Iterator[tuple[Detection, float]]:
    """Return each object that is near and large enough, without noise, and its share of the view.

    Its bearing is the mean of its pixels, its range their median.
    """
    n_pixels = view.object_ids.size
    for owner in np.unique(view.object_ids[view.object_ids >= 0]):
        shown = view.object_ids == owner
        area_ratio = np.count_nonzero(shown) / n_pixels
        range_m = float(np.median(view.range_m[shown]))
        if area_ratio >= SMALLEST_AREA_RATIO and range_m <= MAX_DETECTION_RANGE_M:
            seen = Detection(
                label=find_kind(view.objects[owner].kind).label,
                confidence_ratio=_between(_CONFIDENCES, area_ratio),
                bearing_rad=float(view.bearing_rad[np.nonzero(shown)[1]].mean()),
                range_m=range_m,
            )
            yield seen, area_ratio


def _between(ends: tuple[float, float], area_ratio: float) -> float:
    """Return a value between that of the smallest area and that of the whole picture.

    It is halfway at four times the smallest area.
    """
    smallest, whole = ends
    return whole + (smallest - whole) * math.sqrt(SMALLEST_AREA_RATIO / area_ratio)


# --- from what is visible to colours: drawn surfaces, light, highlights, smooth edges ---------


_BACKGROUND = (96.0, 98.0, 102.0)
_FINER = 2
"""Supersampling of edges, across and down."""

_HIGHLIGHT = 150.0
_HIGHLIGHT_SHARPNESS = 18
_LIGHT_FROM = (-0.55, -0.45, 0.70)
"""Direction of highlights: from in front of the thing (towards the eye), left and above."""


@dataclass(frozen=True, slots=True, eq=False)
class _Samples:
    """Sample points of the picture.

    Attributes:
        rows: Of `Visibility.triangles`.
        x: From the left edge, in the finer pixels.
        y: From the top edge, likewise.
    """

    rows: IntArray
    x: Float32Array
    y: Float32Array

    def chosen(self, which: IntArray) -> "_Samples":
        return _Samples(self.rows[which], self.x[which], self.y[which])


def draw_picture(scene: Scene, viewpoint: Viewpoint) -> NDArray[np.uint8]:
    """Draw what a viewpoint sees: red, green and blue, 0 to 255, shape (height, width, 3).

    A pixel whose four quarters show the same face gets one colour; others get the mean of four.
    """
    visibility = look(scene, viewpoint.with_finer_pixels(_FINER))
    shader = _Shader(scene, visibility, viewpoint)
    rows = visibility.rows
    quarters = np.stack([rows[i::2, j::2] for i in (0, 1) for j in (0, 1)])
    faces = shader.faces[quarters]
    is_whole = (faces[1] == faces[0]) & (faces[2] == faces[0]) & (faces[3] == faces[0])
    picture = np.empty((viewpoint.height_px, viewpoint.width_px, 3), dtype=np.float32)
    v, u = np.nonzero(is_whole)
    picture[v, u] = shader.colour(_sample(quarters[0][v, u], 2 * u + 1.0, 2 * v + 1.0))
    v, u = np.nonzero(~is_whole)
    total = np.zeros((len(v), 3), dtype=np.float32)
    for i, quarter in enumerate(quarters):
        down, right = divmod(i, 2)
        total += shader.colour(_sample(quarter[v, u], 2 * u + right + 0.5, 2 * v + down + 0.5))
    picture[v, u] = total / 4
    return np.asarray(np.clip(picture + 0.5, 0, 255).astype(np.uint8))


def _sample(rows: NDArray[np.int32], x: AnyFloats, y: AnyFloats) -> _Samples:
    return _Samples(rows.astype(np.intp), x.astype(np.float32), y.astype(np.float32))


class _Shader:
    """The colour of any point of a picture, given the triangle it shows."""

    def __init__(self, scene: Scene, visibility: Visibility, viewpoint: Viewpoint) -> None:
        chosen, edges = visibility.triangles, visibility.edges
        triangles = scene.triangles
        self._scene = scene
        self._colours = triangles.colours[chosen].astype(np.float32)
        self._surfaces = triangles.surfaces[chosen]
        self._panels = triangles.panels[chosen]
        self.faces = np.append(triangles.faces[chosen], -1)
        self._inverse_depth = edges.sum(axis=1).astype(np.float32)
        self._light = _mix(triangles.light[chosen], edges)
        self._highlight = _mix(_find_highlights(scene, chosen, viewpoint), edges)
        self._u = _mix(triangles.uv[chosen, :, 0], edges)
        self._v = _mix(triangles.uv[chosen, :, 1], edges)

    def colour(self, samples: _Samples) -> Float32Array:
        """Return the colours of samples, shape (n, 3)."""
        colours = np.empty((len(samples.rows), 3), dtype=np.float32)
        is_nothing = samples.rows < 0
        is_drawn = self._surfaces[samples.rows] != PLAIN
        plain = np.flatnonzero(~is_drawn & ~is_nothing)
        drawn = np.flatnonzero(is_drawn & ~is_nothing)
        colours[plain] = self._colour_plain(samples.chosen(plain))
        colours[drawn] = self._colour_drawn(samples.chosen(drawn))
        colours[is_nothing] = _BACKGROUND
        return colours

    def _colour_plain(self, samples: _Samples) -> Float32Array:
        depth = 1.0 / _value(self._inverse_depth, samples)
        light = _value(self._light, samples) * depth
        highlight = _value(self._highlight, samples) * depth
        colours = self._colours[samples.rows]
        # Channel by channel: numpy is slow over rows of three.
        for channel in range(3):
            colours[:, channel] = colours[:, channel] * light + highlight
        return colours

    def _colour_drawn(self, samples: _Samples) -> Float32Array:
        rows = samples.rows
        depth = 1.0 / _value(self._inverse_depth, samples)
        u = _value(self._u, samples) * depth
        v = _value(self._v, samples) * depth
        uv = np.stack([u, v], axis=1)
        spread = self._find_spread(rows, uv, depth)
        drawn = self._scene.atlas.sample(self._surfaces[rows], uv, spread)
        light = _value(self._light, samples) * depth
        panels = self._panels[rows]
        on_panel = np.flatnonzero(panels != PLAIN)
        light[on_panel] = self._scene.light_map.at(panels[on_panel], uv[on_panel])
        highlight = _value(self._highlight, samples) * depth
        colours, light = self._colours[rows], light / 255.0
        for channel in range(3):
            tint = colours[:, channel] * light
            colours[:, channel] = drawn[:, channel] * tint + highlight
        return colours

    def _find_spread(self, rows: IntArray, uv: Float32Array, depth: Float32Array) -> Float32Array:
        """Return the area of the picture's pixel on the surface: the Jacobian of (x, y) to uv."""
        # Column by column: numpy is slow over rows of two.
        by_x, by_y = self._inverse_depth[rows, 0], self._inverse_depth[rows, 1]
        u, v = uv[:, 0], uv[:, 1]
        du_dx = (self._u[rows, 0] - u * by_x) * depth
        du_dy = (self._u[rows, 1] - u * by_y) * depth
        dv_dx = (self._v[rows, 0] - v * by_x) * depth
        dv_dy = (self._v[rows, 1] - v * by_y) * depth
        return np.asarray(_FINER**2 * np.abs(du_dx * dv_dy - du_dy * dv_dx))


def _find_highlights(scene: Scene, chosen: IntArray, viewpoint: Viewpoint) -> FloatArray:
    """Return the highlights at the corners of round things (Blinn's half vector, 1977)."""
    shine = np.zeros((len(chosen), 3))
    is_round = np.flatnonzero(scene.triangles.is_round[chosen])
    corners = scene.triangles.corners[chosen[is_round]]
    to_eye = viewpoint.place - corners
    to_eye /= np.linalg.norm(to_eye, axis=-1, keepdims=True)
    cos, sin = np.cos(viewpoint.pose.yaw_rad), np.sin(viewpoint.pose.yaw_rad)
    ahead, right, up = _LIGHT_FROM
    to_light = np.array([cos * ahead + sin * right, sin * ahead - cos * right, up])
    half = to_eye + to_light / np.linalg.norm(to_light)
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    facing = np.einsum("ijk,ijk->ij", scene.triangles.normals[chosen[is_round]], half)
    shine[is_round] = _HIGHLIGHT * np.maximum(facing, 0.0) ** _HIGHLIGHT_SHARPNESS
    return shine


def _mix(values: FloatArray, edges: FloatArray) -> Float32Array:
    """Return the linear function that is a quantity at the corners, over depth; shape (n, 3)."""
    return np.asarray(np.einsum("ni,nij->nj", values, edges), dtype=np.float32)


def _value(plane: Float32Array, samples: _Samples) -> Float32Array:
    rows = samples.rows
    return np.asarray(plane[rows, 0] * samples.x + plane[rows, 1] * samples.y + plane[rows, 2])
