"""The nearest thing of a kind, by path."""

import math
from collections.abc import Iterator

import numpy as np

from mapspeak.places.naming import Place
from mapspeak.places.relations.phrases import Kind
from mapspeak.places.relations.referent import Referent
from mapspeak.places.relations.stand import refuse
from mapspeak.spatial.paths import DistanceField
from mapspeak.spatial.rooms import Region, RoomClass
from mapspeak.worldmodel.model import Atlas

__all__ = ["find_all_near", "find_nearest"]

CLASSES = {
    Kind.CORRIDOR: RoomClass.CORRIDOR,
    Kind.ROOM: RoomClass.ROOM,
    Kind.OPEN_SPACE: RoomClass.OPEN_SPACE,
}


def find_nearest(atlas: Atlas, kind: Kind, start: Referent | None) -> Place:
    """Finds the thing of a kind that is nearest to the robot or to a place, by path.

    Raises:
        GoalError: None can be reached.
    """
    distances = atlas.distances if start is None else atlas.map.distances_from(start.anchor)
    own = None if start is None else (start.region or start.door)
    found = [each for each in _sort(atlas, kind, distances) if each[1].thing is not own]
    if not found:
        raise refuse(_say_none(atlas, kind))
    away_m, place = found[0]
    who = "the robot" if start is None else start.name
    is_in = place.name == atlas.find_room_id(distances.start)
    where = f"{who} is in it" if is_in else f"{away_m:.1f} m by path from {who}"
    return Place(place.name, place.thing, f"the nearest {kind}, {where}")


def find_all_near(atlas: Atlas, kind: Kind) -> tuple[Place, ...]:
    """Finds all things of a kind that the robot can get to, nearest first."""
    return tuple(place for _, place in _sort(atlas, kind, atlas.distances))


def _sort(atlas: Atlas, kind: Kind, distances: DistanceField) -> list[tuple[float, Place]]:
    found = (each for each in _all_of(atlas, kind, distances) if math.isfinite(each[0]))
    return sorted(found, key=lambda each: each[0])


def _all_of(atlas: Atlas, kind: Kind, distances: DistanceField) -> Iterator[tuple[float, Place]]:
    match kind:
        case Kind.FRONTIER:
            for frontier in atlas.frontiers.frontiers:
                away_m = distances.distance_to(frontier.pose.point)
                yield math.inf if away_m is None else away_m, Place(frontier.id, frontier)
        case Kind.DOOR:
            for door in atlas.rooms.doors:
                crossing = atlas.find_crossing(door)
                away_m = None if crossing is None else distances.distance_to(crossing)
                yield math.inf if away_m is None else away_m, Place(door.id, door)
        case Kind.REMEMBERED:
            for remembered in atlas.places:
                away_m = distances.distance_to(remembered.waypoint.pose.point)
                yield math.inf if away_m is None else away_m, Place(remembered.id, remembered)
        case _:
            for region in atlas.rooms.regions:
                if region.room_class is CLASSES[kind]:
                    yield _least_m(atlas, region, distances), Place(region.id, region)


def _least_m(atlas: Atlas, region: Region, distances: DistanceField) -> float:
    """Gives the metres by path to the nearest floor of a region."""
    window = atlas.rooms.window_of(region)
    rows, cols = np.nonzero(atlas.rooms.labels[window] == region.index)
    reached_m = distances.distances_at(rows + window[0].start, cols + window[1].start)
    return float(reached_m.min(initial=np.inf))


def _say_none(atlas: Atlas, kind: Kind) -> str:
    if kind is Kind.FRONTIER:
        return f"There is no frontier to go to: {atlas.frontiers.sentence}"
    return f"There is no {kind} that the robot can get to."
