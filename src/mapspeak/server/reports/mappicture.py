"""A world model as a picture: rooms, doors, frontiers, places and the robot, under their ids."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mapspeak.geometry import Point
from mapspeak.robot import NavigationPart
from mapspeak.server.text.wording import list_some
from mapspeak.server.text.world.look import Layer, MapLook, MapView
from mapspeak.server.text.world.maps import NAVIGATION_PARTS
from mapspeak.server.text.world.notices import say_area
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.picture import (
    EDGE_PX,
    NORTH_UP_RAD,
    Colour,
    LegendEntry,
    LegendSample,
    Line,
    LineStyle,
    MapLayers,
    MapPicture,
    Mark,
    RegionLayer,
    Shape,
    Zone,
    draw_map,
)
from mapspeak.spatial.picture import PictureRegion as Area
from mapspeak.spatial.rooms import Door, Region, RoomClass, RoomMap
from mapspeak.worldmodel.model import WorldModel

NAVIGATION_COLOURS = {
    NavigationPart.PLAN: Colour.GREEN,
    NavigationPart.FOOTPRINT: Colour.INK,
    NavigationPart.GLOBAL_COSTMAP: Colour.ORANGE,
    NavigationPart.LOCAL_COSTMAP: Colour.SKY,
}
LEGEND = (
    LegendEntry(sample=LegendSample.PLAIN_REGION, text="room"),
    LegendEntry(sample=LegendSample.HATCHED_REGION, text="corridor"),
    LegendEntry(sample=LegendSample.DOTTED_REGION, text="open space"),
    LegendEntry(sample=Shape.SQUARE, text="door"),
    LegendEntry(sample=Shape.CROSS, text="door, no way for the robot"),
    LegendEntry(sample=Shape.TRIANGLE, text="frontier"),
    LegendEntry(sample=Shape.DIAMOND, text="remembered place"),
    LegendEntry(sample=LegendSample.ZONE, text="closed to the robot"),
    LegendEntry(sample=LegendSample.ROBOT, text="robot"),
    LegendEntry(sample=LineStyle.DASHED, text="way to the best frontier"),
    LegendEntry(sample=LegendSample.ORIGIN, text="origin"),
    *(
        LegendEntry(sample=LineStyle.SOLID, text=text, colour=colour)
        for colour, text in {
            Colour.PURPLE: "wall that no picture shows",
            **{NAVIGATION_COLOURS[part]: name for part, name in NAVIGATION_PARTS.items()},
        }.items()
    ),
)
GREYS = "White free, grey unknown, black walls; the legend below the map explains the rest."
DETAIL_PX_PER_M = 8.0
"""From this scale on doors can be told apart, and areas written into rooms."""
MOST_LEFT_OUT = 20
WITH_PATH = frozenset({Layer.PATH, Layer.FRONTIERS})


def say_plain(grid: OccupancyGrid, picture: MapPicture) -> str:
    """Return the caption of the map in grey levels and nothing else."""
    return (
        f"{_say_placement(grid, picture)} Grey 127 is unknown, lighter the more surely free, "
        "darker the more surely occupied. x grows to the right and y upwards."
    )


def say_axes(grid: OccupancyGrid, picture: MapPicture) -> str:
    """Return the caption of the map with its axes."""
    return (
        f"{_say_placement(grid, picture)} A grid line every {picture.spacing_m:g} m, numbered in "
        "metres of the map frame; x grows to the right and y upwards."
    )


def _say_placement(grid: OccupancyGrid, picture: MapPicture) -> str:
    view = picture.view
    left, bottom = view.area_corners()[3]
    return (
        f"Map picture, {view.width_px} x {view.height_px} px; the map in it has "
        f"{view.pixels_per_m * grid.resolution_m:g} px per cell of {grid.resolution_m:g} m; "
        f"lower left corner at x {left:.3f}, y {bottom:.3f}."
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldPicture:
    """A drawn world.

    Attributes:
        png: The encoded picture.
        caption: What it shows and at what scale, in words.
    """

    png: bytes
    caption: str


def draw_world(view: MapView) -> WorldPicture:
    """Draw a world model; doors and areas only where they can be told apart."""
    world, look = view.world, view.look
    is_detailed = _scale_px_per_m(world.grid, look) >= DETAIL_PX_PER_M
    doors = view.doors.items if Layer.DOORS in look.layers and is_detailed else ()
    picture = draw_map(
        world.grid,
        layers=MapLayers(
            regions=_rooms_in(view, has_areas=is_detailed) if Layer.ROOMS in look.layers else None,
            zones=_closed_areas(view),
            lines=(
                *_unseen_walls(view),
                *_navigation(view),
                *(_way_to_first_frontier(world) if look.layers >= WITH_PATH else ()),
            ),
            marks=(
                *(_door_mark(door, is_way=bool(world.find_crossing(door))) for door in doors),
                *_frontiers_and_places(view),
            ),
            robot=world.robot,
            legend=LEGEND,
        ),
        up_rad=look.up_rad,
        zoom=look.zoom,
    )
    parts = [_caption(picture)]
    if look.up_rad != NORTH_UP_RAD:
        parts.append(f"Up in the picture is yaw {math.degrees(look.up_rad):.0f} deg, as the robot.")
    if view.navigation:
        parts.append("Costmaps: lines around what the middle of the robot may not touch.")
    if Layer.DOORS in look.layers and not is_detailed:
        parts.append("An overview without doors and areas: zoom in with around and radius_m.")
    return WorldPicture(png=picture.png, caption=" ".join(parts))


def draw_rooms(rooms: RoomMap) -> WorldPicture:
    """Draw a map with its rooms and doors; no robot needs to be there for it."""
    is_detailed = _scale_px_per_m(rooms.grid, MapLook()) >= DETAIL_PX_PER_M
    layers = MapLayers(
        regions=_layer(
            rooms, tuple(_area(region, has_area=is_detailed) for region in rooms.regions)
        ),
        marks=tuple(_door_mark(door) for door in rooms.doors) if is_detailed else (),
        legend=LEGEND,
    )
    picture = draw_map(rooms.grid, layers=layers)
    return WorldPicture(png=picture.png, caption=_caption(picture))


def _scale_px_per_m(grid: OccupancyGrid, look: MapLook) -> float:
    """Return about how large a metre will be in the picture."""
    known = (np.flatnonzero(grid.cells.max(axis=axis, initial=-1) >= 0) for axis in (0, 1))
    n_cells = max(int(along[-1] - along[0]) + 1 if along.size else 1 for along in known)
    shown_m = n_cells * grid.resolution_m
    if look.zoom is not None:
        shown_m = min(shown_m, 2 * look.zoom.radius_m)
    return EDGE_PX / shown_m


def _rooms_in(view: MapView, *, has_areas: bool) -> RegionLayer:
    """Return all regions; only those that are listed have their names written in them."""
    around = view.look.around
    listed = {region.id for region in (*view.rooms.items, *view.corridors.items)}
    areas = tuple(
        _area(
            region,
            has_area=has_areas,
            is_named=region.id in listed,
            is_highlighted=around is not None and around.thing == region,
        )
        for region in view.world.rooms.regions
    )
    drawn = view.world.map.drawn
    layer = drawn.get(areas)
    if layer is None:
        layer = _layer(view.world.rooms, areas)
        drawn.clear()
        drawn[areas] = layer
    return layer


def _layer(rooms: RoomMap, areas: tuple[Area, ...]) -> RegionLayer:
    return RegionLayer(rooms.labels.astype(np.uint16), areas)


def _area(
    region: Region, *, has_area: bool, is_named: bool = True, is_highlighted: bool = False
) -> Area:
    text = f"{region.id} {region.floor_area_m2:.1f} m2" if has_area else region.id
    return Area(
        label=region.index,
        key=int(region.id[1:]),
        text=text if is_named else "",
        is_hatched=region.room_class is RoomClass.CORRIDOR,
        is_dotted=region.room_class is RoomClass.OPEN_SPACE,
        is_highlighted=is_highlighted,
    )


def _door_mark(door: Door, *, is_way: bool = True) -> Mark:
    shape = Shape.SQUARE if is_way else Shape.CROSS
    return Mark(point=door.place, label=door.id, shape=shape, colour=Colour.ORANGE)


def _frontiers_and_places(view: MapView) -> Iterator[Mark]:
    if Layer.FRONTIERS in view.look.layers:
        shape, colour = Shape.TRIANGLE, Colour.VERMILION
        for each in view.frontiers.items:
            yield Mark(point=each.pose.point, label=each.id, shape=shape, colour=colour)
    if Layer.PLACES in view.look.layers:
        for place in view.places.items:
            yield Mark(point=place.waypoint.pose.point, label=place.id, shape=Shape.DIAMOND)


def _closed_areas(view: MapView) -> tuple[Zone, ...]:
    """Return all that is closed; only what is listed has its name written in it."""
    return tuple(
        Zone(outlines=area.outlines, label=say_area(area) if area in view.closed.items else "")
        for area in view.world.map.areas
    )


def _way_to_first_frontier(world: WorldModel) -> tuple[Line, ...]:
    if not world.frontiers.frontiers:
        return ()
    way = world.distances.way_to(world.frontiers.frontiers[0].pose.point)
    return () if way is None or len(way) < 2 else (Line(points=way, style=LineStyle.DASHED),)


def _unseen_walls(view: MapView) -> tuple[Line, ...]:
    unseen = () if view.unseen is None else view.unseen.lines
    return tuple(
        Line(points=tuple(Point(x, y) for x, y in line.tolist()), colour=Colour.PURPLE, width_px=5)
        for line in unseen
    )


def _navigation(view: MapView) -> tuple[Line, ...]:
    return tuple(
        Line(
            points=line,
            colour=NAVIGATION_COLOURS[look.part],
            is_over_robot=look.part is NavigationPart.FOOTPRINT,
        )
        for look in view.navigation or ()
        for line in look.lines
        if len(line) > 1
    )


def _caption(picture: MapPicture) -> str:
    view = picture.view
    corners = view.area_corners()
    low, high = corners.min(axis=0), corners.max(axis=0)
    size = f"{view.width_px} x {view.height_px} px, {view.pixels_per_m:.1f} px per metre"
    parts = [
        f"Picture: {size}, x {low[0]:.1f} to {high[0]:.1f}, y {low[1]:.1f} to {high[1]:.1f}.",
        GREYS,
    ]
    if picture.spacing_m is not None:
        parts.append(f"A grid line every {picture.spacing_m:g} m.")
    if picture.labels_left_out:
        left_out = list_some(picture.labels_left_out, most=MOST_LEFT_OUT)
        parts.append(f"No room in the picture for: {left_out}.")
    return " ".join(parts)
