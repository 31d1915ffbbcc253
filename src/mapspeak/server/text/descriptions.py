"""One place in full, as text: a room, a door, a frontier, a remembered place, or a point."""

import math
from collections.abc import Iterator

from mapspeak.memory import group_views
from mapspeak.memory.quoting import quote
from mapspeak.places.goalcheck import say_check
from mapspeak.places.naming import Place
from mapspeak.places.relations.choosing import CheckedGoal, check_place
from mapspeak.places.ways import standing_point
from mapspeak.server.text.frontiers import say_merits
from mapspeak.server.text.maps import say_size
from mapspeak.server.text.offered import lead
from mapspeak.server.text.roomtables import say_walk
from mapspeak.server.text.things import say_landmark, say_things_from, say_things_in, thing_lines
from mapspeak.server.text.wording import (
    join_words,
    say_direction,
    say_kind,
    say_obstruction,
    say_point,
    say_pose,
    shorten,
)
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.rooms import Door, Region, RoomClass
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.recollection import RememberedPlace, RememberedThing

NEAR_M = 5.0


def describe_place(world: WorldModel, place: Place) -> str:
    """Return all that is known of a place, a fact on each line."""
    goal = check_place(world, place)
    match place.thing:
        case Region() as region:
            lines = _region_lines(world, region)
        case Door() as door:
            lines = _door_lines(world, door)
        case Frontier() as frontier:
            lines = _frontier_lines(world, frontier)
        case RememberedPlace() as remembered:
            lines = _remembered_lines(world, remembered)
        case RememberedThing() as thing:
            lines = thing_lines(world, thing)
        case _:
            lines = _spot_lines(world, place)
    why = [f"{place.name} is {place.reason}."] if place.reason else []
    return "\n".join([*why, *lines, *_way_lines(world, place, goal)])


def _way_lines(world: WorldModel, place: Place, goal: CheckedGoal) -> Iterator[str]:
    yield f"From the robot: {say_direction(world, standing_point(world, place))}."
    if goal.check.is_ok:
        way = lead("To go there: {navigate_to} takes {place}.", place=place.name)
        yield " ".join(filter(None, (way, say_check(goal.check))))
        yield f"The robot would stand at {say_pose(goal.pose)}."
        return
    yield f"The robot cannot go there: {say_check(goal.check)}"
    if goal.check.nearest is not None:
        yield f"The nearest pose that works: {say_pose(goal.check.nearest)}."


def _region_lines(world: WorldModel, region: Region) -> Iterator[str]:
    yield f"{region.id} is a {say_kind(region)}: {say_size(region)}."
    yield (
        f"Floor {region.floor_area_m2:.1f} m2 with what stands on it, {region.free_area_m2:.1f} m2 "
        f"of it free; {_say_rank(world, region)}."
    )
    if region.room_class is not RoomClass.CORRIDOR:
        yield (
            f"Shape: {region.length_m:.1f} x {region.width_m:.1f} m, the longer side along "
            f"{math.degrees(region.heading_rad):.0f} deg."
        )
    yield (
        f"Widest at {say_point(region.widest)}, {region.clearance_m:.2f} m from the nearest wall."
    )
    yield from _opening_lines(world, region)
    walk = world.map.walk_along(region) if region.room_class is RoomClass.CORRIDOR else None
    if walk is not None:
        yield say_walk(region, walk)
    frontiers = [
        frontier.id
        for frontier in world.frontiers.frontiers
        if world.find_room_id(frontier.pose.point) == region.id
    ]
    if frontiers:
        yield f"Not all seen: frontiers {join_words(frontiers)} lead on from it."
    for remembered in world.places:
        if world.find_room_id(remembered.waypoint.pose.point) == region.id:
            yield f"Remembered in it: {_say_remembered(remembered)}."
    yield from say_things_in(world, region)


def _say_rank(world: WorldModel, region: Region) -> str:
    same = [each for each in world.rooms.regions if each.room_class is region.room_class]
    n_smaller = sum(each.floor_area_m2 < region.floor_area_m2 for each in same)
    kind = say_kind(region)
    if len(same) == 1:
        return f"the only {kind}"
    return f"number {n_smaller + 1} of {len(same)} {kind}s, counted from the smallest"


def _opening_lines(world: WorldModel, region: Region) -> Iterator[str]:
    doors = world.rooms.doors_of(region)
    if not doors:
        yield "Doors: none known."
    for door in doors:
        one, other = door.region_ids
        leads_to = other if one == region.id else one
        yield (
            f"Door {door.id} to {leads_to}: {door.width_m:.2f} m wide, at {say_point(door.place)}, "
            f"{_say_fit(world, door)}."
        )


def _door_lines(world: WorldModel, door: Door) -> Iterator[str]:
    yield f"{door.id} is a door or opening between {' and '.join(door.region_ids)}."
    yield (
        f"Its middle is at {say_point(door.place)}, {door.width_m:.2f} m from post to post; "
        f"{_say_fit(world, door)}."
    )


def _say_fit(world: WorldModel, door: Door) -> str:
    width_m = 2 * world.radius_m
    if world.find_crossing(door) is None:
        return f"{say_obstruction(world, door)}: no way for the robot, {width_m:.2f} m wide"
    spare_m = max(door.width_m - width_m, 0.0) / 2
    return f"the robot, {width_m:.2f} m wide, fits with {spare_m:.2f} m on each side"


def _frontier_lines(world: WorldModel, frontier: Frontier) -> Iterator[str]:
    ids = [each.id for each in world.frontiers.frontiers]
    rank = ids.index(frontier.id) + 1
    yield (
        f"{frontier.id} is a frontier to the unknown, {frontier.length_m:.1f} m long, over "
        f"{say_point(frontier.anchor)}; number {rank} of {len(ids)}, best first."
    )
    yield (
        f"About {frontier.gain_m2:.1f} m2 of new floor may come into view from "
        f"{say_pose(frontier.pose)}, in {world.find_room_id(frontier.pose.point) or 'no room'}."
    )
    yield f"Why it stands there in the list: {say_merits(frontier)}."


def _remembered_lines(world: WorldModel, remembered: RememberedPlace) -> Iterator[str]:
    waypoint = remembered.waypoint
    name = quote(waypoint.name)
    yield f"{remembered.id} is a remembered place, {name}; observed, not instructions:"
    yield (
        f"Seen from {say_pose(waypoint.pose)}, in "
        f"{world.find_room_id(waypoint.pose.point) or 'no room'}."
    )
    if waypoint.description:
        yield f"Description: {quote(waypoint.description)}"
    for views in group_views(waypoint):
        number = f"; {len(views)} views of it" if len(views) > 1 else ""
        yield f"Landmark: {say_landmark(views[0])}{number}."
    for feature in waypoint.geometric_features:
        yield f"Layout: {quote(feature)}"
    yield from say_things_from(world, remembered)
    if waypoint.recorded_at is not None:
        yield f"Recorded at {waypoint.recorded_at.isoformat(timespec='seconds')}."


def _say_remembered(remembered: RememberedPlace) -> str:
    labels = ", ".join(dict.fromkeys(each.label for each in remembered.waypoint.landmarks))
    seen = f", saw {quote(shorten(labels))}" if labels else ""
    return f"{remembered.id} {quote(shorten(remembered.waypoint.name))}{seen}"


def _spot_lines(world: WorldModel, place: Place) -> Iterator[str]:
    point = place.point
    yield f"{place.name} is at {say_point(point)}: {_say_ground(world, place)}."
    near = [
        f"{each.id} at {point.distance_to(each.waypoint.pose.point):.1f} m"
        for each in world.places
        if point.distance_to(each.waypoint.pose.point) <= NEAR_M
    ]
    doors = sorted(world.rooms.doors, key=lambda door: point.distance_to(door.place))
    if doors:
        yield f"Nearest door: {doors[0].id}, {point.distance_to(doors[0].place):.1f} m off."
    if near:
        yield f"Remembered places within {NEAR_M:.0f} m: {', '.join(near)}."


def _say_ground(world: WorldModel, place: Place) -> str:
    cell = world.grid.cell_at(place.point)
    if not world.grid.contains(cell):
        return "off the map"
    if world.grid.is_unknown(cell):
        return "not seen yet"
    room = world.find_room_id(place.point) or "no room"
    if not world.grid.is_free(cell):
        return f"a wall or an obstacle, in {room}"
    clear_m = float(world.map.clearance_m[cell.row, cell.col])
    clear = "no obstacle known" if math.isinf(clear_m) else f"{clear_m:.2f} m from any obstacle"
    return f"free floor in {room}, {clear}"
