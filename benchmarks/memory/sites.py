"""Buildings with things in them: shipped, drawn by a seeded generator, and real maps furnished.

What the memory believes of observers, and when it says `found`, was chosen on `build_sites` and
`build_drawn`. The shipped buildings, `build_worn`, were held out at first, and then looked at four
times between choices, so that they show nothing new. `build_held_out` draws others of the same
styles, of seeds that nothing was chosen on; whoever looks at them and then chooses must draw new
ones.
"""

import dataclasses
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.search import build_worlds
from mapspeak.geometry import Point, Pose
from mapspeak.simulator import (
    BODY_RADIUS_M,
    TrueFloor,
    World,
    WorldObject,
    load_world,
    world_names,
)
from mapspeak.simulator.truth import EYE_BAND_M, OWN_SIZE_M, SIDEWAYS_M
from mapspeak.simulator.worlds.models import ObjectCategory, find_kind
from mapspeak.simulator.worlds.slices import footprint, slice_world
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.paths import clearance_m
from mapspeak.spatial.rooms import RoomMap
from mapspeak.worldmodel.revision import MapRevision
from tools.worldgen import draw_plan, style_names

__all__ = [
    "Site",
    "TrueThing",
    "build_drawn",
    "build_fresh",
    "build_held_out",
    "build_newer",
    "build_sites",
    "build_worn",
]

MAPS = Path(__file__).parents[2] / "tests" / "maps"
REAL_MAPS = (MAPS / "aws_small_house" / "map.yaml", MAPS / "freiburg79" / "whole.yaml")
N_PLACED = 40
HUNG = ("fire_extinguisher", "whiteboard", "first_aid_box", "exit_sign", "sink", "fire_hose_reel")
STANDING = ("cabinet", "printer", "plant", "trash_bin", "fridge", "sofa", "ladder", "crate")
APART_M = 1.2
BODY_HEIGHT_M = 2.0
RADIUS_M = BODY_RADIUS_M + 0.03
USED_FOR_CHOOSING = ("office", "warehouse")
DRAWN_SEEDS = (101, 102, 103, 104)
"""Two small and two large buildings of each style; none of them is shipped."""
HELD_OUT_SEEDS = (301, 302)
"""A small and a large one of each style. Measured once, when the rule of `found` was chosen."""
FRESH_SEEDS = (401, 402)
"""Likewise. Measured once, when it was settled what a laser says but that one beam past a corner
says nothing."""
NEWER_SEEDS = (501, 502)
"""Likewise. Measured once, with that."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrueThing:
    """A thing as it truly is, in the map frame.

    Attributes:
        seen: As the simulator knows it.
        label: What people call it.
        is_safety: By the filtering policy.
        pose: Where it is.
    """

    seen: WorldObject
    label: str
    is_safety: bool
    pose: Pose

    @property
    def point(self) -> Point:
        """Where it is: of what hangs on a wall its back, else its middle."""
        return self.pose.point

    def distance_to(self, place: Point) -> float:
        """Return the metres from a place to the thing's body."""
        outlines = footprint(self.seen.kind, 0.0, BODY_HEIGHT_M)
        inside = self.pose.inverse().transform(place)
        offs = [
            -cv2.pointPolygonTest(
                np.array([(p.x, p.y) for p in outline], dtype=np.float32),
                (inside.x, inside.y),
                measureDist=True,
            )
            for outline in outlines
        ]
        return max(min(offs, default=self.point.distance_to(place)), 0.0)


class Site:
    """A building, its map, and what is true of it.

    Args:
        world: The building.
        is_bare: The map has its walls alone, as one that was drawn before anybody moved in.
    """

    def __init__(self, world: World, *, is_bare: bool = False) -> None:
        self.world = world
        self.name = world.name
        floor = TrueFloor(world)
        mapped = TrueFloor(dataclasses.replace(world, objects=())) if is_bare else floor
        self.grid: OccupancyGrid = mapped.visible
        self._floor = floor.solid
        self._standable = floor.standable & (clearance_m(floor.solid) >= BODY_RADIUS_M + 0.1)
        map_from_world = world.start.inverse()
        self.things = tuple(
            TrueThing(
                seen=thing,
                label=find_kind(thing.kind).label,
                is_safety=find_kind(thing.kind).category is ObjectCategory.SAFETY,
                pose=map_from_world @ thing.pose,
            )
            for thing in world.objects
        )

    @cached_property
    def places(self) -> NDArray[np.float64]:
        """Where an observer can stand, shape (n, 2)."""
        return self._floor.points_at(*np.nonzero(self._standable))

    @cached_property
    def revision(self) -> MapRevision:
        """The map as the robot keeps it."""
        return MapRevision(self.grid, radius_m=RADIUS_M)

    @property
    def rooms(self) -> RoomMap:
        """The rooms that are found on the map."""
        return self.revision.rooms

    def room_of(self, thing: TrueThing) -> str | None:
        """Return the room a thing faces."""
        for off_m in (0.3, 0.6, 0.9, 0.0):
            region = self.rooms.find_region_at(thing.pose.transform(Point(off_m, 0.0)))
            if region is not None:
                return region.id
        return None

    def sees(self, place: Point, thing: TrueThing) -> bool:
        """Return True when a thing can be seen from a place of the map, as `is_in_sight` says."""
        start = self.world.start.transform(place)
        across = Pose(thing.seen.pose.x, thing.seen.pose.y, start.bearing_to(thing.seen.pose.point))
        return any(
            _free_m(self._edges, start, part) >= start.distance_to(part) - OWN_SIZE_M
            for part in (across.transform(Point(0.0, sideways_m)) for sideways_m in SIDEWAYS_M)
        )

    @cached_property
    def _edges(self) -> NDArray[np.float64]:
        return slice_world(self.world, low_m=EYE_BAND_M[0], high_m=EYE_BAND_M[1]).edges


def _free_m(edges: NDArray[np.float64], start: Point, end: Point) -> float:
    """Return the metres to the first edge on the way to a point and beyond it."""
    far_m = start.distance_to(end)
    way = np.array([end.x - start.x, end.y - start.y]) / far_m
    first = edges[:, :2] - (start.x, start.y)
    along = edges[:, 2:] - edges[:, :2]
    crossed = way[0] * along[:, 1] - way[1] * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        ray = (first[:, 0] * along[:, 1] - first[:, 1] * along[:, 0]) / crossed
        edge = (first[:, 0] * way[1] - first[:, 1] * way[0]) / crossed
    is_hit = (ray >= 0) & (edge >= 0) & (edge <= 1)
    return float(ray[is_hit].min(initial=np.inf))


def build_held_out() -> Iterator[Site]:
    """Return drawn buildings that nothing was chosen on."""
    return _draw(HELD_OUT_SEEDS)


def build_fresh(*, is_bare: bool = False) -> Iterator[Site]:
    """Return drawn buildings that nothing was chosen on, nor measured but once."""
    return _draw(FRESH_SEEDS, is_bare=is_bare)


def build_newer(*, is_bare: bool = False) -> Iterator[Site]:
    """Return drawn buildings that nothing was chosen on, nor measured but once and later."""
    return _draw(NEWER_SEEDS, is_bare=is_bare)


def build_worn() -> Iterator[Site]:
    """Return the shipped buildings that were held out until they had been looked at too often."""
    for name in world_names():
        if name not in USED_FOR_CHOOSING:
            yield Site(load_world(name))


def build_drawn(*, is_bare: bool = False) -> Iterator[Site]:
    """Return buildings in the styles of those held out, for choosing."""
    return _draw(DRAWN_SEEDS, is_bare=is_bare)


def _draw(seeds: Sequence[int], *, is_bare: bool = False) -> Iterator[Site]:
    with TemporaryDirectory() as folder:
        for style in style_names():
            for seed in seeds:
                path = Path(folder) / f"{style}_{seed}.yaml"
                path.write_text(draw_plan(style, seed=seed), encoding="utf-8")
                yield Site(load_world(path), is_bare=is_bare)


def build_sites() -> Iterator[Site]:
    """Return the buildings that were at hand when the memory was made."""
    with TemporaryDirectory() as folder:
        for world in build_worlds(Path(folder)):
            yield Site(world)
    for number, path in enumerate(REAL_MAPS):
        yield Site(furnish(load_world(path), np.random.default_rng(500 + number)))


def furnish(world: World, random: np.random.Generator) -> World:
    """Return a building of a map with things along its walls."""
    floor = TrueFloor(world)
    clear_m = clearance_m(floor.solid)
    beside = floor.standable & (clear_m <= BODY_RADIUS_M + 0.1)
    spots = floor.solid.points_at(*np.nonzero(beside))
    down, across = np.gradient(cv2.GaussianBlur(clear_m, (9, 9), 0))
    slopes = np.stack([across[beside], down[beside]], axis=1)
    placed: list[WorldObject] = []
    for i in random.permutation(len(spots)).tolist():
        spot, yaw_rad = Point(*spots[i].tolist()), math.atan2(slopes[i, 1], slopes[i, 0])
        kinds = HUNG if random.random() < 0.5 else STANDING
        kind = kinds[int(random.integers(len(kinds)))]
        back_m = float(clear_m[beside][i]) if kind in HUNG else 0.0
        at = Pose(spot.x, spot.y, yaw_rad) @ Pose(-back_m, 0.0)
        if kind in HUNG and not _is_on_wall(floor, at):
            continue
        pose = world.start @ at
        near = [pose.point, world.start.point]
        if all(thing.pose.point.distance_to(near[0]) >= APART_M for thing in placed) and (
            near[0].distance_to(near[1]) >= APART_M
        ):
            placed.append(WorldObject(name=f"{kind} {len(placed)}", kind=kind, pose=pose))
        if len(placed) == N_PLACED:
            break
    return dataclasses.replace(world, objects=tuple(placed))


def _is_on_wall(floor: TrueFloor, at: Pose) -> bool:
    """Return True where a wall begins, and floor lies before it."""
    behind, before = (floor.solid.cell_at(at.transform(Point(x, 0.0))) for x in (-0.06, 0.15))
    return bool(
        floor.solid.occupied[behind.row, behind.col] and floor.solid.free[before.row, before.col]
    )
