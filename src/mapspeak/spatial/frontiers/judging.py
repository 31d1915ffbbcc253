"""Judge borders with the unknown: which are frontiers to go to, and why others are refused."""

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.spatial.frontiers.borders import (
    Border,
    find_borders,
    find_gap_widths_m,
    find_middle,
    find_parts_beyond,
)
from mapspeak.spatial.frontiers.frontier import (
    Frontier,
    FrontierReport,
    FrontierVerdict,
    RefusalReason,
    RefusedFrontier,
    estimate_known_ratio,
)
from mapspeak.spatial.frontiers.gaps import NOTHING_TRIED, Tried, mask_behind
from mapspeak.spatial.frontiers.ranking import gain_rate, rank
from mapspeak.spatial.frontiers.viewpoints import (
    FrontierViewpoint,
    find_viewpoints,
    find_views,
    rows_and_cols,
)
from mapspeak.spatial.grid import Cell, OccupancyGrid
from mapspeak.spatial.paths.distances import DistanceField, distances_from

LOOKED_NEAR_M = 0.4
"""A robot this near to a pose counts as having looked from there."""
NOISE_M = 0.8
"""Shorter borders are narrower than any doorway and are not listed when refused."""


def find_frontiers(
    grid: OccupancyGrid,
    position: Point,
    *,
    radius_m: float,
    distances: DistanceField | None = None,
    tried: Tried = NOTHING_TRIED,
) -> FrontierReport:
    """Find goals where the robot can see more, best first, and refused borders with reasons.

    Args:
        distances: From that position on that map, if already known.
        tried: What drives have shown: what remains unknown from a visited pose, or lies behind a
            gap that the robot did not pass, is refused instead of being offered forever.
    """
    if distances is None:
        distances = distances_from(grid, position, radius_m=radius_m)
    borders, n_short = find_borders(grid, least_length_m=radius_m)
    floor_m2 = int(np.count_nonzero(grid.free)) * grid.resolution_m**2
    frontiers, refused = _judge(distances, borders, tried, floor_m2)
    ranked, ways = rank(distances, merge_by_place(frontiers))
    return FrontierReport(
        frontiers=tuple(
            replace(frontier, id=f"F{number}") for number, frontier in enumerate(ranked, start=1)
        ),
        refused=tuple(sorted(refused, key=lambda border: -border.length_m)),
        verdict=_verdict(distances, ranked, has_borders=bool(borders or n_short)),
        n_named=len(ranked),
        floor_m2=floor_m2,
        known_ratio=estimate_known_ratio(floor_m2, [each.gain_m2 for each in ranked]),
        ways=ways,
    )


def rerank_frontiers(report: FrontierReport, distances: DistanceField) -> FrontierReport | None:
    """Return the same frontiers as seen from another place on the same map; ids and poses stay.

    Args:
        report: Of the map that the distances belong to.
        distances: From the robot's present position.

    Returns:
        The report in its new order; None if a frontier cannot be reached from there.
    """
    moved = []
    for frontier in report.frontiers:
        distance_m = distances.distance_to(frontier.pose.point)
        if distance_m is None:
            return None
        moved.append(replace(frontier, distance_m=distance_m))
    ranked, ways = rank(distances, moved, report.ways)
    return replace(report, frontiers=tuple(ranked), ways=ways)


def _verdict(
    distances: DistanceField, frontiers: Sequence[Frontier], *, has_borders: bool
) -> FrontierVerdict:
    if frontiers:
        return FrontierVerdict.SOME_LEFT
    if has_borders:
        is_shut_in = not distances.reachable.any()
        return FrontierVerdict.NONE_REACHABLE if is_shut_in else FrontierVerdict.ALL_REFUSED
    return FrontierVerdict.NONE_LEFT if distances.grid.free.any() else FrontierVerdict.NOTHING_KNOWN


def _judge(
    distances: DistanceField, borders: Sequence[Border], tried: Tried, floor_m2: float
) -> tuple[list[Frontier], list[RefusedFrontier]]:
    """Return each border as a frontier with its best pose, or as refused.

    A short border is neither, unless there is something to see beyond it.
    """
    frontiers: list[Frontier] = []
    refused: list[RefusedFrontier] = []
    poor: list[Border] = []
    cut_off: list[Border] = []
    open_ones: list[tuple[Border, list[FrontierViewpoint]]] = []
    all_viewpoints = find_viewpoints(distances, borders)
    new_ones = _without_tried(distances, all_viewpoints, tried)
    for border, viewpoints, new in zip(borders, all_viewpoints, new_ones, strict=True):
        if isinstance(new, list):
            open_ones.append((border, new))
        elif viewpoints:
            refused.append(_refuse_tried(distances, border, new, viewpoints, tried))
        elif border.length_m >= NOISE_M:
            cut_off.append(border)
    # One and a half robots' width squared, a hundredth of the floor, or 0.5 m2 are worth a drive:
    # the less, the smaller the robot and the known floor.
    least_m2 = min((3 * distances.radius_m) ** 2, 0.01 * floor_m2, 0.5)
    for (border, _), frontier in zip(open_ones, _find_poses(distances, open_ones), strict=True):
        if frontier.gain_m2 >= least_m2:
            frontiers.append(frontier)
        elif border.length_m >= NOISE_M:
            poor.append(border)
    for border, beyond in zip(poor, find_parts_beyond(distances, poor), strict=True):
        if beyond is None:
            poorly = _refuse(distances, border, RefusalReason.NOTHING_TO_SEE)
            refused.append(replace(poorly, least_gain_m2=least_m2))
        else:
            cut_off.append(beyond)
    return frontiers, refused + _refuse_cut_off(distances, cut_off)


def _without_tried(
    distances: DistanceField, viewpoints: Sequence[list[FrontierViewpoint]], tried: Tried
) -> list[list[FrontierViewpoint] | RefusalReason]:
    """Return the viewpoints of each border that no drive has tried; the reason where none is left.

    Behind a gap that the robot did not pass all are tried.
    """
    behind = mask_behind(distances, tried.gaps) if tried.gaps else None
    kept: list[list[FrontierViewpoint] | RefusalReason] = []
    for own in viewpoints:
        before = [
            each for each in own if behind is None or not behind[each.cell.row, each.cell.col]
        ]
        unseen = [each for each in before if not _is_near(distances, each, tried.looked_from)]
        new = [each for each in unseen if not _is_near(distances, each, tried.failed_at)]
        if new:
            kept.append(new)
        elif not before:
            kept.append(RefusalReason.PROVED_NARROW)
        else:
            kept.append(RefusalReason.DRIVE_FAILED if unseen else RefusalReason.LOOKED_ALREADY)
    return kept


def _is_near(
    distances: DistanceField, viewpoint: FrontierViewpoint, places: Sequence[Point]
) -> bool:
    at = distances.grid.point_at(viewpoint.cell)
    return any(at.distance_to(place) <= LOOKED_NEAR_M for place in places)


def _find_poses(
    distances: DistanceField, borders: Sequence[tuple[Border, list[FrontierViewpoint]]]
) -> list[Frontier]:
    """Return borders with the pose at the viewpoint with the largest gain per metre of way."""
    grid = distances.grid
    viewpoints = [viewpoint for _, own in borders for viewpoint in own]
    cells = [viewpoint.cell for viewpoint in viewpoints]
    views = find_views(grid, distances.clearances_m, cells)
    distances_m = distances.distances_at(*rows_and_cols(cells)).tolist()
    options = zip(viewpoints, views.find_gains(), distances_m, strict=True)
    frontiers = []
    for border, own in borders:
        viewpoint, gain, distance_m = max(
            itertools.islice(options, len(own)),
            key=lambda option: gain_rate(option[1].area_m2, option[2]),
        )
        place, target = grid.point_at(viewpoint.cell), grid.point_at(viewpoint.target)
        # Where the unknown lies all around, the robot faces the border.
        yaw_rad = place.bearing_to(target)
        if gain.bearing_rad is not None:
            yaw_rad = wrap_angle(gain.bearing_rad + grid.origin.yaw_rad)
        frontier = Frontier(
            id="",
            points=grid.points_at(border.rows, border.cols),
            anchor=target,
            length_m=border.length_m,
            gain_m2=gain.area_m2,
            distance_m=distance_m,
            openness_m=views.openness_m,
            pose=Pose(place.x, place.y, yaw_rad),
        )
        frontiers.append(frontier)
    return frontiers


def _refuse_tried(
    distances: DistanceField,
    border: Border,
    reason: RefusalReason,
    viewpoints: Sequence[FrontierViewpoint],
    tried: Tried,
) -> RefusedFrontier:
    """Refuse a border for what drives have shown; of the gaps before it the nearest is named."""
    refused = _refuse(distances, border, reason)
    if reason is not RefusalReason.PROVED_NARROW:
        return refused
    rows, cols = rows_and_cols([each.cell for each in viewpoints])
    before = [gap for gap in tried.gaps if mask_behind(distances, [gap])[rows, cols].all()]
    gaps = before or tried.gaps
    gap = min(gaps, key=lambda each: each.point.distance_to(refused.anchor))
    return replace(refused, gap_at=gap.point, gap_width_m=gap.width_m)


def _refuse(distances: DistanceField, border: Border, reason: RefusalReason) -> RefusedFrontier:
    middle = find_middle(border.rows, border.cols)
    anchor = Cell(int(border.rows[middle]), int(border.cols[middle]))
    return RefusedFrontier(
        anchor=distances.grid.point_at(anchor),
        length_m=border.length_m,
        reason=reason,
    )


def _refuse_cut_off(distances: DistanceField, borders: Sequence[Border]) -> list[RefusedFrontier]:
    """Refuse borders without a viewpoint near by."""
    needed_m = 2 * distances.radius_m
    return [
        _refuse(distances, border, RefusalReason.NO_WAY)
        if width_m is None
        else replace(
            _refuse(distances, border, RefusalReason.TOO_NARROW),
            gap_width_m=width_m,
            needed_width_m=needed_m,
        )
        for border, width_m in zip(borders, find_gap_widths_m(distances, borders), strict=True)
    ]


def merge_by_place(frontiers: list[Frontier]) -> list[Frontier]:
    """Return frontiers whose poses are farther from each other than a look is.

    The pose with the largest gain represents all poses near it: their gain, which is the same
    unknown, counts once, and their borders become one.
    """
    waiting = sorted(frontiers, key=lambda frontier: -frontier.gain_m2)
    places = np.array([[frontier.pose.x, frontier.pose.y] for frontier in waiting]).reshape(-1, 2)
    is_waiting = np.ones(len(waiting), dtype=np.bool_)
    merged = []
    for index, frontier in enumerate(waiting):
        if is_waiting[index]:
            gaps_m = np.hypot(*(places - places[index]).T)
            near = np.flatnonzero(is_waiting & (gaps_m <= LOOKED_NEAR_M))
            is_waiting[near] = False
            others = [waiting[other] for other in near if other != index]
            points = np.concatenate([frontier.points, *(other.points for other in others)])
            length_m = frontier.length_m + sum(other.length_m for other in others)
            merged.append(replace(frontier, points=points, length_m=length_m))
    return merged
