"""Which borders with the unknown are places to go, and why the others are not."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import repeat

import numpy as np

from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.spatial.frontiers.edges import Border
from mapspeak.spatial.frontiers.frontier import Frontier, RefusedFrontier
from mapspeak.spatial.frontiers.gaps import find_parts_beyond
from mapspeak.spatial.frontiers.lookouts import Lookout, find_lookouts
from mapspeak.spatial.frontiers.merging import merge_by_place
from mapspeak.spatial.frontiers.ranking import gain_rate
from mapspeak.spatial.frontiers.refusing import refuse_cut_off, refuse_dull, refuse_looked
from mapspeak.spatial.frontiers.terrain import Terrain
from mapspeak.spatial.frontiers.view import Prospect, find_views

__all__ = ["Judgement", "judge"]

LOOKED_NEAR_M = 0.4
"""A robot that has looked from this near to a pose has looked from there."""
SPECK_M = 0.8
"""A shorter border is narrower than any doorway: where it is no place to go, nobody wonders why."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """What came of some borders.

    Attributes:
        frontiers: Where to go; not yet named.
        refused: Where not to go, and why.
        n_specks: Other borders where not to go, not worth a word.
    """

    frontiers: list[Frontier]
    refused: list[RefusedFrontier]
    n_specks: int


def judge(
    terrain: Terrain, borders: Sequence[Border], *, looked_from: Sequence[Point]
) -> Judgement:
    """Gives each border as a frontier with its best pose, or as refused.

    A short border is a speck, unless there is something to see beyond it.
    """
    frontiers: list[Frontier] = []
    refused: list[RefusedFrontier] = []
    dull: list[tuple[Border, float]] = []
    cut_off: list[Border] = []
    open_ones: list[tuple[Border, list[Lookout]]] = []
    for border, lookouts in zip(borders, find_lookouts(terrain, borders), strict=True):
        new = _without_looked(terrain, lookouts, looked_from)
        if new:
            open_ones.append((border, new))
        elif lookouts:
            refused.append(refuse_looked(terrain, border))
        elif border.length_m >= SPECK_M:
            cut_off.append(border)
    least_m2 = _least_gain_m2(terrain)
    for border, best in _find_best_chances(terrain, open_ones):
        if best.prospect.area_m2 >= least_m2:
            frontiers.append(_frontier(terrain, border, best))
        elif border.length_m >= SPECK_M:
            dull.append((border, best.prospect.area_m2))
    for (border, gain_m2), beyond in zip(
        dull, find_parts_beyond(terrain, [border for border, _ in dull]), strict=True
    ):
        if beyond is None:
            refused.append(refuse_dull(terrain, border, gain_m2, least_m2))
        else:
            cut_off.append(beyond)
    refused += refuse_cut_off(terrain, cut_off)
    n_specks = len(borders) - len(frontiers) - len(refused)
    return Judgement(merge_by_place(frontiers, apart_m=LOOKED_NEAR_M), refused, n_specks)


@dataclass(frozen=True, slots=True)
class _Chance:
    lookout: Lookout
    prospect: Prospect
    distance_m: float
    openness_m: float

    @property
    def rate(self) -> float:
        return gain_rate(self.prospect.area_m2, self.distance_m)


def _without_looked(
    terrain: Terrain, lookouts: list[Lookout], looked_from: Sequence[Point]
) -> list[Lookout]:
    """Gives the places to look from that the robot has not looked from yet."""
    if not looked_from:
        return lookouts
    stands = [(each, terrain.grid.point_at(each.stand)) for each in lookouts]
    return [
        lookout
        for lookout, stand in stands
        if all(stand.distance_to(place) > LOOKED_NEAR_M for place in looked_from)
    ]


def _find_best_chances(
    terrain: Terrain, borders: Sequence[tuple[Border, list[Lookout]]]
) -> list[tuple[Border, _Chance]]:
    """Gives borders with the place from which most comes into view per metre of way to it."""
    lookouts = [each for _, own in borders for each in own]
    stands = [each.stand for each in lookouts]
    views = find_views(terrain.grid, terrain.clearances_m, stands)
    rows = np.array([stand.row for stand in stands], dtype=np.intp)
    cols = np.array([stand.col for stand in stands], dtype=np.intp)
    distances_m = terrain.distances.distances_at(rows, cols).tolist()
    chances = map(_Chance, lookouts, views.find_prospects(), distances_m, repeat(views.openness_m))
    return [
        (border, max((next(chances) for _ in own), key=lambda each: each.rate))
        for border, own in borders
    ]


def _frontier(terrain: Terrain, border: Border, chance: _Chance) -> Frontier:
    grid = terrain.grid
    stand = grid.point_at(chance.lookout.stand)
    return Frontier(
        id="",
        points=grid.points_at(border.rows, border.cols),
        anchor=grid.point_at(chance.lookout.target),
        length_m=border.length_m,
        gain_m2=chance.prospect.area_m2,
        distance_m=chance.distance_m,
        openness_m=chance.openness_m,
        pose=Pose(stand.x, stand.y, _facing(terrain, chance.lookout, chance.prospect)),
        reason="",
    )


def _facing(terrain: Terrain, lookout: Lookout, prospect: Prospect) -> float:
    """Gives the heading towards the unknown; towards the border where it lies all around."""
    grid = terrain.grid
    if prospect.bearing_rad is not None:
        return wrap_angle(prospect.bearing_rad + grid.origin.yaw_rad)
    return grid.point_at(lookout.stand).bearing_to(grid.point_at(lookout.target))


def _least_gain_m2(terrain: Terrain) -> float:
    """Gives the gain that is worth a drive: the less, the smaller the robot and the known floor.

    That is one and a half robots' width squared, a hundredth of the floor, or 0.5 m2.
    """
    floor_m2 = int(np.count_nonzero(terrain.free)) * terrain.grid.resolution_m**2
    return min((3 * terrain.radius_m) ** 2, 0.01 * floor_m2, 0.5)
