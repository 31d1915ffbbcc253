"""An atlas as a picture: rooms, doors, frontiers, places and the robot, under their ids."""

import math
from dataclasses import dataclass

import numpy as np

from mapspeak.navigation.atlas import Atlas
from mapspeak.server.views import Layer, MapLook
from mapspeak.server.wording import list_some
from mapspeak.spatial.picture import (
    NORTH_UP_RAD,
    Colour,
    Line,
    LineStyle,
    MapLayers,
    MapPicture,
    Mark,
    RegionLayer,
    Shape,
    draw_map,
)
from mapspeak.spatial.picture import Region as Area
from mapspeak.spatial.rooms import Region, RoomClass, RoomMap

__all__ = ["AtlasPicture", "draw_atlas", "draw_rooms"]

LEGEND = (
    "White free, grey unknown, black walls; coloured floors are rooms, hatched ones corridors; "
    "square door, triangle frontier, diamond remembered place, arrow robot, dashed line the way to "
    "the best frontier, ring the origin."
)

MOST_LEFT_OUT = 20
WITH_PATH = frozenset({Layer.PATH, Layer.FRONTIERS})


@dataclass(frozen=True, slots=True, kw_only=True)
class AtlasPicture:
    """A drawn atlas.

    Attributes:
        png: The encoded picture.
        caption: What it shows and at what scale, in words.
    """

    png: bytes
    caption: str


def draw_atlas(atlas: Atlas, look: MapLook) -> AtlasPicture:
    """Draws an atlas as it is looked at."""
    layers = look.layers
    picture = draw_map(
        atlas.grid,
        layers=MapLayers(
            regions=_rooms(atlas.rooms) if Layer.ROOMS in layers else None,
            lines=_path_to_first_frontier(atlas) if layers >= WITH_PATH else (),
            marks=(
                *(_doors(atlas.rooms) if Layer.DOORS in layers else ()),
                *(_frontiers(atlas) if Layer.FRONTIERS in layers else ()),
                *(_places(atlas) if Layer.PLACES in layers else ()),
            ),
            robot=atlas.robot,
        ),
        up_rad=look.up_rad,
        zoom=look.zoom,
    )
    caption = _caption(picture)
    if look.up_rad != NORTH_UP_RAD:
        caption += f" Up in the picture is yaw {math.degrees(look.up_rad):.0f} deg, as the robot."
    return AtlasPicture(png=picture.png, caption=caption)


def draw_rooms(rooms: RoomMap) -> AtlasPicture:
    """Draws a map with its rooms and doors; no robot needs to be there for it."""
    layers = MapLayers(regions=_rooms(rooms), marks=_doors(rooms))
    picture = draw_map(rooms.grid, layers=layers)
    return AtlasPicture(png=picture.png, caption=_caption(picture))


def _rooms(rooms: RoomMap) -> RegionLayer:
    areas = tuple(_area(region) for region in rooms.regions)
    return RegionLayer(rooms.labels.astype(np.uint16), areas)


def _area(region: Region) -> Area:
    return Area(
        label=region.index,
        text=f"{region.id} {region.floor_area_m2:.1f} m2",
        is_hatched=region.room_class is RoomClass.CORRIDOR,
    )


def _doors(rooms: RoomMap) -> tuple[Mark, ...]:
    return tuple(
        Mark(point=door.place, label=door.id, shape=Shape.SQUARE, colour=Colour.ORANGE)
        for door in rooms.doors
    )


def _frontiers(atlas: Atlas) -> tuple[Mark, ...]:
    return tuple(
        Mark(
            point=frontier.pose.point,
            label=frontier.id,
            shape=Shape.TRIANGLE,
            colour=Colour.VERMILION,
        )
        for frontier in atlas.frontiers.frontiers
    )


def _places(atlas: Atlas) -> tuple[Mark, ...]:
    return tuple(
        Mark(
            point=place.waypoint.pose.point,
            label=place.id,
            shape=Shape.DIAMOND,
            colour=Colour.BLUE,
        )
        for place in atlas.places
    )


def _path_to_first_frontier(atlas: Atlas) -> tuple[Line, ...]:
    if not atlas.frontiers.frontiers:
        return ()
    path = atlas.distances.path_to(atlas.frontiers.frontiers[0].pose.point)
    if path is None or len(path.points) < 2:
        return ()
    return (Line(points=path.points, style=LineStyle.DASHED),)


def _caption(picture: MapPicture) -> str:
    view = picture.view
    corners = view.area_corners()
    low, high = corners.min(axis=0), corners.max(axis=0)
    size = f"{view.width_px} x {view.height_px} px, {view.pixels_per_m:.1f} px per metre"
    parts = [
        f"Picture: {size}, x {low[0]:.1f} to {high[0]:.1f}, y {low[1]:.1f} to {high[1]:.1f}.",
        LEGEND,
    ]
    if picture.spacing_m is not None:
        parts.append(f"A grid line every {picture.spacing_m:g} m.")
    if picture.labels_left_out:
        left_out = list_some(picture.labels_left_out, most=MOST_LEFT_OUT)
        parts.append(f"No room in the picture for: {left_out}.")
    return " ".join(parts)
