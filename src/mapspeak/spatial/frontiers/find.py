"""Frontiers of a map: found, judged, ranked."""

import dataclasses
from collections.abc import Sequence

from mapspeak.geometry import Point
from mapspeak.spatial.frontiers.edges import find_borders
from mapspeak.spatial.frontiers.frontier import FrontierReport
from mapspeak.spatial.frontiers.judging import judge
from mapspeak.spatial.frontiers.ranking import rank
from mapspeak.spatial.frontiers.reporting import build_report
from mapspeak.spatial.frontiers.terrain import build_terrain
from mapspeak.spatial.grid import OccupancyGrid
from mapspeak.spatial.paths.distances import DistanceField, distances_from

__all__ = ["find_frontiers", "rerank_frontiers"]


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
    borders = find_borders(grid, least_length_m=radius_m)
    terrain = build_terrain(distances)
    judgement = judge(terrain, borders.kept, looked_from=looked_from)
    ranked, ways = rank(terrain, judgement.frontiers)
    return build_report(
        terrain,
        ranked,
        judgement.refused,
        ways=ways,
        n_specks=borders.n_specks + judgement.n_specks,
    )


def rerank_frontiers(report: FrontierReport, distances: DistanceField) -> FrontierReport | None:
    """Gives the same frontiers as seen from another place on the same map; ids and poses stay.

    Args:
        report: Of the map that the distances belong to.
        distances: From where the robot is now.

    Returns:
        The report in its new order; None where a frontier cannot be reached from there.
    """
    lengths_m = [distances.distance_to(each.pose.point) for each in report.frontiers]
    moved = [
        dataclasses.replace(frontier, distance_m=length_m)
        for frontier, length_m in zip(report.frontiers, lengths_m, strict=True)
        if length_m is not None
    ]
    if len(moved) < len(lengths_m):
        return None
    ranked, ways = rank(build_terrain(distances), moved, report.ways)
    return dataclasses.replace(report, frontiers=tuple(ranked), ways=ways)
