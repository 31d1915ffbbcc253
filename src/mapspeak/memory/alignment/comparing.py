"""Compare two maps: one building or two, in one frame or two."""

import math
from dataclasses import dataclass
from enum import StrEnum

from mapspeak.geometry import Pose
from mapspeak.memory.alignment.fitting import (
    LEAST_OVERLAP,
    LEAST_SHARED_M,
    Certainty,
    MapFit,
    find_fit,
)
from mapspeak.memory.alignment.surfaces import MapAgreement, MapSurfaces, judge
from mapspeak.spatial import OccupancyGrid

NO_MOTION = Pose(0.0, 0.0, 0.0)
STILL_M, STILL_RAD = 0.1, math.radians(1.0)
"""Maps differ by smaller motions from run to run; records stay as they are."""
LEAST_STILL_M, LEAST_STILL_AGREEMENT = 8.0, 0.85
"""Thresholds for maps that agree unmoved; lower, as no placing was searched for."""
PERHAPS_AGREEMENT = 0.75
"""Maps whose best agreement is lower show different places."""


class MapRelation(StrEnum):
    """Relation between the map of the records and the robot's present map."""

    SAME = "same"
    MOVED = "moved"
    OTHER = "other_building"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True, kw_only=True)
class MapComparison:
    """Result of comparing two maps.

    Attributes:
        as_it_lies: Agreement without moving either map.
        fit: The best placing of the old map, if one was searched for.
        shortest_m: Wall length of the map that shows less wall.
    """

    relation: MapRelation
    as_it_lies: MapAgreement
    fit: MapFit | None
    shortest_m: float


def compare_maps(old: OccupancyGrid, new: OccupancyGrid) -> MapComparison:
    """Compare two maps: whether they show the same building, and in the same frame."""
    before, after = MapSurfaces(old), MapSurfaces(new)
    as_it_lies = judge(before, after, NO_MOTION)
    fit, relation = None, MapRelation.SAME
    shortest_m = min(before.length_m, after.length_m)
    is_good = (
        as_it_lies.agreement_ratio >= LEAST_STILL_AGREEMENT
        and as_it_lies.overlap_ratio >= LEAST_OVERLAP
        and as_it_lies.shared_m >= LEAST_STILL_M
    )
    if not is_good:
        relation = MapRelation.UNKNOWN
        if shortest_m >= LEAST_SHARED_M:
            fit = find_fit(before, after)
            relation = _relation_of(fit)
    return MapComparison(relation=relation, as_it_lies=as_it_lies, fit=fit, shortest_m=shortest_m)


def _relation_of(fit: MapFit | None) -> MapRelation:
    if fit is None:
        return MapRelation.OTHER
    if fit.is_sure_enough:
        is_still = fit.off_m < STILL_M and abs(fit.new_from_old.yaw_rad) < STILL_RAD
        return MapRelation.SAME if is_still else MapRelation.MOVED
    is_possible = fit.certainty is Certainty.AMBIGUOUS or (
        fit.quality.agreement_ratio >= PERHAPS_AGREEMENT
        and fit.quality.overlap_ratio >= LEAST_OVERLAP
    )
    return MapRelation.UNKNOWN if is_possible else MapRelation.OTHER
