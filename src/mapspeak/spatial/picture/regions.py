"""Regions and zones painted on the map area: colours, patterns, outlines, places for labels."""

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.grid import IntArray, Mask, OccupancyGrid
from mapspeak.spatial.picture.marks import (
    FILLS,
    FREE,
    RAMPS,
    WALL,
    Canvas,
    Colour,
    FillPart,
    PictureRegion,
    RegionLayer,
    Zone,
)
from mapspeak.spatial.picture.transform import PictureView

AUTOMATIC_COLOURS = (
    Colour.SKY,
    Colour.ORANGE,
    Colour.GREEN,
    Colour.PURPLE,
    Colour.YELLOW,
    Colour.VERMILION,
)

_LATTICE_M = 0.2
_NEIGHBOUR_M = (0.2, 0.6, 1.2)
"""Regions this far apart, as on both sides of a wall, look like neighbours."""
_EDGE_PX = 2
_REGION_HATCH_PX = 9
_DOT_STEP_PX = 10
_DOT_PX = 2
_HIGHLIGHT_PX = 5
_HIGHLIGHT = int(RAMPS[Colour.VERMILION][-1])


def paint_regions(
    ground: Canvas,
    labels: NDArray[np.uint16],
    regions: tuple[PictureRegion, ...],
    colours: dict[int, Colour],
) -> None:
    """Fill the free pixels of each region, with its pattern and outline, on the ground given.

    Args:
        ground: Palette numbers of the map area; changed in place.
        labels: The region of each pixel, from `sample`.
    """
    fill = np.take(_fill_by_label(regions, colours, FillPart.PLAIN), labels)
    is_filled = (ground == FREE) & (fill > 0)
    np.copyto(ground, fill, where=is_filled)
    for find_pixels, wanted in (
        (_hatch_pixels, tuple(region for region in regions if region.is_hatched)),
        (_dot_pixels, tuple(region for region in regions if region.is_dotted)),
    ):
        if wanted:
            row, col = find_pixels(ground.shape)
            hatch = _fill_by_label(wanted, colours, FillPart.HATCH)[labels[row, col]]
            is_painted = is_filled[row, col] & (hatch > 0)
            ground[row[is_painted], col[is_painted]] = hatch[is_painted]
    kernel = np.ones((2 * _EDGE_PX + 1, 2 * _EDGE_PX + 1), dtype=np.uint8)
    # Another label, or none, is at most the outline's width away.
    edge = (cv2.dilate(labels, kernel) != cv2.erode(labels, kernel)) & is_filled
    ground[edge] = _fill_by_label(regions, colours, FillPart.OUTLINE)[labels[edge]]
    for region in regions:
        if region.is_highlighted:
            _highlight(ground, labels == region.label)


def _fill_by_label(
    regions: tuple[PictureRegion, ...], colours: dict[int, Colour], part: FillPart
) -> Canvas:
    """Return the palette number of each label's fill; 0 for labels without a region."""
    fills = np.zeros(np.iinfo(np.uint16).max + 1, dtype=np.uint8)
    for region in regions:
        fills[region.label] = FILLS[colours[region.label], part]
    return fills


def _hatch_pixels(shape: tuple[int, ...]) -> tuple[IntArray, IntArray]:
    """Return rows and columns on diagonal lines."""
    row = np.arange(shape[0])[:, np.newaxis]
    col = -row % _REGION_HATCH_PX + np.arange(0, shape[1], _REGION_HATCH_PX)
    return np.broadcast_to(row, col.shape)[col < shape[1]], col[col < shape[1]]


def _dot_pixels(shape: tuple[int, ...]) -> tuple[IntArray, IntArray]:
    """Return rows and columns of small square dots."""
    row, col = (np.flatnonzero(np.arange(length) % _DOT_STEP_PX < _DOT_PX) for length in shape)
    return np.repeat(row, col.size), np.tile(col, row.size)


def _highlight(ground: Canvas, is_region: Mask) -> None:
    """Draw a bold line inside a region along its outer border, beside its walls.

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


def colour_regions(layer: RegionLayer, grid: OccupancyGrid) -> dict[int, Colour]:
    """Return the colour of each region's label, different from that of the regions near by.

    A colour depends on the region's key, and on the neighbours with a lower key only where they
    have that colour already. All is found in the whole map and in metres, so that a closer look or
    another region elsewhere changes no colour.
    """
    neighbours = _find_neighbours(layer.labels, grid)
    chosen = {region.label: region.colour for region in layer.regions if region.colour is not None}
    for region in sorted(layer.regions, key=lambda region: (_key(region), region.label)):
        if region.label not in chosen:
            near = neighbours.get(region.label, set())
            taken = {chosen[label] for label in near if label in chosen}
            start = _key(region) % len(AUTOMATIC_COLOURS)
            turned = AUTOMATIC_COLOURS[start:] + AUTOMATIC_COLOURS[:start]
            chosen[region.label] = next((c for c in turned if c not in taken), turned[0])
    return chosen


def _key(region: PictureRegion) -> int:
    return region.label if region.key is None else region.key


def _find_neighbours(labels: NDArray[np.uint16], grid: OccupancyGrid) -> dict[int, set[int]]:
    """Return, for each label, the labels near it along a row or a column of cells."""
    step = max(1, round(_LATTICE_M / grid.resolution_m))
    # The lattice stays where it is in the world as a map grows.
    first_row, first_col = (
        round(at) % step for at in grid.fractional_cells_at(np.zeros((1, 2)))[0]
    )
    lattice = np.ascontiguousarray(labels[first_row::step, first_col::step])
    found: dict[int, set[int]] = {}
    for n in {max(1, round(apart_m / (step * grid.resolution_m))) for apart_m in _NEIGHBOUR_M}:
        for one, other in ((lattice[:-n], lattice[n:]), (lattice[:, :-n], lattice[:, n:])):
            differ = (one != other) & (one > 0) & (other > 0)
            for pair in set((one[differ].astype(np.uint32) << 16 | other[differ]).tolist()):
                found.setdefault(pair >> 16, set()).add(pair & 0xFFFF)
                found.setdefault(pair & 0xFFFF, set()).add(pair >> 16)
    return found


def find_poles(
    regions: NDArray[np.uint16], wanted: tuple[int, ...]
) -> dict[int, tuple[float, float]]:
    """Return (u, v) of the point farthest from the border of each region in sight, to two pixels.

    That is the pole of inaccessibility: the place with the most room for a label. The sides of the
    picture are borders too, so the pole of a region that is only partly in sight lies in that part.

    Args:
        regions: The region of each pixel of the map area; 0 for none.
    """
    coarse = cv2.copyMakeBorder(regions[::2, ::2], 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=(0,))
    kernel = np.ones((3, 3), dtype=np.uint8)
    is_inner = (cv2.dilate(coarse, kernel) == cv2.erode(coarse, kernel)) & (coarse > 0)
    depth = cv2.distanceTransform(is_inner.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)
    is_peak = (depth >= cv2.dilate(depth, kernel)) & (coarse > 0)
    rows, cols = np.nonzero(is_peak)
    order = np.argsort(-depth[rows, cols], kind="stable")
    labels, first = np.unique(coarse[rows[order], cols[order]], return_index=True)
    peaks = order[first]
    poles = {
        int(label): (2.0 * float(cols[peak]) - 1.5, 2.0 * float(rows[peak]) - 1.5)
        for label, peak in zip(labels, peaks, strict=True)
    }
    return poles | _find_slivers(regions, set(wanted) - poles.keys())


def _find_slivers(regions: NDArray[np.uint16], missing: set[int]) -> dict[int, tuple[float, float]]:
    """Return the first pixel of regions so small that every second row and column misses them."""
    if not missing:
        return {}
    is_seen = cv2.calcHist([regions], [0], None, [1 << 16], [0, 1 << 16]).ravel() > 0
    found = {}
    for label in sorted(label for label in missing if is_seen[label]):
        row, col = np.unravel_index(int(np.argmax(regions == label)), regions.shape)
        found[label] = (float(col) + 0.5, float(row) + 0.5)
    return found


ZONE_NUMBER = FILLS[Colour.VERMILION, FillPart.OUTLINE]
_OUTLINE_PX = 3
_HATCH_STEP_PX = 12
_HATCH_PX = 2
_SHIFT = 4
_FAR_PX = 1 << 20
"""OpenCV draws with whole numbers; points farther out of the picture need no exact place."""


def paint_zones(
    ground: Canvas, view: PictureView, zones: tuple[Zone, ...]
) -> dict[Zone, tuple[float, float] | None]:
    """Draw zones over the ground, and return those in sight with the place for each label.

    Args:
        ground: Palette numbers of the map area; changed in place, but for walls.
        zones: The later ones lie above; what they cover wholly has no place for a label.
    """
    if not zones:
        return {}
    numbers = np.zeros(ground.shape, dtype=np.uint16)
    shown = {}
    row = np.arange(ground.shape[0])[:, np.newaxis]
    col = np.arange(ground.shape[1])
    is_hatch = (row - col) % _HATCH_STEP_PX < _HATCH_PX
    for number, zone in enumerate(zones, start=1):
        is_inside, is_edge = _cover(ground.shape, view, zone)
        is_floor = ground != WALL
        ground[(is_edge | (is_inside & is_hatch)) & is_floor] = ZONE_NUMBER
        if (is_inside | is_edge).any():
            # Walls are left out, so that the label stands beside them.
            numbers[(is_inside | is_edge) & is_floor] = number
            shown[number] = zone
    poles = find_poles(numbers, tuple(shown))
    return {zone: poles.get(number) for number, zone in shown.items()}


def _cover(shape: tuple[int, ...], view: PictureView, zone: Zone) -> tuple[Mask, Mask]:
    """Return which pixels lie in a zone, and which on its outlines."""
    corners = []
    for outline in zone.outlines:
        points = view.area_pixels_at(np.array([[corner.x, corner.y] for corner in outline])) - 0.5
        corners.append(np.rint(points.clip(-_FAR_PX, _FAR_PX) * (1 << _SHIFT)).astype(np.int32))
    inside = np.zeros(shape, dtype=np.uint8)
    cv2.fillPoly(inside, corners, (1,), cv2.LINE_8, _SHIFT)
    edge = np.zeros(shape, dtype=np.uint8)
    cv2.polylines(edge, corners, isClosed=True, color=(1,), thickness=_OUTLINE_PX, shift=_SHIFT)
    return inside > 0, edge > 0
