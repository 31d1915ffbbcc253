"""Why a border with the unknown is no place to go, in one clause with numbers."""

from collections.abc import Sequence

from mapspeak.spatial.frontiers.edges import Border, find_middle
from mapspeak.spatial.frontiers.frontier import RefusalReason, RefusedFrontier
from mapspeak.spatial.frontiers.gaps import find_gap_widths_m
from mapspeak.spatial.frontiers.terrain import Terrain
from mapspeak.spatial.grid import Cell

__all__ = ["refuse_cut_off", "refuse_dull", "refuse_looked"]


def refuse_looked(terrain: Terrain, border: Border) -> RefusedFrontier:
    """Refuses a border that the robot has been to."""
    sentence = "looked already, nothing new came into view"
    return _refuse(terrain, border, RefusalReason.LOOKED_ALREADY, sentence)


def refuse_dull(
    terrain: Terrain, border: Border, gain_m2: float, least_m2: float
) -> RefusedFrontier:
    """Refuses a border with next to nothing to see beyond it."""
    sentence = f"{gain_m2:.2f} m2 to see, less than {least_m2:.2f} m2"
    return _refuse(terrain, border, RefusalReason.NOTHING_TO_SEE, sentence)


def refuse_cut_off(terrain: Terrain, borders: Sequence[Border]) -> list[RefusedFrontier]:
    """Refuses borders that no place to look from is near to."""
    refused = []
    for border, width_m in zip(borders, find_gap_widths_m(terrain, borders), strict=True):
        if width_m is None:
            reason, sentence = RefusalReason.NO_WAY, "behind a wall: no way over known floor"
        else:
            reason = RefusalReason.TOO_NARROW
            sentence = f"gap of {width_m:.1f} m, the robot needs {2 * terrain.radius_m:.2f} m"
        refused.append(_refuse(terrain, border, reason, sentence))
    return refused


def _refuse(
    terrain: Terrain, border: Border, reason: RefusalReason, sentence: str
) -> RefusedFrontier:
    middle = find_middle(border.rows, border.cols)
    return RefusedFrontier(
        anchor=terrain.grid.point_at(Cell(int(border.rows[middle]), int(border.cols[middle]))),
        length_m=border.length_m,
        reason=reason,
        sentence=sentence,
    )
