"""The ground of a picture: what each pixel of the map area shows of the grid.

A pixel that covers several cells shows the highest value among them, so that a wall one cell thick
stays a wall at any scale. Where the grid's axes are those of the picture, cells become whole
blocks of pixels; a turned grid is read at points so dense that none of its cells is missed.
"""

import math
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import MapError
from mapspeak.spatial.grid import FREE_MAX, UNKNOWN, IntArray, Mask, OccupancyGrid
from mapspeak.spatial.picture.marks import Region, RegionLayer
from mapspeak.spatial.picture.palette import (
    FILLS,
    FREE,
    GREYS,
    RAMPS,
    UNKNOWN_GROUND,
    WALL,
    Canvas,
    Colour,
    FillPart,
)
from mapspeak.spatial.picture.view import View

__all__ = [
    "check_layer",
    "is_aligned",
    "paint_ground",
    "paint_paper_ground",
    "paint_regions",
    "sample",
]

Number = TypeVar("Number", np.int8, np.uint16)

_ANGLE_SLACK_RAD = 1e-9
_MAX_SAMPLE_STEP_CELLS = 0.7
"""A lattice this fine has a point in every cell, however it is turned (below 1/sqrt 2)."""

_OUTLINE_PX = 2
_HATCH_STEP_PX = 9
_DOT_STEP_PX = 10
_DOT_PX = 2
_HIGHLIGHT_PX = 5
_HIGHLIGHT = int(RAMPS[Colour.VERMILION][-1])


def is_aligned(grid: OccupancyGrid, up_rad: float) -> bool:
    """True when the grid's own axes point right and up in a picture with that direction up."""
    return abs(_turn_in_view(grid, up_rad)) < _ANGLE_SLACK_RAD


def sample(values: NDArray[Number], grid: OccupancyGrid, view: View) -> NDArray[Number]:
    """Gives, for each pixel of the map area, the highest value of the cells it covers.

    Pixels outside the grid get -1 (signed values) or 0 (unsigned ones).
    """
    if is_aligned(grid, view.up_rad):
        return _sample_aligned(values, grid, view)
    return _sample_turned(values, grid, view)


def paint_ground(grid: OccupancyGrid, view: View) -> Canvas:
    """Gives the map area in palette numbers: unknown, free, wall."""
    seen = sample(grid.cells, grid, view)
    ground = np.full(seen.shape, UNKNOWN_GROUND, dtype=np.uint8)
    ground[seen >= 0] = FREE
    ground[seen > FREE_MAX] = WALL
    return ground


def paint_paper_ground(grid: OccupancyGrid, view: View) -> Canvas:
    """Gives the map area in palette numbers of the paper's grey levels (eq. 1)."""
    seen = sample(grid.cells, grid, view)
    painted: Canvas = GREYS[seen.astype(np.intp) - UNKNOWN]
    return painted


def paint_regions(
    ground: Canvas,
    labels: NDArray[np.uint16],
    regions: tuple[Region, ...],
    colours: dict[int, Colour],
) -> None:
    """Fills the free pixels of each region, with its pattern and outline, on the ground given.

    Args:
        ground: Palette numbers of the map area; changed in place.
        labels: The region of each pixel, from `sample`.
        regions: What is to be seen of them.
        colours: Of each region's label.
    """
    fill = np.take(_fill_by_label(regions, colours, FillPart.PLAIN), labels)
    is_filled = (ground == FREE) & (fill > 0)
    np.copyto(ground, fill, where=is_filled)
    for places, wanted in (
        (_hatch_pixels, tuple(region for region in regions if region.is_hatched)),
        (_dot_pixels, tuple(region for region in regions if region.is_dotted)),
    ):
        if wanted:
            hatch = _fill_by_label(wanted, colours, FillPart.HATCH)
            _paint_pattern(ground, labels, is_filled, places(ground.shape), hatch)
    edge = _is_edge(labels) & is_filled
    ground[edge] = _fill_by_label(regions, colours, FillPart.OUTLINE)[labels[edge]]
    for region in regions:
        if region.is_highlighted:
            _highlight(ground, labels == region.label)


def check_layer(layer: RegionLayer, grid: OccupancyGrid) -> None:
    """Raises `MapError` where a layer of regions was made for another grid."""
    if layer.labels.shape != grid.cells.shape:
        raise MapError(
            f"The regions cover {layer.labels.shape} cells, the map has {grid.cells.shape}.",
            hint="Find the regions of this map again.",
        )


def _turn_in_view(grid: OccupancyGrid, up_rad: float) -> float:
    """Gives the angle of the grid's x axis in the picture, counter-clockwise from its right."""
    return math.remainder(grid.origin.yaw_rad - up_rad + math.pi / 2, math.tau)


def _sample_aligned(values: NDArray[Number], grid: OccupancyGrid, view: View) -> NDArray[Number]:
    cells_per_pixel = 1.0 / (view.pixels_per_m * grid.resolution_m)
    corner = grid.fractional_cells_at(np.array([[view.corner.x, view.corner.y]]))[0]
    top = round(corner[0]) - 1
    down = _spans(_first_cells(view.area.height + 1, cells_per_pixel))
    right = _spans(_first_cells(view.area.width + 1, cells_per_pixel))
    rows = (top - down[1], top - down[0])
    cols = (round(corner[1]) + right[0], round(corner[1]) + right[1])
    if cells_per_pixel < 1:
        # Cells become larger: taken from few rows, repeated last.
        first = min(max(0, int(rows[0].min())), grid.n_rows - 1)
        window = values[first : max(first, int(rows[1].max())) + 1]
        wide = _pool(window, *cols, axis=1)
        return _pool(wide, rows[0] - first, rows[1] - first, axis=0)
    return _pool(_pool(values, *rows, axis=0), *cols, axis=1)


def _first_cells(n_pixels: int, cells_per_pixel: float) -> IntArray:
    """Gives the first cell of each pixel in a row; a cell belongs to the pixel its middle is in."""
    pixels = np.arange(n_pixels)
    if cells_per_pixel < 1:
        earlier: IntArray = np.floor(pixels * cells_per_pixel + 1e-6).astype(np.intp)
        return earlier
    first: IntArray = np.ceil(pixels * cells_per_pixel - 0.5 - 1e-9).astype(np.intp)
    return first


def _spans(starts: IntArray) -> tuple[IntArray, IntArray]:
    """Gives the first and the last cell from each start to before the next; one at the least."""
    return starts[:-1], np.maximum(starts[1:] - 1, starts[:-1])


def _pool(
    values: NDArray[Number], firsts: IntArray, lasts: IntArray, *, axis: int
) -> NDArray[Number]:
    """Gives the highest value from each first to its last place along an axis."""
    n_cells = values.shape[axis]
    pooled = np.take(values, np.clip(firsts, 0, n_cells - 1), axis=axis)
    for offset in range(1, int((lasts - firsts).max(initial=0)) + 1):
        index = np.clip(np.minimum(firsts + offset, lasts), 0, n_cells - 1)
        np.maximum(pooled, np.take(values, index, axis=axis), out=pooled)
    is_outside = (lasts < 0) | (firsts >= n_cells)
    np.moveaxis(pooled, axis, 0)[is_outside] = _outside_value(values)
    return pooled


def _outside_value(values: NDArray[Number]) -> int:
    return UNKNOWN if np.issubdtype(values.dtype, np.signedinteger) else 0


def _sample_turned(values: NDArray[Number], grid: OccupancyGrid, view: View) -> NDArray[Number]:
    """Reads a turned grid: made as coarse as the pixels, read densely, then pooled."""
    cells_per_pixel = 1.0 / (view.pixels_per_m * grid.resolution_m)
    n_pooled = max(1, math.floor(cells_per_pixel))
    n_fine = math.ceil(cells_per_pixel / n_pooled / _MAX_SAMPLE_STEP_CELLS)
    top_left, bottom_right = _cells_in_view(grid, view)
    window = values[top_left[0] : bottom_right[0], top_left[1] : bottom_right[1]]
    if window.size == 0:
        shape = (view.area.height, view.area.width)
        return np.full(shape, _outside_value(values), dtype=values.dtype)
    fine = cv2.warpAffine(
        _coarsen(window, n_pooled),
        _coarse_from_fine(grid, view, n_fine=n_fine, n_pooled=n_pooled, first=top_left),
        (view.area.width * n_fine, view.area.height * n_fine),
        flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(_outside_value(values),),
    )
    return _coarsen(fine.astype(values.dtype, copy=False), n_fine)


def _cells_in_view(grid: OccupancyGrid, view: View) -> tuple[IntArray, IntArray]:
    """Gives the first (row, col) that the view can show, and the first past the last."""
    corners = grid.fractional_cells_at(view.area_corners())
    shape = np.array(grid.cells.shape)
    first = np.clip(np.floor(corners.min(axis=0)).astype(np.intp), 0, shape)
    last = np.clip(np.ceil(corners.max(axis=0)).astype(np.intp), 0, shape)
    return first, last


def _coarsen(values: NDArray[Number], n_pooled: int) -> NDArray[Number]:
    """Gives the highest value of each block of n x n; blocks at the far sides may be smaller."""
    for axis in (0, 1):
        n_blocks = -(-values.shape[axis] // n_pooled)
        values = _pool(values, *_spans(np.arange(n_blocks + 1) * n_pooled), axis=axis)
    return values


def _coarse_from_fine(
    grid: OccupancyGrid, view: View, *, n_fine: int, n_pooled: int, first: IntArray
) -> NDArray[np.float64]:
    """Gives the affine map from a point of the fine lattice to a coarse cell, both (x, y).

    Args:
        grid: The turned grid.
        view: The picture.
        n_fine: Lattice points per pixel along each axis.
        n_pooled: Cells per coarse cell along each axis.
        first: The (row, col) at which the coarse cells begin.
    """
    lattice = np.array([[0.5, 0.5], [1.5, 0.5], [0.5, 1.5]]) / n_fine
    pixels = lattice + np.array([view.area.left, view.area.top])
    rows_cols = (grid.fractional_cells_at(view.points_at(pixels)) - first) / n_pooled - 0.5
    x_y = rows_cols[:, ::-1]
    return np.stack([x_y[1] - x_y[0], x_y[2] - x_y[0], x_y[0]], axis=1)


def _fill_by_label(
    regions: tuple[Region, ...], colours: dict[int, Colour], part: FillPart
) -> Canvas:
    """Gives the palette number of each label's fill; 0 for labels without a region."""
    fills = np.zeros(np.iinfo(np.uint16).max + 1, dtype=np.uint8)
    for region in regions:
        fills[region.label] = FILLS[colours[region.label], part]
    return fills


def _paint_pattern(
    ground: Canvas,
    labels: NDArray[np.uint16],
    is_filled: Mask,
    places: tuple[IntArray, IntArray],
    fills: Canvas,
) -> None:
    """Paints those of the rows and columns given that lie in a filled region with a pattern."""
    row, col = places
    numbers = fills[labels[row, col]]
    is_painted = is_filled[row, col] & (numbers > 0)
    ground[row[is_painted], col[is_painted]] = numbers[is_painted]


def _hatch_pixels(shape: tuple[int, ...]) -> tuple[IntArray, IntArray]:
    """Gives rows and columns on diagonal lines."""
    row = np.arange(shape[0])[:, np.newaxis]
    col = -row % _HATCH_STEP_PX + np.arange(0, shape[1], _HATCH_STEP_PX)
    return np.broadcast_to(row, col.shape)[col < shape[1]], col[col < shape[1]]


def _dot_pixels(shape: tuple[int, ...]) -> tuple[IntArray, IntArray]:
    """Gives rows and columns of small square dots."""
    row, col = (np.flatnonzero(np.arange(length) % _DOT_STEP_PX < _DOT_PX) for length in shape)
    return np.repeat(row, col.size), np.tile(col, row.size)


def _highlight(ground: Canvas, is_region: Mask) -> None:
    """Draws a bold line inside a region along its outer border, beside its walls.

    Where the picture cuts the region off there is no border.
    """
    rim_px = 2 * _HIGHLIGHT_PX
    mask = np.pad(is_region.astype(np.uint8), rim_px, mode="edge")
    borders, _ = cv2.findContours(
        mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE, offset=(-rim_px, -rim_px)
    )
    bold = np.zeros(ground.shape, dtype=np.uint8)
    cv2.drawContours(bold, borders, -1, (1,), 2 * _HIGHLIGHT_PX - 1)
    ground[(bold > 0) & is_region & (ground != WALL)] = _HIGHLIGHT


def _is_edge(labels: NDArray[np.uint16]) -> Mask:
    """Gives True where another label, or none, is at most the outline's width away."""
    kernel = np.ones((2 * _OUTLINE_PX + 1, 2 * _OUTLINE_PX + 1), dtype=np.uint8)
    is_edge: Mask = cv2.dilate(labels, kernel) != cv2.erode(labels, kernel)
    return is_edge
