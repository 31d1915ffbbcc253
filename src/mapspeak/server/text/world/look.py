"""The way to look at a map: its part, its direction up, and its layers."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Generic, Self, TypeVar

import numpy as np

from mapspeak.driving.exploration.camera import measure_pictured_on
from mapspeak.driving.exploration.progress import find_refused
from mapspeak.geometry import Point
from mapspeak.places.naming import Place
from mapspeak.places.relations.choosing import find_place
from mapspeak.robot import NavigationLook
from mapspeak.spatial.fieldofview import CameraView, mask_pictured, outline_unpictured
from mapspeak.spatial.frontiers import Frontier, RefusedFrontier
from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.picture import NORTH_UP_RAD, Zoom
from mapspeak.spatial.rooms import Door, Region, RoomClass
from mapspeak.worldmodel.keepout import ClosedArea
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedPlace

Item = TypeVar("Item")

MOST_ROOMS = 40
MOST_CORRIDORS = 12
MOST_DOORS = 40
MOST_FRONTIERS = 10
MOST_PLACES = 30
MOST_REFUSED = 5
MOST_CLOSED = 20
SLACK = 1.25
AROUND_M = 5.0
"""Size of the view around a place that has no size of its own."""
RIM_M = 1.0
MOST_SAMPLES = 200
"""Points along the side of a turned square with which its content is found."""


class Layer(StrEnum):
    """The layers of a map, in picture and text alike."""

    ROOMS = "rooms"
    DOORS = "doors"
    FRONTIERS = "frontiers"
    PLACES = "places"
    PATH = "path"
    UNSEEN = "unseen"
    """The walls that no picture shows; only on request."""
    NAVIGATION = "navigation"
    """Path, footprint and costmaps of the robot's own navigation; only on request."""


USUAL_LAYERS = frozenset(Layer) - {Layer.UNSEEN, Layer.NAVIGATION}


class Up(StrEnum):
    """The direction that points up in the picture."""

    NORTH = "north"
    ROBOT = "robot"


@dataclass(frozen=True, slots=True, kw_only=True)
class MapLook:
    """A way to look at a world model.

    Attributes:
        layers: The layers to draw and list.
        up_rad: The direction in the map that points up in the picture.
        zoom: The square that is shown; None for all that is known.
        around: The place in its middle; None without a zoom.
    """

    layers: frozenset[Layer] = USUAL_LAYERS
    up_rad: float = NORTH_UP_RAD
    zoom: Zoom | None = None
    around: Place | None = None

    def shows(self, point: Point) -> bool:
        """Return True when a point lies in the square that is shown."""
        if self.zoom is None:
            return True
        away_m = self.zoom.centre.distance_to(point)
        turned_rad = self.zoom.centre.bearing_to(point) - self.up_rad
        farthest_m = away_m * max(abs(math.cos(turned_rad)), abs(math.sin(turned_rad)))
        return farthest_m <= self.zoom.radius_m

    def regions(self, world: WorldModel) -> tuple[Region, ...]:
        """Return the regions of which some is shown."""
        if self.zoom is None:
            return world.rooms.regions
        shown = _labels_in(world, self.zoom, self.up_rad)
        return tuple(region for region in world.rooms.regions if region.index in shown)

    def some_of(self, items: Iterable[Item], point_of: Callable[[Item], Point]) -> list[Item]:
        """Return those that lie in the square that is shown."""
        return [item for item in items if self.shows(point_of(item))]


@dataclass(frozen=True, slots=True)
class MapPart(Generic[Item]):
    """As many things of a kind as are shown, and how many there are.

    Attributes:
        items: In the order in which they are listed.
        n_all: How many would be shown if there were room for all.
        gap_after: The number of items before the omitted ones; None for at the end.
    """

    items: tuple[Item, ...]
    n_all: int
    gap_after: int | None = None

    @classmethod
    def first(cls, items: Sequence[Item], most: int) -> Self:
        """Return the first of some things; leaving out a few is not worth the words."""
        n = len(items) if len(items) <= SLACK * most else most
        return cls(tuple(items[:n]), len(items))

    @classmethod
    def ends(cls, items: Sequence[Item], most: int, *, nearest: Item | None = None) -> Self:
        """Return things from both ends of a list that is too long, and the nearest one."""
        if len(items) <= SLACK * most:
            return cls(tuple(items), len(items))
        half = most // 2
        between = [item for item in items[half:-half] if item is nearest]
        return cls((*items[:half], *between, *items[-half:]), len(items), gap_after=half)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class UnseenWalls:
    """The walls that no picture shows.

    Attributes:
        lines: Along them, each of shape (n, 2), in metres.
        pictured_ratio: The share that pictures show of the walls in sight of the floor in reach.
    """

    lines: Sequence[FloatArray]
    pictured_ratio: float


@dataclass(frozen=True, slots=True, kw_only=True)
class MapView:
    """The shown part of a world model: picture and text show the same.

    Attributes:
        world: All there is.
        look: How it is looked at.
        rooms: With open spaces, smallest first; of very many both ends and the nearest.
        corridors: In the same way.
        doors: Nearest first.
        frontiers: Best first.
        refused: Borders with the unknown that are not offered, longest first.
        places: Remembered ones, nearest first.
        closed: Areas that are closed to the robot now, in the order of the policy.
        unseen: Walls that no picture shows; None where not asked for.
        navigation: What the robot's navigation tells of itself; None where not asked for.
    """

    world: WorldModel
    look: MapLook
    rooms: MapPart[Region]
    corridors: MapPart[Region]
    doors: MapPart[Door]
    frontiers: MapPart[Frontier]
    refused: MapPart[RefusedFrontier]
    places: MapPart[RememberedPlace]
    closed: MapPart[ClosedArea]
    unseen: UnseenWalls | None = None
    navigation: Sequence[NavigationLook] | None = None


def view_of(
    world: WorldModel,
    look: MapLook,
    pictures: Sequence[CameraView] = (),
    navigation: Sequence[NavigationLook] | None = None,
) -> MapView:
    """Return the shown part of a world model.

    Args:
        pictures: Where pictures of this map were taken.
        navigation: What the robot's navigation told last, where that was asked.
    """

    def path_or_far(point: Point | None) -> float:
        path_m = None if point is None else world.path_m(point)
        return math.inf if path_m is None else path_m

    by_size = sorted(look.regions(world), key=lambda region: region.floor_area_m2)
    corridors = [region for region in by_size if region.room_class is RoomClass.CORRIDOR]
    rooms = [region for region in by_size if region.room_class is not RoomClass.CORRIDOR]
    doors = look.some_of(world.rooms.doors, lambda door: door.place)
    places = look.some_of(world.places, lambda place: place.waypoint.pose.point)
    frontiers = look.some_of(world.frontiers.frontiers, lambda each: each.pose.point)
    return MapView(
        world=world,
        look=look,
        rooms=MapPart.ends(
            rooms,
            MOST_ROOMS,
            nearest=min(rooms, key=lambda room: path_or_far(room.widest), default=None),
        ),
        corridors=MapPart.ends(corridors, MOST_CORRIDORS),
        doors=MapPart.first(
            sorted(doors, key=lambda door: path_or_far(world.find_crossing(door))), MOST_DOORS
        ),
        frontiers=MapPart(choose_frontiers(frontiers, MOST_FRONTIERS), len(frontiers)),
        refused=MapPart.first(
            look.some_of(find_refused(world), lambda border: border.anchor), MOST_REFUSED
        ),
        places=MapPart.first(
            sorted(places, key=lambda place: path_or_far(place.waypoint.pose.point)), MOST_PLACES
        ),
        closed=MapPart.first(
            [area for area in world.map.areas if _shows_some(look, area)], MOST_CLOSED
        ),
        unseen=_find_unseen(world, pictures) if Layer.UNSEEN in look.layers else None,
        navigation=navigation,
    )


def _find_unseen(world: WorldModel, pictures: Sequence[CameraView]) -> UnseenWalls:
    return UnseenWalls(
        lines=outline_unpictured(world.grid, mask_pictured(world.grid, pictures)),
        pictured_ratio=measure_pictured_on(world, pictures),
    )


def choose_frontiers(frontiers: Sequence[Frontier], most: int) -> tuple[Frontier, ...]:
    """Return the best ones, with the nearest and the one that shows most wherever these stand."""
    if len(frontiers) <= SLACK * most:
        return tuple(frontiers)
    named = find_extremes(frontiers)
    return tuple(each for i, each in enumerate(frontiers) if i < most or each in named)


def find_extremes(frontiers: Sequence[Frontier]) -> tuple[Frontier, Frontier]:
    """Return the nearest frontier and the one that shows most."""
    nearest = min(frontiers, key=lambda each: each.distance_m)
    return nearest, max(frontiers, key=lambda each: each.gain_m2)


def _shows_some(look: MapLook, area: ClosedArea) -> bool:
    """Return True when some of an area may lie in the square that is shown."""
    if look.zoom is None:
        return True
    farthest_m = look.zoom.radius_m * math.sqrt(2)
    return area.distance_to(look.zoom.centre) <= farthest_m


def look_at(
    world: WorldModel,
    *,
    layers: Iterable[Layer] | None,
    around: str | None,
    radius_m: float | None,
    up: Up,
) -> MapLook:
    """Return the look that was asked for; around a region it is large enough for all of it.

    Raises:
        GoalError: There is no such place.
    """
    chosen = USUAL_LAYERS if layers is None else frozenset(layers)
    up_rad = world.robot.yaw_rad if up is Up.ROBOT else NORTH_UP_RAD
    if around is None and radius_m is None:
        return MapLook(layers=chosen, up_rad=up_rad)
    place = find_place(world, "robot" if around is None else around)
    zoom = _zoom_on(world, place)
    if radius_m is not None:
        zoom = Zoom(centre=zoom.centre, radius_m=radius_m)
    return MapLook(layers=chosen, up_rad=up_rad, zoom=zoom, around=place)


def _zoom_on(world: WorldModel, place: Place) -> Zoom:
    if not isinstance(place.thing, Region):
        return Zoom(centre=place.point, radius_m=AROUND_M)
    rows, cols = world.rooms.window_of(place.thing)
    grid = world.grid.crop(rows, cols)
    is_inside = world.rooms.labels[rows, cols] == place.thing.index
    points = grid.points_at(*np.nonzero(is_inside))
    low, high = points.min(axis=0), points.max(axis=0)
    middle = (low + high) / 2
    half_m = np.hypot(*(points - middle).T).max()
    return Zoom(centre=Point(*middle.tolist()), radius_m=float(half_m) + RIM_M)


def _labels_in(world: WorldModel, zoom: Zoom, up_rad: float) -> frozenset[int]:
    steps = np.linspace(-zoom.radius_m, zoom.radius_m, MOST_SAMPLES)
    along, across = (each.ravel() for each in np.meshgrid(steps, steps))
    cos, sin = math.cos(up_rad), math.sin(up_rad)
    points = np.stack(
        [zoom.centre.x + cos * along - sin * across, zoom.centre.y + sin * along + cos * across],
        axis=1,
    )
    rows, cols = world.grid.cells_at(points)
    labels = world.rooms.labels
    inside = (rows >= 0) & (rows < labels.shape[0]) & (cols >= 0) & (cols < labels.shape[1])
    return frozenset(np.unique(labels[rows[inside], cols[inside]]).tolist())
