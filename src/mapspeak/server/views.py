"""Which part of the map is looked at, which way up, and what of it is shown."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeVar

import numpy as np

from mapspeak.geometry import Point
from mapspeak.navigation.atlas import Atlas
from mapspeak.navigation.places import Place, find_place
from mapspeak.spatial.picture import NORTH_UP_RAD, Zoom
from mapspeak.spatial.rooms import Region

__all__ = ["Layer", "MapLook", "Up", "look_at"]

Item = TypeVar("Item")

AROUND_M = 5.0
"""So much is shown around a place that has no size of its own."""
RIM_M = 1.0
MOST_SAMPLES = 200
"""What lies in a turned square is found by so many points along its side."""


class Layer(StrEnum):
    """What can be shown of a map, in picture and text alike."""

    ROOMS = "rooms"
    DOORS = "doors"
    FRONTIERS = "frontiers"
    PLACES = "places"
    PATH = "path"


class Up(StrEnum):
    """What points up in the picture."""

    NORTH = "north"
    ROBOT = "robot"


@dataclass(frozen=True, slots=True, kw_only=True)
class MapLook:
    """A way to look at an atlas.

    Attributes:
        layers: What is drawn and listed.
        up_rad: The direction in the map that points up in the picture.
        zoom: The square that is shown; None for all that is known.
        around: What is in its middle; None without a zoom.
    """

    layers: frozenset[Layer] = frozenset(Layer)
    up_rad: float = NORTH_UP_RAD
    zoom: Zoom | None = None
    around: Place | None = None

    def shows(self, point: Point) -> bool:
        """True when a point lies in the square that is shown."""
        if self.zoom is None:
            return True
        away_m, bearing_rad = _polar(self.zoom.centre, point)
        turned_rad = bearing_rad - self.up_rad
        farthest_m = away_m * max(abs(math.cos(turned_rad)), abs(math.sin(turned_rad)))
        return farthest_m <= self.zoom.radius_m

    def regions(self, atlas: Atlas) -> tuple[Region, ...]:
        """Gives the regions of which some is shown."""
        if self.zoom is None:
            return atlas.rooms.regions
        shown = _labels_in(atlas, self.zoom, self.up_rad)
        return tuple(region for region in atlas.rooms.regions if region.index in shown)

    def some_of(self, items: Iterable[Item], point_of: Callable[[Item], Point]) -> tuple[Item, ...]:
        """Gives those that lie in the square that is shown."""
        return tuple(item for item in items if self.shows(point_of(item)))


def look_at(
    atlas: Atlas,
    *,
    layers: Iterable[Layer] | None,
    around: str | None,
    radius_m: float | None,
    up: Up,
) -> MapLook:
    """Gives the look that was asked for; around a region it is large enough for all of it.

    Raises:
        GoalError: There is no such place.
    """
    chosen = frozenset(Layer if layers is None else layers)
    up_rad = atlas.robot.yaw_rad if up is Up.ROBOT else NORTH_UP_RAD
    if around is None and radius_m is None:
        return MapLook(layers=chosen, up_rad=up_rad)
    place = find_place(atlas, around or "robot")
    zoom = _zoom_on(atlas, place)
    if radius_m is not None:
        zoom = Zoom(centre=zoom.centre, radius_m=radius_m)
    return MapLook(layers=chosen, up_rad=up_rad, zoom=zoom, around=place)


def _zoom_on(atlas: Atlas, place: Place) -> Zoom:
    if not isinstance(place.thing, Region):
        return Zoom(centre=place.point, radius_m=AROUND_M)
    rows, cols = atlas.rooms.window_of(place.thing)
    grid = atlas.grid.crop(rows, cols)
    is_inside = atlas.rooms.labels[rows, cols] == place.thing.index
    points = grid.points_at(*np.nonzero(is_inside))
    low, high = points.min(axis=0), points.max(axis=0)
    middle = (low + high) / 2
    half_m = np.hypot(*(points - middle).T).max()
    return Zoom(centre=Point(*middle.tolist()), radius_m=float(half_m) + RIM_M)


def _labels_in(atlas: Atlas, zoom: Zoom, up_rad: float) -> frozenset[int]:
    steps = np.linspace(-zoom.radius_m, zoom.radius_m, MOST_SAMPLES)
    along, across = (each.ravel() for each in np.meshgrid(steps, steps))
    cos, sin = math.cos(up_rad), math.sin(up_rad)
    points = np.stack(
        [zoom.centre.x + cos * along - sin * across, zoom.centre.y + sin * along + cos * across],
        axis=1,
    )
    rows, cols = atlas.grid.cells_at(points)
    labels = atlas.rooms.labels
    inside = (rows >= 0) & (rows < labels.shape[0]) & (cols >= 0) & (cols < labels.shape[1])
    return frozenset(np.unique(labels[rows[inside], cols[inside]]).tolist())


def _polar(centre: Point, point: Point) -> tuple[float, float]:
    return centre.distance_to(point), centre.bearing_to(point)
