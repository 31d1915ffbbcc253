"""Frontiers of a map: found, checked, ranked."""

from collections.abc import Sequence

import numpy as np

from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.spatial.frontiers.approach import Approach, build_approach
from mapspeak.spatial.frontiers.edges import Border, find_borders
from mapspeak.spatial.frontiers.frontier import (
    Frontier,
    FrontierReport,
    RefusalReason,
    RefusedFrontier,
)
from mapspeak.spatial.frontiers.judging import (
    Lookout,
    find_lookouts,
    refuse,
)
from mapspeak.spatial.frontiers.ranking import gain_rate, rank
from mapspeak.spatial.frontiers.reporting import build_report
from mapspeak.spatial.frontiers.view import Prospect, find_prospect
from mapspeak.spatial.grid import OccupancyGrid
from mapspeak.spatial.paths.distances import DistanceField, distances_from

__all__ = ["find_frontiers"]

LOOKED_NEAR_M = 0.4
"""A robot that has looked from this near to a pose has looked from there."""


def find_frontiers(
    grid: OccupancyGrid,
    position: Point,
    *,
    radius_m: float,
    distances: DistanceField | None = None,
    looked_from: Sequence[Point] = (),
) -> FrontierReport:
    """Finds where the robot can go to see more, best first, and says what it refuses and why.

    Args:
        grid: The map.
        position: Where the robot is.
        radius_m: Of the robot.
        distances: From that position on that map, where they are known already.
        looked_from: Poses of frontiers that the robot has been to: what is still unknown from
            there cannot be seen, and is refused instead of being offered for ever.
    """
    if distances is None:
        distances = distances_from(grid, position, radius_m=radius_m)
    approach = build_approach(distances)
    judged = [
        _judge(distances, approach, border, looked_from=looked_from)
        for border in find_borders(grid)
    ]
    frontiers = [each for each in judged if isinstance(each, Frontier)]
    refused = [each for each in judged if isinstance(each, RefusedFrontier)]
    return build_report(grid, rank(distances, frontiers), refused)


def _judge(
    distances: DistanceField, approach: Approach, border: Border, *, looked_from: Sequence[Point]
) -> Frontier | RefusedFrontier:
    """Gives the border with the best place to look beyond it, or says why there is none."""
    grid = distances.lattice.grid
    lookouts = find_lookouts(approach, border)
    if isinstance(lookouts, RefusedFrontier):
        return lookouts
    new = [each for each in lookouts if not _is_near(grid.point_at(each.stand), looked_from)]
    if not new:
        sentence = "looked already: the robot has been there, and it stayed out of sight"
        return refuse(grid, border, RefusalReason.LOOKED_ALREADY, sentence)
    weighed = [_weigh(distances, border, each) for each in new]
    best = max(weighed, key=lambda each: gain_rate(each.gain_m2, each.distance_m))
    least_m2 = _least_gain_m2(grid, distances.radius_m)
    if best.gain_m2 >= least_m2:
        return best
    sentence = f"next to nothing to see: {best.gain_m2:.1f} m2, less than {least_m2:.1f} m2"
    return refuse(grid, border, RefusalReason.NOTHING_TO_SEE, sentence)


def _is_near(point: Point, places: Sequence[Point]) -> bool:
    return any(point.distance_to(place) <= LOOKED_NEAR_M for place in places)


def _weigh(distances: DistanceField, border: Border, lookout: Lookout) -> Frontier:
    """Gives the border as a frontier with this place to look beyond it; not yet named."""
    grid = distances.lattice.grid
    prospect = find_prospect(grid, lookout.stand)
    stand = grid.point_at(lookout.stand)
    cells = np.array([lookout.stand.row]), np.array([lookout.stand.col])
    return Frontier(
        id="",
        points=grid.points_at(border.rows, border.cols),
        anchor=grid.point_at(lookout.target),
        length_m=border.length_m,
        gain_m2=prospect.area_m2,
        distance_m=float(distances.distances_at(*cells)[0]),
        pose=Pose(stand.x, stand.y, _facing(grid, lookout, prospect)),
        reason="",
    )


def _least_gain_m2(grid: OccupancyGrid, radius_m: float) -> float:
    """Gives the unknown that is worth a drive: the less, the smaller the robot and the known floor.

    That is a square of two robots' width, a hundredth of the floor, or 1 m2.
    """
    floor_m2 = int(np.count_nonzero(grid.free)) * grid.resolution_m**2
    return min((4 * radius_m) ** 2, 0.01 * floor_m2, 1.0)


def _facing(grid: OccupancyGrid, lookout: Lookout, prospect: Prospect) -> float:
    """Gives the heading towards the unknown; towards the border where it lies all around."""
    if prospect.bearing_rad is not None:
        return wrap_angle(prospect.bearing_rad + grid.origin.yaw_rad)
    return grid.point_at(lookout.stand).bearing_to(grid.point_at(lookout.target))
