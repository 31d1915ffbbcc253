"""What a relation relates to: a point, a door, a wall or a room, from the words inside a phrase."""

import math
import re
from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from mapspeak.errors import GoalError, NextStep
from mapspeak.geometry import Point, Pose
from mapspeak.memory import name_key
from mapspeak.places.goalcheck import FARTHEST_M
from mapspeak.places.naming import (
    MOST_NAMED,
    AmbiguousPlaceError,
    Place,
    Spot,
    find_named,
    say_spot,
)
from mapspeak.places.relations.grammar import Superlative, parse_relation
from mapspeak.places.relations.outlines import find_sides
from mapspeak.places.relations.placement import refuse
from mapspeak.places.relations.vocabulary import GAP, Side, pattern, plain, read_heading
from mapspeak.places.standing import point_ahead
from mapspeak.places.things import find_place_ids, find_things, find_things_seen, list_pictures
from mapspeak.places.ways import standing_point
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.rooms import Door, Region, RoomClass
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedPlace, RememberedThing

ROBOT = "the robot"
AROUND_DOOR_M = 0.6
"""Floor within this distance on both sides of a door tells which way it leads."""
AROUND_THING_M = 1.5
BOTH_SIDES_M = 0.2
"""A thing whose distances to two regions differ by less belongs to neither."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Referent:
    """A thing as relations see it; compared by identity.

    Attributes:
        extent: Points over all of it, in metres, shape (n, 2).
        place: Of what is a place of its own; None for a corner, a wall and what words relate.
        home: The region to stand in beside it; None where any will do.
        front_rad: Where its own front looks; None where it has none.
    """

    name: str
    anchor: Point
    extent: FloatArray = field(repr=False)
    place: Place | None = None
    home: Region | None = None
    region: Region | None = None
    door: Door | None = None
    front_rad: float | None = None

    @property
    def is_point(self) -> bool:
        """True of what has no extent."""
        return len(self.extent) == 1


def refer_to(world: WorldModel, place: Place) -> Referent:
    """Return a place as something to relate to.

    Raises:
        GoalError: It lies farther away than any map reaches.
    """
    return replace(_refer_to(world, place), place=place)


def stands_at(world: WorldModel, thing: Referent) -> Point:
    """Return the point from which ways to a thing are measured."""
    return thing.anchor if thing.place is None else standing_point(world, thing.place)


def _refer_to(world: WorldModel, place: Place) -> Referent:
    match place.thing:
        case Spot(point=point) if max(abs(point.x), abs(point.y)) > FARTHEST_M:
            raise refuse(f"{place.name} lies farther away than any map reaches.")
        case Region() as region:
            return _refer_to_region(world, region)
        case Door() as door:
            return refer_to_door(world, door, find_near_side(world, door))
        case RememberedPlace(id=place_id, waypoint=waypoint):
            name = place.name if place.name == place_id else f"{place_id} ({place.name})"
            return refer_to_point(world, name, waypoint.pose.point, front_rad=waypoint.pose.yaw_rad)
        case RememberedThing(id=thing_id, thing=thing) as remembered:
            rooms = [world.rooms.region(each) for each in world.rooms_before(remembered)]
            home = rooms[0] if len(rooms) == 1 else None
            name = f"{thing.label} ({thing_id}, seen from {_say_seen_from(world, remembered)})"
            return refer_to_point(world, name, remembered.point, home=home)
        case Frontier(pose=pose):
            return refer_to_point(world, place.name, pose.point)
        case Spot(point=point, yaw_rad=yaw_rad):
            name = ROBOT if place.name == "robot" else place.name
            return refer_to_point(world, name, point, front_rad=yaw_rad)


def _say_seen_from(world: WorldModel, remembered: RememberedThing) -> str:
    if remembered.is_reported:
        return f"pictures {list_pictures(remembered)}"
    return " and ".join(find_place_ids(world, remembered.thing.waypoints))


def refer_to_point(
    world: WorldModel,
    name: str,
    point: Point,
    *,
    front_rad: float | None = None,
    home: Region | None = None,
) -> Referent:
    """Return a point as something to relate to."""
    return Referent(
        name=name,
        anchor=point,
        extent=np.array([[point.x, point.y]]),
        home=home or world.rooms.find_region_at(point) or _find_region_around(world, point),
        front_rad=front_rad,
    )


def _find_region_around(world: WorldModel, point: Point) -> Region | None:
    """Find the region that a thing stands in; None for what is in a wall between two."""
    offsets, labels = _offsets(world, world.rooms.labels, point, AROUND_THING_M)
    if not labels.size:
        return None
    away_m = np.hypot(*offsets.T)
    indices = np.unique(labels[away_m <= away_m.min() + BOTH_SIDES_M])
    return next((each for each in world.rooms.regions if [each.index] == indices.tolist()), None)


def find_normal(world: WorldModel, door: Door, side: Region) -> float:
    """Return the direction in which a door leads into one of its two regions, as a yaw.

    It is at right angles to the line through its two posts where the floor near it shows no other.
    """
    reach_m = door.width_m / 2 + AROUND_DOOR_M
    offsets, labels = _offsets(world, world.rooms.labels, door.place, reach_m)
    is_near = np.hypot(*offsets.T) <= reach_m
    middles = []
    for region in (side, other_side(world, door, side)):
        near = offsets[is_near & (labels == region.index)]
        middles.append(near.mean(axis=0) if len(near) else np.zeros(2))
    into = middles[0] - middles[1]
    return _squared(world, door, math.atan2(float(into[1]), float(into[0])))


def _offsets(
    world: WorldModel, values: np.ndarray, centre: Point, reach_m: float
) -> tuple[FloatArray, np.ndarray]:
    """Return where cells that are not 0 lie from a point, in metres, and their values."""
    window = world.grid.window_around(centre, reach_m)
    rows, cols = np.nonzero(values[window])
    points = world.grid.points_at(rows + window[0].start, cols + window[1].start)
    return points - np.array([centre.x, centre.y]), values[window][rows, cols]


def other_side(world: WorldModel, door: Door, side: Region) -> Region:
    """Return the region beyond a door."""
    return world.rooms.region(next(each for each in door.region_ids if each != side.id))


def point_before(world: WorldModel, door: Door, side: Region) -> Point:
    """Return the point before a door on one side, as far off as the robot is wide on one side."""
    return point_ahead(door.place, find_normal(world, door, side), world.radius_m)


def _squared(world: WorldModel, door: Door, rough_rad: float) -> float:
    """Turn a direction through a door until the posts beside it lie square to it."""
    reach_m = door.width_m / 2 + AROUND_DOOR_M
    points, _ = _offsets(world, world.grid.occupied, door.place, reach_m)
    across = np.array([-math.sin(rough_rad), math.cos(rough_rad)])
    posts = []
    for sign in (1.0, -1.0):
        beside = points[(points @ (sign * across)) > 0.5 * np.hypot(*points.T)]
        if not len(beside):
            return rough_rad
        posts.append(beside[int(np.argmin(np.hypot(*beside.T)))])
    line = posts[0] - posts[1]
    square_rad = math.atan2(float(line[1]), float(line[0])) - math.pi / 2
    off_rad = math.remainder(square_rad - rough_rad, math.tau)
    return math.remainder(square_rad, math.tau) if abs(off_rad) < math.pi / 4 else rough_rad


def _refer_to_region(world: WorldModel, region: Region) -> Referent:
    window = world.rooms.window_of(region)
    inside = (world.rooms.labels[window] == region.index).astype(np.uint8)
    edges, _ = cv2.findContours(np.pad(inside, 1), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cells = np.concatenate(edges)[:, 0, :] - 1
    extent = world.grid.points_at(cells[:, 1] + window[0].start, cells[:, 0] + window[1].start)
    _, middle = find_sides(world, region)
    return Referent(name=region.id, anchor=middle, extent=extent, region=region)


def refer_to_door(world: WorldModel, door: Door, near: Region, *, name: str = "") -> Referent:
    """Return a door as seen from one of its sides."""
    half = door.width_m / 2
    across = Pose(door.place.x, door.place.y, find_normal(world, door, near))
    points = [across.transform(Point(0.0, half * share)) for share in np.linspace(-1.0, 1.0, 9)]
    extent = np.array([[point.x, point.y] for point in points])
    return Referent(name=name or door.id, anchor=door.place, extent=extent, home=near, door=door)


def find_near_side(world: WorldModel, door: Door) -> Region:
    """Return the region of a door on whose side the robot comes to it."""
    sides = [world.rooms.region(region_id) for region_id in door.region_ids]
    here = world.find_room_id(world.robot.point)
    standing = next((side for side in sides if side.id == here), None)
    if standing is not None:
        return standing

    def path_m(side: Region) -> float:
        ahead_m = world.radius_m + AROUND_DOOR_M
        found_m = world.path_m(point_ahead(door.place, find_normal(world, door, side), ahead_m))
        return math.inf if found_m is None else found_m

    return min(sides, key=path_m)


ROOM = pattern(r"(?:(?P<here>this|current|same) )?(?P<noun>room|corridor|hallway|open space|area)")
CLASSES = {
    "room": (RoomClass.ROOM, RoomClass.OPEN_SPACE),
    "corridor": (RoomClass.CORRIDOR,),
    "hallway": (RoomClass.CORRIDOR,),
}
"""What a word may be said of; other words of all."""
DOOR = pattern(
    r"(?:(?P<side>left|right)(?: hand)? )?(?:door|doorway)"
    r"(?: (?:between (?P<one>.+?) and (?P<other>.+)|(?:of|in|to) (?P<room>.+)))?"
)
OF_PLACE = pattern(r"(?P<label>.+?) (?:of|at|seen from|from) (?P<place>.+)")


def find_known(world: WorldModel, words: str) -> Referent | None:
    """Find what is called so, without reading any relation in it; None where nothing is.

    Raises:
        GoalError: Several things have that name, or the thing's position is unknown.
    """
    for wanted in dict.fromkeys((words.strip(), plain(words))):
        place = find_named(world, wanted) or _find_loosely(world, wanted)
        if place is not None:
            return refer_to(world, place)
    wanted = plain(words)
    place = find_by_kind(world, wanted)
    if place is not None:
        return refer_to(world, place)
    return None if isinstance(parse_relation(wanted), Superlative) else _find_thing(world, wanted)


def find_by_kind(world: WorldModel, words: str) -> Place | None:
    """Find "the room", "the corridor" and "the door", where only one can be meant.

    Raises:
        GoalError: Several can be meant, or none.
    """
    wanted = plain(words)
    if (match := ROOM.fullmatch(wanted)) is not None:
        room = _find_room(world, match)
        return Place(room.id, room)
    return _find_only_door(world, wanted)


def find_room_here(world: WorldModel) -> Region:
    """Return the region that the robot stands in.

    Raises:
        GoalError: It stands in none.
    """
    region = world.rooms.find_region_at(world.robot.point)
    if region is None:
        raise GoalError("The robot stands in no room.", hint="Name the room by its id, such as R1.")
    return region


def _find_room(world: WorldModel, match: re.Match[str]) -> Region:
    """Return the room that "the room" means: where the robot stands, or the only one there is."""
    classes = CLASSES.get(match["noun"].casefold(), tuple(RoomClass))
    here = world.rooms.find_region_at(world.robot.point)
    if here is not None and here.room_class in classes:
        return here
    others = [each for each in world.rooms.regions if each.room_class in classes]
    if len(others) == 1 and not match["here"]:
        return others[0]
    where = "no room" if here is None else here.id
    ids = ", ".join(each.id for each in others[:MOST_NAMED]) or "none known"
    raise AmbiguousPlaceError(
        f"The robot stands in {where}; which {match['noun']} is meant?",
        hint=f"Say it by its id: {ids}.",
        words=match[0],
        meanings=[each.id for each in others],
    )


def _loose_key(name: str) -> str:
    return name_key(re.sub(GAP, " ", name))


def _find_loosely(world: WorldModel, wanted: str) -> Place | None:
    """Find a remembered name, spelt with underscores or hyphens instead of spaces."""
    key = _loose_key(wanted)
    names = {each.waypoint.name for each in world.places if _loose_key(each.waypoint.name) == key}
    return find_named(world, names.pop()) if len(names) == 1 else None


def _find_thing(world: WorldModel, wanted: str) -> Referent | None:
    """Find a thing that was seen from remembered places, with "seen from W1" or without."""
    called = find_things_seen(world, re.sub(GAP, " ", wanted))
    match = OF_PLACE.fullmatch(wanted)
    if not called and match is not None:
        by = find_named(world, plain(match["place"]))
        if by is not None and isinstance(by.thing, RememberedPlace):
            name = by.thing.waypoint.name
            labelled = find_things(world, plain(match["label"]))
            called = [each for each in labelled if name in each.thing.waypoints]
    if not called:
        return None
    located = [each for each in called if each.thing.position is not None]
    if not located:
        ids = find_place_ids(world, [name for each in called for name in each.thing.waypoints])
        raise GoalError(
            f"{wanted[:80]!r} was seen from {', '.join(ids)}, but not in which direction.",
            hint=f"Drive to {ids[0]} and look from there.",
            step=NextStep.LOOK_FROM,
            about=ids[0],
        )
    if len(located) == 1:
        return refer_to(world, Place(located[0].id, located[0]))
    shown = "; ".join(
        f"{each.id} at {say_spot(each.point)}, in "
        f"{' or '.join(world.rooms_before(each)) or 'no room'}"
        for each in located[:MOST_NAMED]
    )
    raise AmbiguousPlaceError(
        f"Several things are called {wanted[:80]!r}.",
        hint=f"They are {shown}. Say which one by its id.",
        words=wanted,
        meanings=[each.id for each in located],
    )


def _choose_by_side(world: WorldModel, room: Region, doors: list[Door], side: Side) -> Place:
    """Return the leftmost or rightmost door of a room as the robot sees it.

    In the room it looks along its own heading; from outside, at the middle of the room.
    """
    robot, is_inside = world.robot, world.find_room_id(world.robot.point) == room.id
    look_rad = robot.yaw_rad if is_inside else robot.point.bearing_to(room.widest)

    def turn_rad(door: Door) -> float:
        return math.remainder(robot.point.bearing_to(door.place) - look_rad, math.tau)

    door = max(doors, key=turn_rad) if side is Side.LEFT else min(doors, key=turn_rad)
    sees = f"as seen from {ROBOT}, looking {read_heading(look_rad)}"
    which = f"the {side.removesuffix(' of')} one of the {len(doors)} doors of {room.id}"
    return Place(door.id, door, f"{which} {sees}")


def _find_only_door(world: WorldModel, wanted: str) -> Place | None:
    """Find "the door": the only one of the room that is named, or that the robot stands in."""
    match = DOOR.fullmatch(wanted)
    if match is None:
        return None
    named = [match[each] for each in ("one", "other", "room") if match[each]]
    known = [find_known(world, each) for each in named]
    rooms = [each.region for each in known if each is not None and each.region is not None]
    if len(rooms) < len(named):
        return None
    rooms = rooms or [find_room_here(world)]
    ids = {room.id for room in rooms}
    doors = [door for door in world.rooms.doors if ids <= set(door.region_ids)]
    if len(doors) == 1:
        return Place(doors[0].id, doors[0])
    if match["side"] and len(rooms) == 1 and doors:
        return _choose_by_side(world, rooms[0], doors, Side(f"{match['side'].casefold()} of"))
    said = " and ".join(room.id for room in rooms)
    has = f"{said} {'have' if len(rooms) > 1 else 'has'} {len(doors)} doors"
    shown = ", ".join(door.id for door in doors[:MOST_NAMED]) or "none"
    between = f"{has} between them" if len(rooms) > 1 else has
    raise GoalError(f"{between}.", hint=f"Say which one by its id: {shown}.")
