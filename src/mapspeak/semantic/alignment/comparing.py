"""Whether records and robot are on the same map: told from the maps, not from their names."""

import math
from dataclasses import dataclass
from enum import StrEnum

from mapspeak.geometry import Pose
from mapspeak.semantic.alignment.agreement import Agreement, judge
from mapspeak.semantic.alignment.fitting import (
    LEAST_OVERLAP,
    LEAST_SHARED_M,
    Certainty,
    MapFit,
    find_fit,
)
from mapspeak.semantic.alignment.surfaces import MapSurfaces
from mapspeak.spatial import OccupancyGrid

__all__ = ["MapComparison", "MapRelation", "compare_maps"]

NO_MOTION = Pose(0.0, 0.0, 0.0)
STILL_M, STILL_RAD = 0.1, math.radians(1.0)
"""A smaller motion is how maps differ from run to run, and no reason to touch records."""
LEAST_STILL_M, LEAST_STILL_AGREEMENT = 8.0, 0.85
"""So much is enough where maps agree as they lie: no place had to be looked for."""
PERHAPS_AGREEMENT = 0.75
"""Maps that agree less, wherever they are laid, show different places."""


class MapRelation(StrEnum):
    """How the map of the records and the robot's present map go together."""

    SAME = "same"
    MOVED = "moved"
    OTHER = "other_building"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True, kw_only=True)
class MapComparison:
    """What a comparison of two maps gives.

    Attributes:
        relation: How they go together.
        as_it_lies: How well they agree when nothing is moved.
        fit: The best place for the old map, where one had to be looked for.
        sentence: All this in words, with figures.
    """

    relation: MapRelation
    as_it_lies: Agreement
    fit: MapFit | None
    sentence: str


def compare_maps(old: OccupancyGrid, new: OccupancyGrid) -> MapComparison:
    """Tells whether two maps show the same building, and in the same frame."""
    before, after = MapSurfaces(old), MapSurfaces(new)
    as_it_lies = judge(before, after, NO_MOTION)
    if _is_good(as_it_lies):
        said = f"The map is the one that the records belong to: {_figures(as_it_lies)}."
        return MapComparison(
            relation=MapRelation.SAME, as_it_lies=as_it_lies, fit=None, sentence=said
        )
    shortest_m = min(before.length_m, after.length_m)
    if shortest_m < LEAST_SHARED_M:
        said = (
            f"Whether this is the map that the records belong to cannot be told yet: one of the "
            f"two maps shows {shortest_m:.0f} m of walls, and {LEAST_SHARED_M:.0f} m are needed."
        )
        return MapComparison(
            relation=MapRelation.UNKNOWN, as_it_lies=as_it_lies, fit=None, sentence=said
        )
    fit = find_fit(before, after)
    relation = _relation_of(fit)
    said = f"{_OPENINGS[relation]} As they lie, {_figures(as_it_lies)}."
    if fit is not None:
        said += f" {fit.sentence}"
    return MapComparison(relation=relation, as_it_lies=as_it_lies, fit=fit, sentence=said)


_OPENINGS = {
    MapRelation.SAME: "The map is the one that the records belong to, with changes in it.",
    MapRelation.MOVED: "The building is the one that the records belong to, but its map has moved.",
    MapRelation.OTHER: "This map shows another building than the one that the records belong to, "
    "or another part of it.",
    MapRelation.UNKNOWN: "Whether this is the map that the records belong to cannot be told.",
}


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


def _is_good(quality: Agreement) -> bool:
    return (
        quality.agreement_ratio >= LEAST_STILL_AGREEMENT
        and quality.overlap_ratio >= LEAST_OVERLAP
        and quality.shared_m >= LEAST_STILL_M
    )


def _figures(quality: Agreement) -> str:
    return (
        f"{quality.agreement_ratio:.0%} of the walls that both maps show agree "
        f"({quality.shared_m:.0f} m, {quality.overlap_ratio:.0%} of the smaller map)"
    )
