"""What is to be said of a world model before its rows: warnings, closures, where things lie."""

import math
from collections.abc import Iterator

from mapspeak.geometry import Point, wrap_angle
from mapspeak.memory import SemanticMap
from mapspeak.memory.events import tell_place
from mapspeak.memory.quoting import quote
from mapspeak.places.candidate import find_rooms_of
from mapspeak.places.naming import Place
from mapspeak.places.relations.viewpoints import is_missed_from_near
from mapspeak.places.standing import find_standing_point
from mapspeak.server.text.offered import lead
from mapspeak.server.text.wording import list_some, say_count, say_pose_doubt, shorten
from mapspeak.spatial.rooms import Door
from mapspeak.worldmodel.keepout import ClosedArea, ClosedFloor
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import Remembered, RememberedThing

ASSUMED_RADIUS = (
    "The robot does not tell its size. A radius of {:.2f} m is assumed: doors and goals may be too "
    "tight for it, unless radius_m stands in robot.yaml."
)
HERE_M = 0.1
DIRECTIONS = (
    "ahead of it",
    "ahead and to its left",
    "to its left",
    "behind and to its left",
    "behind it",
    "behind and to its right",
    "to its right",
    "ahead and to its right",
)
"""Eighths of a turn from the robot's heading, counter-clockwise."""


def say_warnings(world: WorldModel) -> list[str]:
    """Return what a reader of a map should know first: of the memory, and of the robot's pose."""
    doubt = say_pose_doubt(world.pose_doubt)
    of_pose = [f"The robot's pose is uncertain: {doubt}"] if doubt else []
    of_memory = say_elsewhere(world.memory)
    of_size = [ASSUMED_RADIUS.format(world.radius_m)] if world.is_radius_assumed else []
    return [f"Warning: {warning}" for warning in (*world.warnings, *of_memory, *of_pose, *of_size)]


def say_elsewhere(memory: SemanticMap) -> list[str]:
    """Return how much is left out because they are of another map, if anything is."""
    counts = ((len(memory.elsewhere), "place"), (memory.n_events_elsewhere, "event"))
    left_out = [say_count(n, what) for n, what in counts if n]
    if not left_out:
        return []
    is_one = sum(n for n, _ in counts) == 1
    are = f"{' and '.join(left_out)} {'is' if is_one else 'are'}"
    said = "remembered on another map, and how that lies to this one is not known."
    return [f"{are} {said} Nothing of it is shown or found here."]


def say_obstruction(world: WorldModel, door: Door) -> str:
    """Return why the robot does not get through a door, in a word or two."""
    if door.width_m < 2 * world.radius_m:
        return "too narrow"
    floor = world.map.floor
    if isinstance(floor, ClosedFloor):
        closed = floor.find_area(door.place, within_m=world.radius_m)
        if closed is not None:
            return closed.closing
    sides = (world.rooms.region(region_id) for region_id in door.region_ids)
    is_any_reached = any(find_standing_point(world, region) for region in sides)
    return "blocked" if is_any_reached else "out of reach"


def say_fit(world: WorldModel, door: Door) -> str:
    """Say whether the robot fits through a door, and with how much to spare."""
    width_m = 2 * world.radius_m
    if world.find_crossing(door) is None:
        return f"{say_obstruction(world, door)}: no way for the robot, {width_m:.2f} m wide"
    spare_m = max(door.width_m - width_m, 0.0) / 2
    return f"the robot, {width_m:.2f} m wide, fits with {spare_m:.2f} m on each side"


def say_area(area: ClosedArea) -> str:
    """Return what a closed area is called; the words of an event are not the operator's: quoted."""
    name = shorten(area.name)
    return tell_place(name) if area.event_id else name


def say_off(robot: Point, remembered: RememberedThing | None) -> str:
    """Return how far a thing itself is from the robot, by what is remembered; nothing of none."""
    if remembered is None:
        return ""
    position = remembered.thing.position
    if position is None:
        return f"nobody noted where {remembered.id} is"
    return f"{remembered.id} is {robot.distance_to(position):.1f} m from the robot"


NEAR_M = 5.0
MOST_NEAR = 6


def say_direction(world: WorldModel, point: Point) -> str:
    """Return where a point is as seen from the robot: "3.2 m straight, to its left"."""
    away_m = world.robot.point.distance_to(point)
    if away_m < HERE_M:
        return "it stands there"
    turn_rad = wrap_angle(world.robot.point.bearing_to(point) - world.robot.yaw_rad)
    eighth = round(turn_rad / (math.tau / 8)) % 8
    return f"{away_m:.1f} m straight, {DIRECTIONS[eighth]}"


def say_near(world: WorldModel, point: Point) -> str:
    """Say what is remembered near a point, with its room where that is another."""
    near = [f"{name} at {away_m:.1f} m" for away_m, name in sorted(_list_near(world, point))]
    return f"Remembered within {NEAR_M:.0f} m: {list_some(near, most=MOST_NEAR)}." if near else ""


def _list_near(world: WorldModel, point: Point) -> Iterator[tuple[float, str]]:
    own_id = world.find_room_id(point)
    remembered: tuple[Remembered, ...] = (*world.things, *world.places)
    for each in remembered:
        if isinstance(each, RememberedThing):
            at, name = each.thing.position, f"{each.id} {quote(each.thing.label)}"
        else:
            at, name = each.waypoint.pose.point, each.id
        if at is not None and (away_m := point.distance_to(at)) <= NEAR_M:
            room_ids = find_rooms_of(world, each)
            is_here = not room_ids or own_id in room_ids
            yield away_m, name if is_here else f"{name} in {' or '.join(room_ids)}"


def say_explored(world: WorldModel) -> str:
    """Say how much floor is known, and how much more is to be expected."""
    known_m2, known_ratio = world.frontiers.floor_m2, world.frontiers.known_ratio
    percent = round(100 * known_ratio)
    if not world.frontiers.frontiers:
        return f"{known_m2:.1f} m2 of free floor, {percent} %."
    more_m2 = known_m2 / known_ratio - known_m2
    # Not all of it, as long as there is a frontier to go to.
    return (
        f"{known_m2:.1f} m2 of free floor, {min(percent, 99)} %: about {_round(more_m2)} m2 more "
        "are expected."
    )


def _round(area_m2: float) -> str:
    """Return an estimate with the one or two digits that it is good for."""
    return f"{area_m2:.1f}" if area_m2 < 1 else f"{float(f'{area_m2:.2g}'):.0f}"


CHECK = (
    "Is it there? {write_semantic_data} notes it from this picture; "
    "what is not there any more is given as gone."
)
FROM_FARTHER = (
    "It is not reported from so near and may hang above the picture: {look_at} again looks from "
    "farther off."
)


def say_check_of_thing(world: WorldModel, place: Place) -> str:
    """Say what to do with a picture that should show a remembered thing."""
    return lead(FROM_FARTHER if is_missed_from_near(world, place) else CHECK)
