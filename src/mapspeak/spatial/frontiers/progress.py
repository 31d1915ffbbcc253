"""How much of what a frontier promised is still to be seen, on a later map."""

from mapspeak.spatial.frontiers.frontier import Frontier
from mapspeak.spatial.frontiers.view import find_area_m2
from mapspeak.spatial.grid import OccupancyGrid

__all__ = ["remaining_ratio"]


def remaining_ratio(grid: OccupancyGrid, frontier: Frontier) -> float:
    """Gives the share of a frontier's gain that its pose still promises.

    A robot under way to a frontier can turn to the next one when this falls: it has seen from afar
    what it was sent to see. The map may have grown and moved its origin since.
    """
    place = grid.cell_at(frontier.pose.point)
    return find_area_m2(grid, place, openness_m=frontier.openness_m) / frontier.gain_m2
