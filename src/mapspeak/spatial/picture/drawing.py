"""Maps drawn for a reader who sees: to scale, with numbers, marks, areas and the robot."""

import io
import itertools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from mapspeak.errors import MapError
from mapspeak.geometry import Point, Pose
from mapspeak.spatial.grid import FloatArray, OccupancyGrid
from mapspeak.spatial.picture import axes, ink, plan
from mapspeak.spatial.picture.labels import (
    Label,
    draw_leaders,
    draw_texts,
    label_at,
    labels_of_marks,
    labels_of_regions,
)
from mapspeak.spatial.picture.legend import ROW_PX, Legend, break_rows
from mapspeak.spatial.picture.marks import (
    FREE,
    GREYS,
    PALETTE,
    PAPER,
    UNKNOWN_GROUND,
    WALL,
    Canvas,
    Line,
    MapLayers,
    Mark,
    PictureRegion,
    RegionLayer,
    Sheet,
)
from mapspeak.spatial.picture.placing import place_labels
from mapspeak.spatial.picture.regions import (
    colour_regions,
    find_poles,
    paint_regions,
    paint_zones,
)
from mapspeak.spatial.picture.transform import (
    NORTH_UP_RAD,
    PictureView,
    even_spacing_m,
    paint_ground,
    paint_paper_ground,
    paper_spacing_m,
    sample,
)

_GROUNDS = {FREE: "free", UNKNOWN_GROUND: "unknown", WALL: "wall"}
_PAPER_GROUNDS = {int(GREYS[1]): "free", int(GREYS[0]): "unknown", int(GREYS[-1]): "occupied"}
EDGE_PX = 1000
"""The longest edge of the pictures that are shown."""
_LEGEND_RIM_PX = 5
_MAX_LEGEND_RATIO = 0.4


@dataclass(frozen=True, slots=True, kw_only=True)
class MapPicture:
    """A drawn map, and what a text beside it has to say about it.

    Attributes:
        spacing_m: Between the lines of the metric grid; None where none is drawn.
        labels_left_out: Texts of things in the picture whose label found no room.
    """

    png: bytes
    view: PictureView
    spacing_m: float | None = None
    labels_left_out: tuple[str, ...] = ()


_NO_LAYERS = MapLayers()


def draw_map(
    grid: OccupancyGrid,
    *,
    layers: MapLayers = _NO_LAYERS,
    up_rad: float = NORTH_UP_RAD,
    zoom: plan.Zoom | None = None,
    max_edge_px: int = EDGE_PX,
) -> MapPicture:
    """Draw the known part of a map, or a closer look at some of it, as a PNG.

    Args:
        up_rad: The direction in the map that points up: pi/2 for y up, the robot's yaw for its own
            point of view.
        zoom: The part to show; None for all that is known, the robot, and a metre more.
        max_edge_px: The longest side of the picture, 320 to 1072.

    Raises:
        MapError: The map has no cells, the regions are those of another map, or the zoom shows
            no map.
    """
    if zoom is None:
        place = layers.robot.point if layers.robot is not None else None
        extent = plan.extent_of_known(grid, up_rad, place=place)
    else:
        extent = plan.extent_of_zoom(grid, up_rad, zoom)
    spacing_m = even_spacing_m(max(extent.width_m, extent.height_m))
    legend = Legend(spacing_m=spacing_m, grounds=_GROUNDS, entries=layers.legend)
    everything = legend.limited_to(layers, _regions_of(layers), has_origin=True)
    view = _plan_sheet(
        grid, extent, everything, up_rad=up_rad, max_edge_px=max_edge_px, steps_per_pixel=2
    )
    painted = {} if layers.regions is None else layers.regions.painted
    key = grid, view, spacing_m
    sheet = painted.get(key)
    if sheet is None:
        sheet = _paint_sheet(grid, view, layers.regions, spacing_m)
        painted.clear()
        painted[key] = sheet
    return _finish(sheet, view, layers, legend=replace(legend, grounds=sheet.grounds))


def _paint_sheet(
    grid: OccupancyGrid, view: PictureView, layer: RegionLayer | None, spacing_m: float
) -> Sheet:
    canvas = np.full((view.height_px, view.width_px), PAPER, dtype=np.uint8)
    inside = view.area_of(canvas)
    inside[:] = paint_ground(grid, view)
    regions = _no_regions(view)
    poles: Mapping[int, tuple[float, float]] = {}
    if layer is not None:
        if layer.labels.shape != grid.cells.shape:
            raise MapError(
                f"The regions cover {layer.labels.shape} cells, the map has {grid.cells.shape}.",
                hint="Find the regions of this map again.",
            )
        regions = sample(layer.labels, grid, view)
        paint_regions(inside, regions, layer.regions, colour_regions(layer, grid))
        poles = find_poles(regions, tuple(region.label for region in layer.regions))
    grounds = {number: text for number, text in _GROUNDS.items() if (inside == number).any()}
    axes.draw_axes(canvas, view, spacing_m)
    return Sheet(canvas=canvas, regions=regions, poles=poles, grounds=grounds)


def draw_map_plain(grid: OccupancyGrid) -> MapPicture:
    """Draw the whole map in the paper's grey levels (eq. 1) and nothing else.

    In this and the next two row 0 of the grid is at the bottom, and a point of the world falls
    where eq. 3 says, times the whole number of pixels that one cell takes. Where the paper is
    silent (a turned origin, a map larger than a model takes in) they follow `plan` and `view`.
    """
    extent = plan.extent_of_map(grid, NORTH_UP_RAD)
    view = plan.plan_view(
        grid, extent, up_rad=NORTH_UP_RAD, margins=plan.Margins(), max_edge_px=EDGE_PX
    )
    return MapPicture(png=_encode(paint_paper_ground(grid, view)), view=view)


def draw_map_axis(grid: OccupancyGrid) -> MapPicture:
    """Draw the whole map with its axes and the paper's adaptive metric grid (eqs. 2 to 6)."""
    return _draw_with_axes(grid, MapLayers())


def draw_robot_pose(grid: OccupancyGrid, robot: Pose) -> MapPicture:
    """Draw the same with the robot as an arrow along its heading (eq. 7)."""
    return _draw_with_axes(grid, MapLayers(robot=robot))


def _draw_with_axes(grid: OccupancyGrid, layers: MapLayers) -> MapPicture:
    extent = plan.extent_of_map(grid, NORTH_UP_RAD)
    spacing_m = paper_spacing_m(extent.width_m, extent.height_m, grid.resolution_m)
    legend = Legend(spacing_m=spacing_m, grounds=_PAPER_GROUNDS)
    view = _plan_sheet(grid, extent, legend, up_rad=NORTH_UP_RAD, max_edge_px=EDGE_PX)
    canvas = np.full((view.height_px, view.width_px), PAPER, dtype=np.uint8)
    view.area_of(canvas)[:] = paint_paper_ground(grid, view)
    axes.draw_axes(canvas, view, spacing_m)
    sheet = Sheet(canvas=canvas, regions=_no_regions(view), poles={}, grounds=_PAPER_GROUNDS)
    return _finish(sheet, view, layers, legend=legend)


def _plan_sheet(
    grid: OccupancyGrid,
    extent: plan.Extent,
    legend: Legend,
    *,
    up_rad: float,
    max_edge_px: int,
    steps_per_pixel: int = 1,
) -> PictureView:
    """Return the view with room for numbers and legend; see `plan.plan_view`.

    The more rows the legend gets, the smaller the map, and the more rows the legend needs.
    """
    most_rows = int(_MAX_LEGEND_RATIO * max_edge_px / ROW_PX)
    n_rows = 1
    while True:
        legend_px = n_rows * ROW_PX + _LEGEND_RIM_PX
        view = plan.plan_view(
            grid,
            extent,
            up_rad=up_rad,
            margins=axes.margins_for(extent, legend.spacing_m, up_rad=up_rad, legend_px=legend_px),
            max_edge_px=max_edge_px,
            steps_per_pixel=steps_per_pixel,
        )
        n_needed = min(len(break_rows(legend, view)), most_rows)
        if n_needed <= n_rows:
            return view
        n_rows = n_needed


def _finish(sheet: Sheet, view: PictureView, layers: MapLayers, *, legend: Legend) -> MapPicture:
    """Draw zones, lines, symbols, the robot, all labels and the legend on a copy of a sheet."""
    canvas, regions = sheet.canvas.copy(), sheet.regions
    zones = paint_zones(view.area_of(canvas), view, layers.zones)
    named = _regions_of(layers)
    in_sight = tuple(region for region in named if region.label in sheet.poles)
    is_marked = view.shows_each(_points_of(layers.marks))
    robot = layers.robot
    shown = replace(
        layers,
        zones=tuple(zones),
        lines=tuple(line for line in layers.lines if ink.find_runs(view, line)),
        marks=tuple(itertools.compress(layers.marks, is_marked)),
        robot=robot if robot is not None and view.shows(robot.point) else None,
    )
    labels = [
        *(
            label_at(np.array(pole), zone.label, clearance_px=0.0)
            for zone, pole in zones.items()
            if zone.label and pole is not None
        ),
        *labels_of_regions(in_sight, sheet.poles),
    ]
    covered = (zone.label for zone, pole in zones.items() if zone.label and pole is None)
    left_out = (*covered, *_draw_symbols(view.area_of(canvas), view, shown, labels, regions))
    here = legend.limited_to(shown, in_sight, has_origin=view.shows(Point(0.0, 0.0)))
    bottom = here.draw(canvas, view, axes.legend_top(view))
    height_px = min(view.height_px, bottom + _LEGEND_RIM_PX)
    return MapPicture(
        png=_encode(canvas[:height_px]),
        view=replace(view, height_px=height_px),
        spacing_m=legend.spacing_m,
        labels_left_out=left_out,
    )


def _encode(canvas: Canvas) -> bytes:
    """Return a palette PNG, packed in the least time."""
    picture = Image.fromarray(canvas)
    picture.putpalette(PALETTE.tobytes())
    file = io.BytesIO()
    picture.save(file, "PNG", compress_level=1)
    return file.getvalue()


def _no_regions(view: PictureView) -> NDArray[np.uint16]:
    return np.zeros((view.area.height, view.area.width), np.uint16)


def _regions_of(layers: MapLayers) -> tuple[PictureRegion, ...]:
    return () if layers.regions is None else layers.regions.regions


def _points_of(marks: tuple[Mark, ...]) -> FloatArray:
    return np.array([[mark.point.x, mark.point.y] for mark in marks]).reshape(-1, 2)


def _draw_symbols(
    inside: Canvas,
    view: PictureView,
    shown: MapLayers,
    labels: list[Label],
    regions: NDArray[np.uint16],
) -> tuple[str, ...]:
    """Draw lines, symbols, the robot and all labels; return the names left out.

    Args:
        inside: The map area; changed in place.
        labels: Those of zones and regions.
        regions: The region of each pixel.
    """
    _draw_lines(inside, view, [line for line in shown.lines if not line.is_over_robot])
    places = view.area_pixels_at(_points_of(shown.marks))
    symbols = [
        (mark.shape, mark.colour, place)
        for mark, place in zip(shown.marks, places, strict=True)
        if mark.shape is not None
    ]
    obstacles = [ink.symbol_box(place, ink.SYMBOL_REACH_PX) for _, _, place in symbols]
    labels = [*labels, *labels_of_marks(shown.marks, places)]
    robot = shown.robot
    if robot is not None:
        at, reach_px = view.area_pixels_at(np.array([[robot.x, robot.y]]))[0], ink.ARROW_REACH_PX
        obstacles.append(ink.symbol_box(at, reach_px))
        text = f"robot {robot.x:.2f}, {robot.y:.2f}, {robot.yaw_deg:.0f}°"
        labels.insert(0, label_at(at, text, clearance_px=reach_px))
    placed, left_out = place_labels(inside, labels, obstacles=obstacles, regions=regions)
    draw_leaders(inside, placed)
    for shape, colour, place in symbols:
        ink.draw_shape(inside, place, shape, colour)
    if robot is not None:
        ink.draw_arrow(inside, at, view.heading_at(robot.yaw_rad))
    _draw_lines(inside, view, [line for line in shown.lines if line.is_over_robot])
    draw_texts(inside, placed)
    return left_out


def _draw_lines(inside: Canvas, view: PictureView, lines: Iterable[Line]) -> None:
    for line in lines:
        for run in ink.find_runs(view, line):
            ink.draw_run(inside, run, line.style, line.colour, width_px=line.width_px)
