"""Buildings drawn as text, and what becomes of their maps when a robot starts anew."""

import numpy as np

from drawing import grid_from_text
from mapspeak.geometry import Pose
from mapspeak.memory.alignment.surfaces import placed
from mapspeak.spatial import OccupancyGrid

HOUSE = grid_from_text(
    """
    ##############################################
    #..........#.................#...............#
    #..........#.................#...............#
    #..........#.................#...............#
    #..........#.................#...............#
    #..........#.................#...............#
    #..........#.................#...............#
    #..........#.................#...............#
    ####..##########..########################..##
    #............................................#
    #............................................#
    #............................................#
    ##..###################..#########..##########
         #.............#..........#..............#
         #.............#..........#..............#
         #.............#..........#..............#
         #.............#..........#..............#
         #.............#..........##########.....#
         ###############..........#       #......#
                       ############       ########
    """,
    resolution_m=0.5,
)
"""23 x 10 m without any symmetry."""

OTHER_HOUSE = grid_from_text(
    """
    ########################
    #......................#
    #......................#
    #......................#
    #......................#
    #......................#
    #......................#
    #......................#
    #......................#
    ##########..#####..#####
    #...............#......#
    #...............#......#
    #...............#......#
    #...............########
    #...............#......#
    #...............#......#
    #......................#
    #...............#......#
    ########################
    """,
    resolution_m=0.5,
)

TWIN_HOUSES = grid_from_text(
    """
    #############################################
    #...........#.............................#.#
    #...........#............................#..#
    #...........#...............................#
    ######..##########..##########..#########..##
    #...........................................#
    #...........................................#
    ##..#########..##########..##########..######
    #...............................#...........#
    #..#............................#...........#
    #.#.............................#...........#
    #############################################
    """,
    resolution_m=0.5,
)
"""It looks the same when it is turned by half a circle."""


def fine(grid: OccupancyGrid) -> OccupancyGrid:
    """Gives a drawn map with cells of a tenth of a metre, its walls one or two cells thick."""
    n = round(grid.resolution_m / 0.1)
    cells = grid.cells.repeat(n, axis=0).repeat(n, axis=1).copy()
    return OccupancyGrid(cells=cells, resolution_m=0.1, origin=grid.origin)


def moved(grid: OccupancyGrid, motion: Pose, *, resolution_m: float = 0.1) -> OccupancyGrid:
    """Draws a map anew in a moved frame."""
    low, high = grid.bounds()
    corners = np.array([[x, y] for x in (low.x, high.x) for y in (low.y, high.y)])
    ends = placed(corners, motion)
    first = ends.min(axis=0) - 0.33 * resolution_m
    n_cols, n_rows = (np.ceil((ends.max(axis=0) - first) / resolution_m) + 1).astype(int).tolist()
    blank = OccupancyGrid(
        cells=np.full((n_rows, n_cols), -1, dtype=np.int8),
        resolution_m=resolution_m,
        origin=Pose(*first.tolist()),
    )
    rows, cols = np.indices(blank.cells.shape).reshape(2, -1)
    at = grid.cells_at(placed(blank.points_at(rows, cols), motion.inverse()))
    inside = (at[0] >= 0) & (at[0] < grid.n_rows) & (at[1] >= 0) & (at[1] < grid.n_cols)
    cells = np.full(blank.cells.size, -1, dtype=np.int8)
    cells[inside] = grid.cells[at[0][inside], at[1][inside]]
    return OccupancyGrid(
        cells=cells.reshape(n_rows, n_cols), resolution_m=resolution_m, origin=blank.origin
    )
