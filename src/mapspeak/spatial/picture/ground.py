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
    UNKNOWN_GROUND,
    WALL,
    Canvas,
    Colour,
    FillPart,
)
from mapspeak.spatial.picture.view import View

__all__ = [
    "check_layer",
    "colour_regions",
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
_NEIGHBOUR_PX = 12
_AUTOMATIC_COLOURS = (
    Colour.SKY,
    Colour.ORANGE,
    Colour.GREEN,
    Colour.PURPLE,
    Colour.YELLOW,
    Colour.VERMILION,
)


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


def paint_regions(ground: Canvas, labels: NDArray[np.uint16], regions: tuple[Region, ...]) -> None:
    """Fills the free pixels of each region, hatches and outlines it, on the ground given.

    Args:
        ground: Palette numbers of the map area; changed in place.
        labels: The region of each pixel, from `sample`.
        regions: With their colours chosen, see `colour_regions`.
    """
    is_free = ground == FREE
    fill = np.take(_fill_by_label(regions, FillPart.PLAIN), labels)
    is_filled = is_free & (fill > 0)
    np.copyto(ground, fill, where=is_filled)
    _hatch(ground, labels, is_filled, tuple(region for region in regions if region.is_hatched))
    edge = _is_edge(labels) & is_filled
    ground[edge] = _fill_by_label(regions, FillPart.OUTLINE)[labels[edge]]


def colour_regions(labels: NDArray[np.uint16], regions: tuple[Region, ...]) -> tuple[Region, ...]:
    """Gives the regions with a colour each, different from that of the regions near by."""
    neighbours = _find_neighbours(labels)
    chosen = {region.label: region.colour for region in regions if region.colour is not None}
    for region in regions:
        if region.colour is None:
            taken = {chosen[label] for label in neighbours.get(region.label, ()) if label in chosen}
            chosen[region.label] = _pick_colour(region.label, taken)
    return tuple(
        Region(
            label=region.label,
            text=region.text,
            colour=chosen[region.label],
            is_hatched=region.is_hatched,
        )
        for region in regions
    )


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
    n_above = grid.n_rows - round(corner[0])
    rows = n_above + _first_cells(view.area.height + 1, cells_per_pixel)
    cols = round(corner[1]) + _first_cells(view.area.width + 1, cells_per_pixel)
    from_top = values[::-1]
    if cells_per_pixel < 1:
        return _pool(_pool(from_top, cols, axis=1), rows, axis=0)
    return _pool(_pool(from_top, rows, axis=0), cols, axis=1)


def _first_cells(n_pixels: int, cells_per_pixel: float) -> IntArray:
    """Gives the first cell of each pixel in a row; a cell belongs to the pixel its middle is in."""
    pixels = np.arange(n_pixels)
    if cells_per_pixel < 1:
        earlier: IntArray = np.floor(pixels * cells_per_pixel + 1e-6).astype(np.intp)
        return earlier
    first: IntArray = np.ceil(pixels * cells_per_pixel - 0.5 - 1e-9).astype(np.intp)
    return first


def _pool(values: NDArray[Number], starts: IntArray, *, axis: int) -> NDArray[Number]:
    """Gives the highest value between each start and the next along an axis."""
    n_cells = values.shape[axis]
    firsts, lasts = starts[:-1], np.maximum(starts[1:] - 1, starts[:-1])
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
        values = _pool(values, np.arange(n_blocks + 1) * n_pooled, axis=axis)
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


def _fill_by_label(regions: tuple[Region, ...], part: FillPart) -> Canvas:
    """Gives the palette number of each label's fill; 0 for labels without a region."""
    fills = np.zeros(np.iinfo(np.uint16).max + 1, dtype=np.uint8)
    for region in regions:
        if region.colour is not None:
            fills[region.label] = FILLS[region.colour, part]
    return fills


def _hatch(
    ground: Canvas, labels: NDArray[np.uint16], is_filled: Mask, regions: tuple[Region, ...]
) -> None:
    """Draws diagonal lines over the filled pixels of some regions."""
    if not regions:
        return
    n_rows, n_cols = ground.shape
    row = np.arange(n_rows)[:, np.newaxis]
    col = -row % _HATCH_STEP_PX + np.arange(0, n_cols, _HATCH_STEP_PX)
    row, col = np.broadcast_to(row, col.shape)[col < n_cols], col[col < n_cols]
    hatch = _fill_by_label(regions, FillPart.HATCH)[labels[row, col]]
    is_hatched = is_filled[row, col] & (hatch > 0)
    ground[row[is_hatched], col[is_hatched]] = hatch[is_hatched]


def _is_edge(labels: NDArray[np.uint16]) -> Mask:
    """Gives True where another label, or none, is at most the outline's width away."""
    kernel = np.ones((2 * _OUTLINE_PX + 1, 2 * _OUTLINE_PX + 1), dtype=np.uint8)
    is_edge: Mask = cv2.dilate(labels, kernel) != cv2.erode(labels, kernel)
    return is_edge


def _find_neighbours(labels: NDArray[np.uint16]) -> dict[int, set[int]]:
    """Gives, for each label, those that come near it along a row or a column of pixels."""
    found: dict[int, set[int]] = {}
    for distance in (2, _NEIGHBOUR_PX):
        pairs = (
            (labels[:-distance:2, ::2], labels[distance::2, ::2]),
            (labels[::2, :-distance:2], labels[::2, distance::2]),
        )
        for one, other in pairs:
            differ = (one != other) & (one > 0) & (other > 0)
            joint = np.unique(one[differ].astype(np.uint32) << 16 | other[differ])
            for a, b in zip((joint >> 16).tolist(), (joint & 0xFFFF).tolist(), strict=True):
                found.setdefault(a, set()).add(b)
                found.setdefault(b, set()).add(a)
    return found


def _pick_colour(label: int, taken: set[Colour]) -> Colour:
    """Gives the first colour not taken, beginning at one that depends on the label alone."""
    start = label % len(_AUTOMATIC_COLOURS)
    turned = _AUTOMATIC_COLOURS[start:] + _AUTOMATIC_COLOURS[:start]
    return next((colour for colour in turned if colour not in taken), turned[0])
