"""The three map pictures of the paper: plain, with axes and a metric grid, with the robot's pose.

Grey levels are those of eq. 1, row 0 of the grid is at the bottom, and a point of the world falls
where eq. 3 says, times the whole number of pixels that one cell takes. Where the paper is silent
(a turned origin, a map larger than a model takes in) the picture follows `plan` and `ground`.
"""

import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Pose
from mapspeak.spatial.grid import OccupancyGrid
from mapspeak.spatial.picture import ground, plan
from mapspeak.spatial.picture.drawing import (
    MapLayers,
    MapPicture,
    draw_axes,
    encode,
    finish,
    plan_sheet,
)
from mapspeak.spatial.picture.legend import GroundEntry, Legend
from mapspeak.spatial.picture.marks import GREYS, PALETTE, PAPER
from mapspeak.spatial.picture.view import NORTH_UP_RAD, paper_spacing_m

_GROUNDS = (
    GroundEntry(int(GREYS[1]), "free"),
    GroundEntry(int(GREYS[0]), "unknown"),
    GroundEntry(int(GREYS[-1]), "occupied"),
)


def grey_levels(grid: OccupancyGrid) -> NDArray[np.uint8]:
    """Return one grey pixel per cell, row 0 of the grid at the bottom (paper eq. 1)."""
    grey_of_number = PALETTE[:, 0]
    levels: NDArray[np.uint8] = grey_of_number[GREYS[grid.cells[::-1].astype(np.intp) + 1]]
    return levels


def draw_map_plain(grid: OccupancyGrid, *, max_edge_px: int = 1000) -> MapPicture:
    """Draw the whole map in the paper's grey levels and nothing else."""
    extent = plan.extent_of_map(grid, NORTH_UP_RAD)
    view = plan.plan_view(
        grid, extent, up_rad=NORTH_UP_RAD, margins=plan.Margins(), max_edge_px=max_edge_px
    )
    return MapPicture(png=encode(ground.paint_paper_ground(grid, view)), view=view)


def draw_map_axis(grid: OccupancyGrid, *, max_edge_px: int = 1000) -> MapPicture:
    """Draw the whole map with its axes and the paper's adaptive metric grid (eqs. 2 to 6)."""
    return _draw_with_axes(grid, MapLayers(), max_edge_px)


def draw_robot_pose(grid: OccupancyGrid, robot: Pose, *, max_edge_px: int = 1000) -> MapPicture:
    """Draw the same with the robot as an arrow along its heading (eq. 7)."""
    return _draw_with_axes(grid, MapLayers(robot=robot), max_edge_px)


def _draw_with_axes(grid: OccupancyGrid, layers: MapLayers, max_edge_px: int) -> MapPicture:
    extent = plan.extent_of_map(grid, NORTH_UP_RAD)
    spacing_m = paper_spacing_m(extent.width_m, extent.height_m, grid.resolution_m)
    legend = Legend(spacing_m=spacing_m, grounds=_GROUNDS)
    view = plan_sheet(grid, extent, legend, up_rad=NORTH_UP_RAD, max_edge_px=max_edge_px)
    canvas = np.full((view.height_px, view.width_px), PAPER, dtype=np.uint8)
    inside = view.area_of(canvas)
    inside[:] = ground.paint_paper_ground(grid, view)
    draw_axes(canvas, view, spacing_m)
    return finish(canvas, view, layers, legend=legend, regions=None)
