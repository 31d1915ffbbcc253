"""What a relation relates to: a point, a door, a wall or a room, from the words inside a phrase."""

import math
import re
from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from mapspeak.errors import GoalError, NextStep
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.memory import name_key
from mapspeak.places.doorways import find_near_side, find_normal, offsets_around
from mapspeak.places.goalcheck import FARTHEST_M
from mapspeak.places.naming import (
    MOST_NAMED,
    AmbiguousPlaceError,
    Place,
    Spot,
    find_named,
    say_spot,
)
from mapspeak.places.relations.grammar import COMPASS, Superlative, parse_relation
from mapspeak.places.relations.outlines import SAME_SIDE_RAD, find_sides
from mapspeak.places.relations.placement import refuse
from mapspeak.places.relations.vocabulary import (
    GAP,
    Compass,
    Side,
    pattern,
    plain,
    read_compass,
    read_heading,
)
from mapspeak.places.things import find_place_ids, find_things, find_things_seen, list_pictures
from mapspeak.places.ways import standing_point
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.rooms import Door, Region, RoomClass
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedPlace, RememberedThing

ROBOT = "the robot"
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
    offsets, labels = offsets_around(world, world.rooms.labels, point, AROUND_THING_M)
    if not labels.size:
        return None
    away_m = np.hypot(*offsets.T)
    indices = np.unique(labels[away_m <= away_m.min() + BOTH_SIDES_M])
    return next((each for each in world.rooms.regions if [each.index] == indices.tolist()), None)


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


ROOM = pattern(r"(?:(?P<here>this|current|same) )?(?P<noun>room|corridor|hallway|open space|area)")
CLASSES = {
    "room": (RoomClass.ROOM, RoomClass.OPEN_SPACE),
    "corridor": (RoomClass.CORRIDOR,),
    "hallway": (RoomClass.CORRIDOR,),
}
"""What a word may be said of; other words of all."""
TOWARDS = COMPASS.replace("compass", "towards")
DOOR = pattern(
    rf"(?:(?P<side>left|right)(?: hand)? |{COMPASS}(?: side)? )?(?:door|doorway)"
    r"(?: (?:between (?P<one>.+?) and (?P<other>.+)"
    rf"|(?:(?:(?:on|in|at|to) )?(?:the )?{TOWARDS}(?: side| wall| end)? of|of|in|to)"
    r" (?P<room>.+)))?"
)
OUTERMOST_M = 1.0
"""So much farther on one side of a room than its other doors, a door is the one there."""
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


def _choose_towards(world: WorldModel, room: Region, doors: list[Door], compass: Compass) -> Place:
    """Return the door through which a room is left in a direction, else the outermost there.

    The outermost of several counts where it is beyond the middle of the room.

    Raises:
        GoalError: There is none, or there are several.
    """
    towards_rad = compass.heading_rad

    def leads_there(door: Door) -> bool:
        off_rad = find_normal(world, door, room) + math.pi - towards_rad
        return abs(wrap_angle(off_rad)) <= SAME_SIDE_RAD

    def ahead_m(point: Point) -> float:
        return point.x * math.cos(towards_rad) + point.y * math.sin(towards_rad)

    found = [door for door in doors if leads_there(door)]
    if not found and len(doors) > 1:
        farthest_m = max(ahead_m(door.place) for door in doors)
        least_m = max(ahead_m(find_sides(world, room)[1]), farthest_m - OUTERMOST_M)
        found = [door for door in doors if ahead_m(door.place) >= least_m]
    if len(found) == 1:
        which = f"the {compass} one of the {len(doors)} doors of {room.id}"
        return Place(found[0].id, found[0], which if len(doors) > 1 else "")
    n_found = f"{len(found)} doors" if found else "no door"
    ids = ", ".join(door.id for door in (found or doors)[:MOST_NAMED])
    said = f"{room.id} has {n_found} in the {compass}."
    raise GoalError(said, hint=f"Say which one by its id: {ids}.")


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
    compass = read_compass(match["compass"] or match["towards"])
    if compass is not None and len(rooms) == 1 and doors:
        return _choose_towards(world, rooms[0], doors, compass)
    if len(doors) == 1:
        return Place(doors[0].id, doors[0])
    if match["side"] and len(rooms) == 1 and doors:
        return _choose_by_side(world, rooms[0], doors, Side(f"{match['side'].casefold()} of"))
    said = " and ".join(room.id for room in rooms)
    has = f"{said} {'have' if len(rooms) > 1 else 'has'} {len(doors)} doors"
    shown = ", ".join(door.id for door in doors[:MOST_NAMED]) or "none"
    between = f"{has} between them" if len(rooms) > 1 else has
    raise GoalError(f"{between}.", hint=f"Say which one by its id: {shown}.")
