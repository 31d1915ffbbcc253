"""The truth about a world for tasks and scores; in the map frame, metres.

The map frame starts at the world's own start. No agent but the oracle ever sees any of this.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point, Pose
from mapspeak.simulator import (
    BODY_RADIUS_M,
    KEEP_OFF_M,
    EyeLevel,
    MeasuredRoom,
    TrueFloor,
    World,
    WorldObject,
)
from mapspeak.simulator.robot.scanmatch import place_points
from mapspeak.simulator.worlds.models import find_kind
from mapspeak.spatial import Cell, OccupancyGrid
from mapspeak.spatial.grid import FloatArray, Mask
from mapspeak.spatial.paths import DistanceField, clearance_m, distances_from

BESIDE_M = 5.0
"""A robot that stands this near to a thing, with a free line of sight, has been led to it.

The paper's goal is the waypoint from which the thing was seen, 3 to 4 m away from it.
"""

START_ROOM_M = 0.4
"""A robot starts, and is sent, where it has this much room around its middle."""

LOOK_EVERY_M = 0.2
"""Spacing of the places from which a thing is looked for."""
PLAN_RADIUS_M = BODY_RADIUS_M + 0.01
_NOWHERE, _CUT_OFF, _MAIN = 0, 1, 2
"""Pieces of floor by number; where two grow into the same cell, the higher one has it."""

_PLUS = np.array([[0, 1, 0], [1, 1, 1], [0, 1, 0]], dtype=np.uint8)


@dataclass(frozen=True, slots=True, kw_only=True)
class TruePassage:
    """A way from one space straight into another.

    Attributes:
        spaces: Names of the two, in alphabetical order.
        middle: Of the line that is crossed.
    """

    spaces: tuple[str, str]
    middle: Point


class GroundTruth:
    """One world's truth."""

    def __init__(self, world: World) -> None:
        self.world = world
        self._beside: dict[str, Mask] = {}
        self.floor = TrueFloor(world)

    def with_more(self, things: Sequence[WorldObject]) -> "GroundTruth":
        """Return the same world with more things in it."""
        if not things:
            return self
        return GroundTruth(replace(self.world, objects=(*self.world.objects, *things)))

    # --- floor ---

    @cached_property
    def drivable(self) -> Mask:
        """True where the robot can drive to from anywhere on the main floor.

        On its way it keeps clear of everything that its LiDAR shows. Areas behind a gap too narrow
        for that are excluded, with the nearer half of the gap.
        """
        is_wide = self.floor.standable & (clearance_m(self.grid) >= BODY_RADIUS_M + KEEP_OFF_M)
        n_pieces, labels, stats, _ = cv2.connectedComponentsWithStats(
            is_wide.view(np.uint8), connectivity=4
        )
        standable = self.floor.standable
        if n_pieces <= 2:
            return standable
        main = 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
        pieces = np.select([labels == main, is_wide], [_MAIN, _CUT_OFF], _NOWHERE).astype(np.uint8)
        return np.asarray(standable & (_grow(pieces, standable) != _CUT_OFF))

    @cached_property
    def reachable(self) -> Mask:
        """True at the cells of the floor's grids that the robot's body can be over."""
        away = cv2.distanceTransform(
            np.logical_not(self.drivable).view(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE
        )
        return np.asarray(away * self.grid.resolution_m <= BODY_RADIUS_M)

    @property
    def grid(self) -> OccupancyGrid:
        """Solid cells, in the map frame."""
        return self.floor.solid

    @cached_property
    def roomy(self) -> Mask:
        """True where the robot can come to and has room around it."""
        return np.asarray(self.drivable & (clearance_m(self.grid) >= START_ROOM_M))

    def ways_from(self, point: Point) -> DistanceField:
        """Return the shortest ways from a point to everywhere."""
        return distances_from(self.grid, point, radius_m=PLAN_RADIUS_M)

    def shortest_to_any_m(self, start: Point, goal: Mask) -> float:
        """Return the shortest way to the nearest of some cells; infinite without one."""
        rows, cols = np.nonzero(goal & self.drivable)
        if not rows.size:
            return math.inf
        return float(self.ways_from(start).distances_at(rows, cols).min())

    def draw_pose(self, random: np.random.Generator, where: Mask | None = None) -> Pose:
        """Draw a pose where the robot has room, in the map frame; within some cells if given.

        Raises:
            ValueError: None of the cells has room for the robot.
        """
        cells = np.argwhere(self.roomy if where is None else self.roomy & where)
        row, col = cells[random.integers(len(cells))]
        x, y = self.grid.points_at(np.array([row]), np.array([col]))[0].tolist()
        return Pose(x, y, float(random.uniform(-math.pi, math.pi)))

    def in_world(self, pose: Pose) -> Pose:
        """Return a pose of the map frame as the world file counts."""
        return self.world.start @ pose

    # --- rooms ---

    @cached_property
    def rooms(self) -> tuple[MeasuredRoom, ...]:
        """All rooms, corridors and open spaces that the robot can get into."""
        return tuple(room for room in self.floor.rooms if (self.cells_of(room) & self.roomy).any())

    def cells_of(self, room: MeasuredRoom) -> Mask:
        """Return the cells inside a room's outline."""
        return np.asarray(self._labels == self._label_of[room.room.name])

    def room_at(self, point: Point) -> MeasuredRoom | None:
        """Return the space that a point lies in; None outside all of them."""
        there = self.world.start.transform(point)
        return next((room for room in self.floor.rooms if room.room.contains(there)), None)

    def room_named(self, name: str) -> MeasuredRoom:
        """Return a space by its name."""
        return next(room for room in self.floor.rooms if room.room.name == name)

    @cached_property
    def passages(self) -> tuple[TruePassage, ...]:
        """Every place where the robot passes straight from one space into another."""
        labels, standable = self._labels, self.drivable
        crossings: dict[tuple[int, int], NDArray[np.uint8]] = {}
        for here, beside in (
            (np.s_[:-1, :], np.s_[1:, :]),
            (np.s_[:, :-1], np.s_[:, 1:]),
        ):
            is_crossing = standable[here] & standable[beside] & (labels[here] != labels[beside])
            is_crossing &= (labels[here] > 0) & (labels[beside] > 0)
            for row, col in np.argwhere(is_crossing):
                one, other = sorted((int(labels[here][row, col]), int(labels[beside][row, col])))
                cells = crossings.setdefault((one, other), np.zeros(labels.shape, dtype=np.uint8))
                cells[row, col] = 1
        return tuple(
            passage for pair, cells in crossings.items() for passage in self._split(pair, cells)
        )

    def neighbours(self, room: MeasuredRoom) -> tuple[str, ...]:
        """Return the names of the spaces that one passes into straight from a room."""
        name = room.room.name
        spaces = {space for each in self.passages if name in each.spaces for space in each.spaces}
        return tuple(sorted(spaces - {name}))

    def _split(self, pair: tuple[int, int], cells: NDArray[np.uint8]) -> list[TruePassage]:
        """Return one passage for each piece of a border that can be crossed."""
        names = {label: name for name, label in self._label_of.items()}
        spaces = sorted((names[pair[0]], names[pair[1]]))
        wide = cv2.dilate(cells, np.ones((5, 5), dtype=np.uint8))
        n_pieces, pieces = cv2.connectedComponents(wide, connectivity=8)
        found = []
        for piece in range(1, n_pieces):
            rows, cols = np.nonzero((pieces == piece) & (cells > 0))
            x, y = self.grid.points_at(rows, cols).mean(axis=0).tolist()
            found.append(TruePassage(spaces=(spaces[0], spaces[1]), middle=Point(x, y)))
        return found

    @cached_property
    def _label_of(self) -> dict[str, int]:
        return {room.name: number for number, room in enumerate(self.world.rooms, start=1)}

    @cached_property
    def _labels(self) -> NDArray[np.int32]:
        """The number of the space of each cell, 0 outside all; a later outline yields."""
        labels = np.zeros(self.grid.cells.shape, dtype=np.int32)
        map_from_world = self.world.start.inverse()
        for room in reversed(self.world.rooms):
            corners = [map_from_world.transform(corner) for corner in room.outline]
            points = np.array([(corner.x, corner.y) for corner in corners])
            cells = self.grid.fractional_cells_at(points)[:, ::-1] - 0.5
            fixed = np.round(cells * 64).astype(np.int32)
            cv2.fillPoly(labels, [fixed], self._label_of[room.name], shift=6)
        return labels

    # --- things ---

    def things(self, kind: str) -> tuple[WorldObject, ...]:
        """Return all things of a kind."""
        return tuple(thing for thing in self.world.objects if thing.kind == kind)

    def place_of(self, thing: WorldObject) -> Point:
        """Return where a thing stands, in the map frame."""
        return self.world.start.inverse().transform(thing.pose.point)

    def is_in_sight(self, place: Point, thing: WorldObject) -> bool:
        """Return True when a thing can be seen from a place of the map frame."""
        return bool(self._find_sights(thing, np.array([[place.x, place.y]]))[0])

    def _find_sights(self, thing: WorldObject, places: FloatArray) -> Mask:
        return self._eyes.find_sights(thing, place_points(self.world.start, places))

    @cached_property
    def _eyes(self) -> EyeLevel:
        return EyeLevel(self.world)

    def near(self, point: Point, radius_m: float) -> Mask:
        """Return the cells whose middles lie within a distance of a point."""
        grid = self.grid
        xs = grid.origin.x + (np.arange(grid.n_cols) + 0.5) * grid.resolution_m - point.x
        ys = grid.origin.y + (np.arange(grid.n_rows) + 0.5) * grid.resolution_m - point.y
        return np.asarray(xs[None, :] ** 2 + ys[:, None] ** 2 <= radius_m**2)

    def beside(self, kind: str) -> Mask:
        """Return places near things of a kind from which one of them is in sight; found once."""
        if kind not in self._beside:
            near = [self.seen_around(thing, BESIDE_M) for thing in self.things(kind)]
            nowhere = np.zeros(self.grid.cells.shape, dtype=bool)
            self._beside[kind] = np.logical_or.reduce([nowhere, *near])
        return self._beside[kind]

    def seen_around(self, thing: WorldObject, radius_m: float) -> Mask:
        """Return places near a thing from which it is in sight, one every fifth of a metre."""
        grid, found = self.grid, np.zeros(self.grid.cells.shape, dtype=bool)
        every = max(round(LOOK_EVERY_M / grid.resolution_m), 1)
        coarse = np.zeros_like(found)
        coarse[::every, ::every] = True
        near = self.near(self.place_of(thing), radius_m)
        rows, cols = np.nonzero(coarse & self.drivable & near)
        found[rows, cols] = self._find_sights(thing, grid.points_at(rows, cols))
        return found

    def floor_area_m2(self, room: MeasuredRoom) -> float:
        """Return the floor between a room's walls, with what stands on it."""
        return self._floor_areas_m2[room.room.name]

    @cached_property
    def _floor_areas_m2(self) -> dict[str, float]:
        """The floor between the walls of every space, by its name."""
        walls = TrueFloor(replace(self.world, objects=())).solid
        rows, cols = np.nonzero(self._labels)
        points = self.grid.points_at(rows, cols)
        is_free = ~walls.look_up(walls.occupied, points, outside=True)
        labels = self._labels[rows[is_free], cols[is_free]]
        n_free = np.bincount(labels, minlength=len(self._label_of) + 1) * self.grid.resolution_m**2
        return {name: float(n_free[label]) for name, label in self._label_of.items()}

    def middle_of(self, room: MeasuredRoom) -> Point:
        """Return where in a room the robot has most room."""
        depth = np.where(self.cells_of(room) & self.roomy, clearance_m(self.grid), -1.0)
        row, col = np.unravel_index(int(depth.argmax()), depth.shape)
        return self.grid.point_at(Cell(int(row), int(col)))

    @staticmethod
    def label_of(kind: str) -> str:
        """Return a kind as people call it."""
        return find_kind(kind).label


def _grow(pieces: NDArray[np.uint8], within: Mask) -> NDArray[np.uint8]:
    """Let pieces of floor grow over the floor around them, side by side, until all is taken."""
    while True:
        wider = np.asarray(cv2.dilate(pieces, _PLUS), dtype=np.uint8)
        grown = np.where((pieces == _NOWHERE) & within, wider, pieces)
        if (grown == pieces).all():
            return grown
        pieces = grown
