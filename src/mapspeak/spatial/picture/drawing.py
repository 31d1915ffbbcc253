"""Maps drawn for a reader who sees: to scale, with numbers, marks, areas and the robot."""

import io
import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from mapspeak.geometry import Point, Pose
from mapspeak.spatial.grid import OccupancyGrid
from mapspeak.spatial.picture import axes, ground, plan, symbols
from mapspeak.spatial.picture.labels import Label, draw_labels, find_poles
from mapspeak.spatial.picture.marks import Line, Mark, RegionLayer
from mapspeak.spatial.picture.palette import (
    FREE,
    PALETTE,
    PAPER,
    UNKNOWN_GROUND,
    WALL,
    Canvas,
)
from mapspeak.spatial.picture.spacing import even_spacing_m
from mapspeak.spatial.picture.view import NORTH_UP_RAD, View

__all__ = ["MapLayers", "MapPicture", "draw_axes", "draw_map", "encode", "finish"]


LEGEND = (
    axes.LegendEntry(FREE, "free"),
    axes.LegendEntry(UNKNOWN_GROUND, "unknown"),
    axes.LegendEntry(WALL, "wall"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class MapLayers:
    """What is drawn over the ground, from the lowest to the highest.

    Attributes:
        regions: Areas of the floor.
        lines: Paths, doors, borders.
        marks: Places, each with a label.
        robot: Where the robot stands.
    """

    regions: RegionLayer | None = None
    lines: tuple[Line, ...] = ()
    marks: tuple[Mark, ...] = ()
    robot: Pose | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class MapPicture:
    """A drawn map, and what a text beside it has to say about it.

    Attributes:
        png: The encoded picture.
        view: The transform between the map and the pixels.
        spacing_m: Between the lines of the metric grid; None where none is drawn.
        labels_left_out: Texts of things in the picture whose label found no room.
        marks_outside: Labels of marks that lie outside the part of the map shown.
        has_robot: The robot's arrow is in the picture.
    """

    png: bytes
    view: View
    spacing_m: float | None = None
    labels_left_out: tuple[str, ...] = ()
    marks_outside: tuple[str, ...] = ()
    has_robot: bool = False

    @property
    def media_type(self) -> str:
        """The type of the encoded picture."""
        return "image/png"


_NO_LAYERS = MapLayers()


def draw_map(
    grid: OccupancyGrid,
    *,
    layers: MapLayers = _NO_LAYERS,
    up_rad: float = NORTH_UP_RAD,
    zoom: plan.Zoom | None = None,
    max_edge_px: int = 1000,
) -> MapPicture:
    """Draws the known part of a map, or a closer look at some of it, as a PNG.

    Args:
        grid: The map.
        layers: What is drawn on it.
        up_rad: The direction in the map that points up: pi/2 for y up, the robot's yaw for its own
            point of view.
        zoom: The part to show; None for all that is known, the robot, and
            a metre more.
        max_edge_px: The longest side of the picture, 320 to 1072.

    Raises:
        MapError: The map has no cells, the regions are those of another map, or the zoom shows
            no map.
    """
    extent = _extent(grid, up_rad, zoom, layers.robot)
    spacing_m = even_spacing_m(max(extent.width_m, extent.height_m))
    margins = axes.margins_for(extent, spacing_m, up_rad=up_rad)
    view = plan.plan_view(
        grid,
        extent,
        up_rad=up_rad,
        margins=margins,
        max_edge_px=max_edge_px,
        steps_per_pixel=2,
    )
    canvas = np.full((view.height_px, view.width_px), PAPER, dtype=np.uint8)
    inside = view.area_of(canvas)
    inside[:] = ground.paint_ground(grid, view)
    regions = _paint_regions(inside, grid, view, layers.regions)
    draw_axes(canvas, view, spacing_m, LEGEND)
    return finish(canvas, view, layers, spacing_m=spacing_m, regions=regions)


def draw_axes(
    canvas: Canvas, view: View, spacing_m: float, legend: tuple[axes.LegendEntry, ...]
) -> None:
    """Draws the metric grid under the walls, and the frame, numbers and legend around the map."""
    lines = axes.lines_in_view(view, spacing_m)
    inside = view.area_of(canvas)
    axes.draw_lines_under_walls(inside, lines)
    axes.draw_zero(inside, view)
    axes.draw_frame(canvas, view.area)
    axes.draw_numbers(canvas, view, lines, spacing_m)
    axes.draw_legend(canvas, view, spacing_m, legend)


def finish(
    canvas: Canvas,
    view: View,
    layers: MapLayers,
    *,
    spacing_m: float,
    regions: NDArray[np.uint16] | None,
) -> MapPicture:
    """Draws lines, symbols, the robot and all labels over the ground and gives the picture."""
    left_out = _draw_layers(view.area_of(canvas), view, layers, regions)
    return MapPicture(
        png=encode(canvas),
        view=view,
        spacing_m=spacing_m,
        labels_left_out=left_out,
        marks_outside=tuple(mark.label for mark in layers.marks if not view.shows(mark.point)),
        has_robot=layers.robot is not None and view.shows(layers.robot.point),
    )


def encode(canvas: Canvas) -> bytes:
    """Gives a palette PNG; run lengths alone pack a map well, and in a fraction of the time."""
    picture = Image.fromarray(canvas)
    picture.putpalette(PALETTE.tobytes())
    file = io.BytesIO()
    picture.save(file, "PNG", compress_level=1, compress_type=zlib.Z_RLE)
    return file.getvalue()


def _robot_label(robot: Pose) -> str:
    """Gives the words beside the robot's arrow."""
    return f"robot {robot.x:.2f}, {robot.y:.2f}, {robot.yaw_deg:.0f}°"


def _extent(
    grid: OccupancyGrid, up_rad: float, zoom: plan.Zoom | None, robot: Pose | None
) -> plan.Extent:
    if zoom is None:
        place = robot.point if robot is not None else None
        return plan.extent_of_known(grid, up_rad, place=place)
    return plan.extent_of_zoom(grid, up_rad, zoom)


def _paint_regions(
    inside: Canvas, grid: OccupancyGrid, view: View, layer: RegionLayer | None
) -> NDArray[np.uint16] | None:
    """Paints the regions and gives the region of each pixel."""
    if layer is None:
        return None
    ground.check_layer(layer, grid)
    regions = ground.sample(layer.labels, grid, view)
    ground.paint_regions(inside, regions, ground.colour_regions(regions, layer.regions))
    return regions


def _draw_layers(
    inside: Canvas, view: View, layers: MapLayers, regions: NDArray[np.uint16] | None
) -> tuple[str, ...]:
    """Draws lines, symbols, the robot and then all labels; gives the labels left out."""
    shown = [mark for mark in layers.marks if view.shows(mark.point)]
    robot = layers.robot if layers.robot and view.shows(layers.robot.point) else None
    for line in layers.lines:
        symbols.draw_line(inside, view, line)
    for mark in shown:
        symbols.draw_symbol(inside, view, mark)
    obstacles = [
        symbols.symbol_box(view, mark.point, symbols.SYMBOL_REACH_PX)
        for mark in shown
        if mark.shape is not None
    ]
    labels = [_label_of_mark(view, mark) for mark in shown if mark.label]
    if robot is not None:
        symbols.draw_robot(inside, view, robot)
        obstacles.append(symbols.symbol_box(view, robot.point, symbols.ARROW_REACH_PX))
        labels.insert(0, _label_at(view, robot.point, _robot_label(robot), symbols.ARROW_REACH_PX))
    labels.extend(_labels_of_regions(layers.regions, regions))
    return draw_labels(inside, tuple(labels), obstacles=tuple(obstacles), regions=regions)


def _label_of_mark(view: View, mark: Mark) -> Label:
    clearance_px = symbols.SYMBOL_REACH_PX if mark.shape is not None else 0.0
    return _label_at(view, mark.point, mark.label, clearance_px)


def _label_at(view: View, point: Point, text: str, clearance_px: float) -> Label:
    u, v = view.area_pixels_at(np.array([[point.x, point.y]]))[0]
    return Label(text=text, u=float(u), v=float(v), clearance_px=clearance_px)


def _labels_of_regions(
    layer: RegionLayer | None, regions: NDArray[np.uint16] | None
) -> list[Label]:
    """Gives the labels of the regions in sight, each at the place with the most room."""
    if layer is None or regions is None:
        return []
    poles = find_poles(regions)
    return [
        Label(
            text=region.text,
            u=poles[region.label][0],
            v=poles[region.label][1],
            region=region.label,
        )
        for region in layer.regions
        if region.text and region.label in poles
    ]
