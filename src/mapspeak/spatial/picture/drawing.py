"""Maps drawn for a reader who sees: to scale, with numbers, marks, areas and the robot."""

import io
import itertools
import zlib
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from mapspeak.geometry import Point, Pose
from mapspeak.spatial.grid import FloatArray, OccupancyGrid
from mapspeak.spatial.picture import axes, ground, ink, plan
from mapspeak.spatial.picture.labels import (
    draw_leaders,
    draw_texts,
    label_at,
    labels_of_marks,
    labels_of_regions,
)
from mapspeak.spatial.picture.legend import (
    ROW_PX,
    GroundEntry,
    Legend,
    PictureScene,
    grounds_in,
    n_rows_of,
)
from mapspeak.spatial.picture.marks import (
    FREE,
    PALETTE,
    PAPER,
    UNKNOWN_GROUND,
    WALL,
    Canvas,
    LegendEntry,
    Line,
    Mark,
    PictureRegion,
    RegionLayer,
    Zone,
)
from mapspeak.spatial.picture.placing import place_labels
from mapspeak.spatial.picture.regions import (
    check_layer,
    colour_regions,
    find_poles,
    paint_regions,
    paint_zones,
)
from mapspeak.spatial.picture.view import NORTH_UP_RAD, PictureView, even_spacing_m

_GROUNDS = (
    GroundEntry(FREE, "free"),
    GroundEntry(UNKNOWN_GROUND, "unknown"),
    GroundEntry(WALL, "wall"),
)
_LEGEND_RIM_PX = 5
_MAX_LEGEND_RATIO = 0.4


@dataclass(frozen=True, slots=True, kw_only=True)
class MapLayers:
    """What is drawn over the ground, from the lowest to the highest.

    Attributes:
        zones: Parts of the map that are set apart from it, such as what is closed.
        legend: What symbols and patterns mean; only those that are to be seen are explained, in
            this order, below the map.
    """

    regions: RegionLayer | None = None
    zones: tuple[Zone, ...] = ()
    lines: tuple[Line, ...] = ()
    marks: tuple[Mark, ...] = ()
    robot: Pose | None = None
    legend: tuple[LegendEntry, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class MapPicture:
    """A drawn map, and what a text beside it has to say about it.

    Attributes:
        view: The transform between the map and the pixels.
        spacing_m: Between the lines of the metric grid; None where none is drawn.
        labels_left_out: Texts of things in the picture whose label found no room.
        marks_outside: Labels of marks that lie outside the part of the map shown.
        regions_outside: Texts of regions of which no part is shown.
        has_robot: The robot's arrow is in the picture.
    """

    png: bytes
    view: PictureView
    spacing_m: float | None = None
    labels_left_out: tuple[str, ...] = ()
    marks_outside: tuple[str, ...] = ()
    regions_outside: tuple[str, ...] = ()
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
    """Draw the known part of a map, or a closer look at some of it, as a PNG.

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
    legend = Legend(spacing_m=spacing_m, grounds=_GROUNDS, entries=layers.legend)
    everything = legend.limited_to(_everything(layers))
    view = plan_sheet(
        grid, extent, everything, up_rad=up_rad, max_edge_px=max_edge_px, steps_per_pixel=2
    )
    canvas = np.full((view.height_px, view.width_px), PAPER, dtype=np.uint8)
    inside = view.area_of(canvas)
    inside[:] = ground.paint_ground(grid, view)
    regions = _paint_regions(inside, grid, view, layers.regions)
    legend = replace(legend, grounds=grounds_in(inside, _GROUNDS))
    draw_axes(canvas, view, spacing_m)
    return finish(canvas, view, layers, legend=legend, regions=regions)


def plan_sheet(
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
        n_needed = min(n_rows_of(legend, view), most_rows)
        if n_needed <= n_rows:
            return view
        n_rows = n_needed


def draw_axes(canvas: Canvas, view: PictureView, spacing_m: float) -> None:
    """Draw the metric grid under the walls, and the frame and numbers around the map."""
    lines = axes.lines_in_view(view, spacing_m)
    inside = view.area_of(canvas)
    axes.draw_lines_under_walls(inside, lines)
    axes.draw_zero(inside, view)
    axes.draw_frame(canvas, view.area)
    axes.draw_numbers(canvas, view, lines, spacing_m)


def finish(
    canvas: Canvas,
    view: PictureView,
    layers: MapLayers,
    *,
    legend: Legend,
    regions: NDArray[np.uint16] | None,
) -> MapPicture:
    """Draw zones, lines, symbols, the robot, all labels and the legend; return the picture."""
    zones = paint_zones(view.area_of(canvas), view, layers.zones)
    sight = _look(view, layers, regions, zones)
    left_out = _draw_scene(view.area_of(canvas), view, sight, regions)
    bottom = legend.limited_to(sight.scene).draw(canvas, view, axes.legend_top(view))
    height_px = min(view.height_px, bottom + _LEGEND_RIM_PX)
    return MapPicture(
        png=encode(canvas[:height_px]),
        view=replace(view, height_px=height_px),
        spacing_m=legend.spacing_m,
        labels_left_out=left_out,
        marks_outside=tuple(
            mark.label
            for mark, is_shown in zip(
                layers.marks, view.shows_each(_points_of(layers.marks)), strict=True
            )
            if mark.label and not is_shown
        ),
        regions_outside=tuple(
            region.text
            for region in _regions_of(layers)
            if region.text and region.label not in sight.poles
        ),
        has_robot=sight.scene.robot is not None,
    )


def encode(canvas: Canvas) -> bytes:
    """Return a palette PNG; run lengths alone pack a map well, and in a fraction of the time."""
    picture = Image.fromarray(canvas)
    picture.putpalette(PALETTE.tobytes())
    file = io.BytesIO()
    picture.save(file, "PNG", compress_level=1, compress_type=zlib.Z_RLE)
    return file.getvalue()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sight:
    """What a picture shows, and where in it the labels of regions and zones stand best."""

    scene: PictureScene
    poles: dict[int, tuple[float, float]]
    zones: dict[Zone, tuple[float, float] | None]


def _robot_label(robot: Pose) -> str:
    """Return the words beside the robot's arrow."""
    return f"robot {robot.x:.2f}, {robot.y:.2f}, {robot.yaw_deg:.0f}°"


def _extent(
    grid: OccupancyGrid, up_rad: float, zoom: plan.Zoom | None, robot: Pose | None
) -> plan.Extent:
    if zoom is None:
        place = robot.point if robot is not None else None
        return plan.extent_of_known(grid, up_rad, place=place)
    return plan.extent_of_zoom(grid, up_rad, zoom)


def _regions_of(layers: MapLayers) -> tuple[PictureRegion, ...]:
    return () if layers.regions is None else layers.regions.regions


def _everything(layers: MapLayers) -> PictureScene:
    """Return all that a picture of the whole map would show."""
    return PictureScene(
        regions=_regions_of(layers),
        zones=layers.zones,
        lines=layers.lines,
        marks=layers.marks,
        robot=layers.robot,
        has_origin=True,
    )


def _look(
    view: PictureView,
    layers: MapLayers,
    regions: NDArray[np.uint16] | None,
    zones: dict[Zone, tuple[float, float] | None],
) -> _Sight:
    """Return the part of all that which lies in the view."""
    named = _regions_of(layers)
    poles = {} if regions is None else find_poles(regions, tuple(r.label for r in named))
    robot = layers.robot
    scene = PictureScene(
        regions=tuple(region for region in named if region.label in poles),
        zones=tuple(zones),
        lines=tuple(line for line in layers.lines if ink.is_in_view(view, line)),
        marks=tuple(itertools.compress(layers.marks, view.shows_each(_points_of(layers.marks)))),
        robot=robot if robot is not None and view.shows(robot.point) else None,
        has_origin=view.shows(Point(0.0, 0.0)),
    )
    return _Sight(scene=scene, poles=poles, zones=zones)


def _paint_regions(
    inside: Canvas, grid: OccupancyGrid, view: PictureView, layer: RegionLayer | None
) -> NDArray[np.uint16] | None:
    """Paint the regions and return the region of each pixel."""
    if layer is None:
        return None
    check_layer(layer, grid)
    regions = ground.sample(layer.labels, grid, view)
    paint_regions(inside, regions, layer.regions, colour_regions(layer, grid))
    return regions


def _draw_scene(
    inside: Canvas, view: PictureView, sight: _Sight, regions: NDArray[np.uint16] | None
) -> tuple[str, ...]:
    """Draw lines, symbols, the robot and all labels; return the names left out."""
    scene = sight.scene
    for line in scene.lines:
        ink.draw_line(inside, view, line)
    places = view.area_pixels_at(_points_of(scene.marks))
    obstacles = [
        ink.symbol_box(place, ink.SYMBOL_REACH_PX)
        for mark, place in zip(scene.marks, places, strict=True)
        if mark.shape is not None
    ]
    labels = [
        *(
            label_at(np.array(pole), zone.label, clearance_px=0.0)
            for zone, pole in sight.zones.items()
            if zone.label and pole is not None
        ),
        *labels_of_regions(scene.regions, sight.poles),
        *labels_of_marks(scene.marks, places),
    ]
    if scene.robot is not None:
        at, reach_px = _place_of(scene.robot, view), ink.ARROW_REACH_PX
        obstacles.append(ink.symbol_box(at, reach_px))
        labels.insert(0, label_at(at, _robot_label(scene.robot), clearance_px=reach_px))
    placed, left_out = place_labels(inside, labels, obstacles=obstacles, regions=regions)
    draw_leaders(inside, placed)
    for mark, place in zip(scene.marks, places, strict=True):
        if mark.shape is not None:
            ink.draw_shape(inside, place, mark.shape, mark.colour)
    if scene.robot is not None:
        heading_rad = view.heading_at(scene.robot.yaw_rad)
        ink.draw_arrow(inside, _place_of(scene.robot, view), heading_rad)
    draw_texts(inside, placed)
    covered = (zone.label for zone, pole in sight.zones.items() if zone.label and pole is None)
    return (*covered, *left_out)


def _place_of(robot: Pose, view: PictureView) -> FloatArray:
    return np.asarray(view.area_pixels_at(np.array([[robot.x, robot.y]]))[0])


def _points_of(marks: tuple[Mark, ...]) -> FloatArray:
    return np.array([[mark.point.x, mark.point.y] for mark in marks]).reshape(-1, 2)
