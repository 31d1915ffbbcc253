"""The truth about a simulation, hidden from the robot: for scoring alone.

Cells of truth grids lie in the map frame, which starts where the robot starts, and share their
borders with the cells of the robot's own map.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point, Pose
from mapspeak.simulator.robot.gridmap import CELL_SIZE_M
from mapspeak.simulator.robot.lidar import (
    BEAM_DIRECTIONS,
    MAX_RANGE_M,
    measure_ranges,
)
from mapspeak.simulator.robot.physics import RobotBody
from mapspeak.simulator.robot.scanmatch import place_points
from mapspeak.simulator.robot.slam import Localiser, Mapper
from mapspeak.simulator.worlds.models import find_kind
from mapspeak.simulator.worlds.slices import FloatArray, Slice, fill_outlines, slice_world
from mapspeak.simulator.worlds.world import BODY_BAND_M, BODY_RADIUS_M, TrueRoom, World, WorldObject
from mapspeak.spatial import UNKNOWN, OccupancyGrid
from mapspeak.spatial.paths import clearance_m

Mask = NDArray[np.bool_]

_MARGIN_M = 0.5
_FREE, _SOLID = 0, 100
_TOUCHED_RATIO = 1e-6
_LOOK_EVERY_M = 0.5
"""The spacing of the places from which an ideal LiDAR looks."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredRoom:
    """A room with its areas.

    Attributes:
        room: As the world file outlines it.
        outline_area_m2: Inside the outline, walls and furniture included.
        free_area_m2: Floor that nothing stands on.
    """

    room: TrueRoom
    outline_area_m2: float
    free_area_m2: float


class TrueFloor:
    """The floor of a world as cells of the map frame; built once, when first asked for."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._map_from_world = world.start.inverse()

    @cached_property
    def _solids(self) -> Slice:
        return slice_world(self._world, low_m=BODY_BAND_M[0], high_m=BODY_BAND_M[1])

    @cached_property
    def rooms(self) -> tuple[MeasuredRoom, ...]:
        """All rooms with their areas."""
        free = self.solid.cells == _FREE
        return tuple(self._measure(room, free) for room in self._world.rooms)

    @cached_property
    def solid(self) -> OccupancyGrid:
        """Cells: 100 where something solid takes half of a cell, 0 elsewhere, over the world."""
        return self._rasterise(least_ratio=0.5)

    def _rasterise(self, *, least_ratio: float) -> OccupancyGrid:
        corners = np.concatenate([self._in_map(outline) for outline in self._solids.outlines])
        low = np.floor((corners.min(axis=0) - _MARGIN_M) / CELL_SIZE_M).astype(int)
        high = np.ceil((corners.max(axis=0) + _MARGIN_M) / CELL_SIZE_M).astype(int)
        n_cols, n_rows = (high - low).tolist()
        origin = Point(*(low * CELL_SIZE_M).tolist())
        is_solid = fill_outlines(
            [self._in_map(outline) for outline in self._solids.outlines],
            shape=(n_rows, n_cols),
            origin=origin,
            cell_size_m=CELL_SIZE_M,
            least_ratio=least_ratio,
        )
        return _grid(np.where(is_solid, _SOLID, _FREE), origin)

    @cached_property
    def standable(self) -> Mask:
        """True at the cells of `solid` where the robot can come to stand from its start."""
        is_clear = clearance_m(self.solid) >= BODY_RADIUS_M
        _, labels = cv2.connectedComponents(is_clear.astype(np.uint8), connectivity=4)
        start = self.solid.cell_at(Point(0.0, 0.0))
        label = labels[start.row, start.col]
        return np.asarray((labels == label) & is_clear)

    @cached_property
    def visible(self) -> OccupancyGrid:
        """The map of a perfect robot: 0 free floor that it can see, 100 solid, else -1.

        As on every map made by a LiDAR, a cell that a surface touches is solid.
        """
        is_solid = self._rasterise(least_ratio=_TOUCHED_RATIO).cells == _SOLID
        is_seen = self.see_from(self.viewpoints)
        cells = np.where(is_solid, _SOLID, np.where(is_seen, _FREE, UNKNOWN))
        return _grid(cells, self.solid.origin.point)

    def see_from(self, points: Iterable[Point]) -> Mask:
        """Return True at the cells of `solid` that an ideal LiDAR sees from any of some points."""
        is_seen = np.zeros(self.solid.cells.shape, dtype=np.uint8)
        for point in points:
            world_from_base = self._world.start @ Pose(point.x, point.y)
            ranges = np.minimum(measure_ranges(self._solids.edges, world_from_base), MAX_RANGE_M)
            star = (BEAM_DIRECTIONS * ranges[:, None] + (point.x, point.y)) / CELL_SIZE_M
            origin = self.solid.origin
            placed = star - (origin.x / CELL_SIZE_M, origin.y / CELL_SIZE_M) - 0.5
            cv2.fillPoly(is_seen, [np.round(placed * 64).astype(np.int32)], 1, shift=6)
        return is_seen > 0

    @cached_property
    def viewpoints(self) -> list[Point]:
        """Return places where the robot can stand, spread over a square lattice."""
        rows, cols = np.nonzero(self.standable)
        every = round(_LOOK_EVERY_M / CELL_SIZE_M)
        # One place for each square of the lattice, so that narrow places have theirs too.
        _, first = np.unique(
            np.stack([rows // every, cols // every], axis=1), axis=0, return_index=True
        )
        places = self.solid.points_at(rows[first], cols[first])
        return [Point(float(x), float(y)) for x, y in places]

    def _measure(self, room: TrueRoom, free: Mask) -> MeasuredRoom:
        outline = self._in_map(np.array([(corner.x, corner.y) for corner in room.outline]))
        inside = fill_outlines(
            [outline],
            shape=free.shape,
            origin=self.solid.origin.point,
            cell_size_m=CELL_SIZE_M,
        )
        return MeasuredRoom(
            room=room,
            outline_area_m2=float(cv2.contourArea(outline.astype(np.float32))),
            free_area_m2=int((inside & free).sum()) * CELL_SIZE_M**2,
        )

    def _in_map(self, points_in_world: FloatArray) -> FloatArray:
        return place_points(self._map_from_world, points_in_world)


class Truth:
    """True state of a running simulation."""

    def __init__(self, world: World, body: RobotBody, mapper: Mapper | Localiser) -> None:
        self.world = world
        self.floor = TrueFloor(world)
        self._body = body
        self._mapper = mapper

    @property
    def pose_in_world(self) -> Pose:
        """Where the robot stands, as the world file counts."""
        return self._body.world_from_base

    @property
    def pose(self) -> Pose:
        """Where the robot stands in a map without errors, which starts where the robot did."""
        return self.world.start.inverse() @ self._body.world_from_base

    @property
    def slam_error_m(self) -> float:
        """Error of the robot's own pose."""
        return self.pose.point.distance_to(self._mapper.map_from_base.point)

    @property
    def n_collisions(self) -> int:
        """Number of collisions so far."""
        return self._body.n_collisions

    @property
    def driven_m(self) -> float:
        """Distance driven so far."""
        return self._body.driven_m


def _grid(cells: NDArray[np.integer[Any]], origin: Point) -> OccupancyGrid:
    return OccupancyGrid(
        cells=cells.astype(np.int8), resolution_m=CELL_SIZE_M, origin=Pose(origin.x, origin.y)
    )


EYE_BAND_M = (1.05, 1.15)
"""Obstacles as high as the camera, which hide what lies behind them."""
OWN_SIZE_M = 0.5
"""What a thing stands in does not hide it."""
IN_WALL_M = 0.05
"""The surface of the wall that a thing hangs on does not hide it."""
SIDEWAYS_M = (0.0, -0.1, 0.1, -0.2, 0.2)
"""A thing has some width: it is in sight when any part of it is."""


class EyeLevel:
    """A world as high as the camera: walls and things that hide what lies behind them."""

    def __init__(self, world: World) -> None:
        low_m, high_m = EYE_BAND_M
        self._walls = slice_world(replace(world, objects=()), low_m=low_m, high_m=high_m)
        self._things = replace(world, walls=(), doors=())
        self._others: dict[str, Slice] = {}

    def _slice_others(self, thing: WorldObject) -> Slice:
        """Return what stands about beside a thing: of a forklift, most is far from its middle."""
        if thing.name not in self._others:
            others = tuple(each for each in self._things.objects if each.name != thing.name)
            world, (low_m, high_m) = replace(self._things, objects=others), EYE_BAND_M
            self._others[thing.name] = slice_world(world, low_m=low_m, high_m=high_m)
        return self._others[thing.name]

    def find_sights(self, thing: WorldObject, places: FloatArray) -> Mask:
        """Return True for the places from which a thing is in sight, unless all of it is hidden.

        What hangs on a wall is hidden from everywhere behind that wall.

        Args:
            places: In the world's own frame, shape (n, 2).
        """
        at = np.array([thing.pose.x, thing.pose.y])
        to_thing = at - places
        away_m = np.maximum(np.hypot(to_thing[:, 0], to_thing[:, 1]), 1e-9)
        aside = np.stack([-to_thing[:, 1], to_thing[:, 0]], axis=1) / away_m[:, None]
        reach_m = float(away_m.max(initial=0.0)) + max(SIDEWAYS_M)
        walls, things = (
            each.near(thing.pose.point, reach_m=reach_m).edges
            for each in (self._walls, self._slice_others(thing))
        )
        is_seen = np.zeros(len(places), dtype=np.bool_)
        for sideways_m in SIDEWAYS_M:
            left = np.flatnonzero(~is_seen)
            parts = at + sideways_m * aside[left]
            is_hidden = _cross(walls, places[left], parts, stop_before_m=IN_WALL_M)
            is_hidden |= _cross(things, places[left], parts, stop_before_m=OWN_SIZE_M)
            is_seen[left] = ~is_hidden
        if find_kind(thing.kind).is_wall_hung:
            is_seen &= place_points(thing.pose.inverse(), places)[:, 0] > 0
        return is_seen


def is_in_sight(world: World, place: Point, thing: WorldObject) -> bool:
    """Return True unless all of a thing is hidden from a place of the world's own frame."""
    return bool(EyeLevel(world).find_sights(thing, np.array([[place.x, place.y]]))[0])


def _cross(
    edges: FloatArray, starts: FloatArray, ends: FloatArray, *, stop_before_m: float
) -> Mask:
    """Return True for the lines from starts towards ends, shape (n, 2), that cross any edge."""
    along = ends - starts
    length_m = np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-9)
    along = along * np.maximum(1 - stop_before_m / length_m, 0.0)[:, None]
    sides, gaps = edges[:, 2:] - edges[:, :2], edges[None, :, :2] - starts[:, None]
    across = along[:, :1] * sides[:, 1] - along[:, 1:] * sides[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        on_line = (gaps[..., 0] * sides[:, 1] - gaps[..., 1] * sides[:, 0]) / across
        on_edge = (gaps[..., 0] * along[:, 1:] - gaps[..., 1] * along[:, :1]) / across
    meets = (on_line > 0) & (on_line < 1) & (on_edge >= 0) & (on_edge <= 1)
    return np.asarray(meets.any(axis=1))
