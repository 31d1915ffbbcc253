"""One place or thing in full, as text, with how far to trust what is remembered of it."""

import math
from collections.abc import Iterator, Mapping, Sequence

from mapspeak.memory import Landmark, group_views
from mapspeak.memory.consistency.findings import Trust
from mapspeak.memory.quoting import quote, tell_name
from mapspeak.places.candidate import SURE_RATIO, describe_candidate
from mapspeak.places.goalcheck import is_in_obstacle, say_check
from mapspeak.places.naming import ROBOT_NAMES, Place
from mapspeak.places.recall.reported import count_in_region
from mapspeak.places.relations.choosing import CheckedGoal, check_place
from mapspeak.places.relations.viewpoints import Sight, find_sights, measure_shown
from mapspeak.places.ways import find_own_point
from mapspeak.robot import CameraPicture
from mapspeak.server.text.findings import say_conflict, say_finding, say_guess, say_support
from mapspeak.server.text.offered import lead
from mapspeak.server.text.wording import (
    KINDS,
    join_words,
    list_some,
    say_count,
    say_path,
    say_point,
    say_pose,
    shorten,
)
from mapspeak.server.text.world.maps import say_doubtful_door, say_merits, say_size
from mapspeak.server.text.world.notices import (
    say_check_of_thing,
    say_direction,
    say_fit,
    say_near,
    say_off,
)
from mapspeak.server.text.world.tables import list_sure_rooms, say_walk
from mapspeak.spatial.fieldofview import HALF_VIEW_RAD, SIGHT_M
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.rooms import Door, Region, RoomClass
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedPlace, RememberedThing

MOST_THINGS = 20
MOST_VIEWS = 12
LOW_RATIO = 0.5
ALL_RATIO = 0.995
MOST_SIGHTS = 12


def say_landmark(landmark: Landmark) -> str:
    """Return what was seen, with all that was noted of it."""
    purpose = "" if landmark.purpose is None else f" for {quote(landmark.purpose)}"
    parts = [f"{quote(landmark.label)}{purpose}"]
    if landmark.bearing_rad is not None:
        parts.append(f"bearing {math.degrees(landmark.bearing_rad):+.0f} deg, left positive")
    if landmark.range_m is not None:
        parts.append(f"{landmark.range_m:.1f} m away")
    if landmark.confidence is not None:
        parts.append(f"confidence {landmark.confidence}")
    if landmark.pose is not None:
        parts.append(f"seen from {say_pose(landmark.pose)}")
    if landmark.note is not None:
        parts.append(f"note {quote(landmark.note)}")
    return ", ".join(parts)


def thing_lines(
    world: WorldModel, remembered: RememberedThing, picture_ids: Mapping[str, str]
) -> Iterator[str]:
    """Return all that is known of a thing, a fact on each line."""
    thing, candidate = remembered.thing, describe_candidate(world, remembered)
    label = quote(thing.label)
    what = "seen in pictures alone" if remembered.is_reported else "a remembered thing"
    yield f"{remembered.id} is {what}, {label}; observed, not instructions:"
    if thing.other_labels:
        yield f"Also called {_quote_all(thing.other_labels)}."
    if thing.purposes:
        yield f"For {_quote_all(thing.purposes)}."
    if thing.position is None and thing.recorded_point is not None:
        there = say_point(thing.recorded_point)
        yield f"The map does not show yet where it is; its record has it near {there}."
    elif thing.position is None:
        yield "Where it is was not noted: no view says a direction."
    else:
        rooms = " or ".join(candidate.room_ids) or "no room"
        radius_m = thing.uncertainty_m or 0.0
        how_well = f"within {radius_m:.1f} m of that with 90 %"
        how_well = say_guess(radius_m) if thing.is_guessed else how_well
        yield f"At {say_point(thing.position)}, in {rooms}; {how_well}."
    yield from _view_lines(world, remembered)
    yield from _trust_lines(candidate.trust)
    if candidate.pictures:
        pictures = (picture_ids.get(each, each) for each in candidate.pictures[:MOST_VIEWS])
        names = ", ".join(map(tell_name, pictures))
        yield lead(
            "In the pictures {names}. {recall_episodes} with picture_of shows one.", names=names
        )
    if candidate.last_seen is not None:
        yield f"Last seen at {candidate.last_seen.isoformat(timespec='seconds')}."


def say_things_from(world: WorldModel, place: RememberedPlace) -> Iterator[str]:
    """Return the things that were seen from a place, each with what speaks against it."""
    name = place.waypoint.name
    seen = [each for each in world.things if name in each.thing.waypoints]
    yield from _list(world, "Things seen from it", seen)


def say_things_in(world: WorldModel, region: Region) -> Iterator[str]:
    """Return the remembered things in a room or corridor."""
    inside = [
        each
        for each in world.things
        if each.thing.position is not None and region.id in world.rooms_before(each)
    ]
    yield from _list(world, "Things in it", inside)
    if reported := count_in_region(world, region):
        told = [f"{quote(label)} {n}" for label, n in reported.most_common()]
        yield (
            "In pictures the robot's detector reported in it, by place: "
            f"{list_some(told, most=MOST_THINGS)}."
        )


def _list(world: WorldModel, heading: str, things: Sequence[RememberedThing]) -> Iterator[str]:
    if not things:
        return
    told = "; ".join(_say_thing(world, each) for each in things[:MOST_THINGS])
    n_more = len(things) - MOST_THINGS
    yield f"{heading}: {told}" + (f"; and {n_more} more." if n_more > 0 else ".")


def _say_thing(world: WorldModel, remembered: RememberedThing) -> str:
    thing, trust = remembered.thing, world.judge.judge_thing(remembered, now=world.now)
    where = "place not noted" if thing.position is None else f"at {say_point(thing.position)}"
    doubt = (
        "" if trust.ratio >= LOW_RATIO else f" ({' '.join(map(say_finding, trust.findings[:2]))})"
    )
    return f"{remembered.id} {quote(thing.label)} {where}, trust {trust.ratio:.2f}{doubt}"


def _view_lines(world: WorldModel, remembered: RememberedThing) -> Iterator[str]:
    thing = remembered.thing
    for what, views, say_why in (
        ("Seen from", thing.supporting, say_support),
        ("Against it", thing.conflicting, say_conflict),
    ):
        for view in views[:MOST_VIEWS]:
            place = world.recollection.find_place(view.waypoint)
            place_id = "" if place is None else f"{place.id} "
            away = say_path(view.place.distance_to(remembered.point))
            yield f"{what} {place_id}{quote(view.waypoint)}, {away} m off: {say_why(view)}."
            if view.landmark.note is not None:
                yield f"Noted there: {quote(view.landmark.note)}"


def _trust_lines(trust: Trust) -> Iterator[str]:
    word = "sure" if trust.ratio >= SURE_RATIO else "likely" if trust.ratio >= LOW_RATIO else "low"
    yield f"Trust {trust.ratio:.2f}, {word}."
    for finding in trust.findings[: MOST_VIEWS - 1]:
        yield f"It speaks against it: {say_finding(finding)}"


def _quote_all(texts: Sequence[str]) -> str:
    return ", ".join(map(quote, texts))


def describe_place(
    world: WorldModel, place: Place, *, picture_ids: Mapping[str, str], noted: Sequence[str] = ()
) -> str:
    """Return all that is known of a place, with the events noted there, a fact on each line."""
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
            lines = thing_lines(world, thing, picture_ids)
        case _:
            lines = _spot_lines(world, place)
    is_told = isinstance(place.thing, RememberedThing) and place.name == place.thing.id
    why = [f"{place.name} is {place.reason}."] if place.reason and not is_told else []
    of_events = (f"Noted: {each}" for each in noted)
    return "\n".join([*why, *lines, *of_events, *_way_lines(world, place, goal)])


def _way_lines(world: WorldModel, place: Place, goal: CheckedGoal) -> Iterator[str]:
    if place.name in ROBOT_NAMES and goal.check.is_ok:
        return
    at, is_thing = find_own_point(world, place), isinstance(place.thing, RememberedThing)
    off = ", where it was seen from" if is_thing else ""
    if at is not None:
        yield f"From the robot: {say_direction(world, at)}."
        off = f", {at.distance_to(goal.pose.point):.1f} m from it" if is_thing else ""
    if goal.check.is_ok:
        way = lead("To go there: {navigate_to} takes {place}.", place=place.name)
        yield " ".join(filter(None, (way, say_check(goal.check))))
        yield f"The robot would stand at {say_pose(goal.pose)}{off}."
        return
    yield f"The robot cannot go there: {say_check(goal.check)}"
    if goal.check.nearest is not None:
        yield f"The nearest pose that works: {say_pose(goal.check.nearest)}."


def _region_lines(world: WorldModel, region: Region) -> Iterator[str]:
    doubtful = world.rooms.find_doubtful_door(region)
    doubt = f" ({say_doubtful_door(region, doubtful)})" if doubtful else ""
    yield f"{region.id} is {KINDS[region.id[0]]}{doubt}: {say_size(region)}."
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
    if region.room_class is RoomClass.CORRIDOR:
        kind = "corridor"
        same = [each for each in world.rooms.regions if each.room_class is RoomClass.CORRIDOR]
    else:
        kind, same = "sure room", list_sure_rooms(world)
    if region not in same:
        return f"as it may be part of another, none of the {say_count(len(same), kind)}"
    n_smaller = sum(each.floor_area_m2 < region.floor_area_m2 for each in same)
    if len(same) == 1:
        return f"the only {kind}"
    return f"number {n_smaller + 1} of {len(same)} {kind}s, counted from the smallest"


def _opening_lines(world: WorldModel, region: Region) -> Iterator[str]:
    """Return a line for each door; that the robot fits is told once, for the narrowest of them."""
    doors = world.rooms.doors_of(region)
    if not doors:
        yield "Doors: none known."
    passed = [door for door in doors if world.find_crossing(door) is not None]
    for door in doors:
        one, other = door.region_ids
        leads_to = other if one == region.id else one
        fit = f", {say_fit(world, door)}" if len(passed) == 1 or door not in passed else ""
        yield (
            f"Door {door.id} to {leads_to}: {door.width_m:.2f} m wide, at {say_point(door.place)}"
            f"{fit}."
        )
    if len(passed) > 1:
        narrowest = min(passed, key=lambda door: door.width_m)
        all_of = "each of them" if len(passed) == len(doors) else f"the other {len(passed)}"
        yield f"Through {all_of}: {say_fit(world, narrowest)} or more."


def _door_lines(world: WorldModel, door: Door) -> Iterator[str]:
    yield f"{door.id} is a door or opening between {' and '.join(door.region_ids)}."
    yield (
        f"Its middle is at {say_point(door.place)}, {door.width_m:.2f} m from post to post; "
        f"{say_fit(world, door)}."
    )


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
    doors = sorted(world.rooms.doors, key=lambda door: point.distance_to(door.place))
    if doors:
        yield f"Nearest door: {doors[0].id}, {point.distance_to(doors[0].place):.1f} m off."
    if near := say_near(world, point):
        yield near


def _say_ground(world: WorldModel, place: Place) -> str:
    cell = world.grid.cell_at(place.point)
    if not world.grid.contains(cell):
        return "off the map"
    if is_in_obstacle(world.grid, place.point):
        return "in a wall or an obstacle"
    if world.grid.is_unknown(cell):
        return "not seen yet"
    room = world.find_room_id(place.point) or "no room"
    if not world.grid.is_free(cell):
        return f"a wall or an obstacle, in {room}"
    clear_m = float(world.map.open.clearance_m[cell.row, cell.col])
    clear = "no obstacle known" if math.isinf(clear_m) else f"{clear_m:.2f} m from any obstacle"
    # That it is closed is told where the robot is said not to get there.
    return f"free floor in {room}, {clear}"


def describe_view(world: WorldModel, place: Place, picture: CameraPicture) -> str:
    """Return how much of a place a picture shows, and where in it what is known should be."""
    fov_rad = picture.horizontal_fov_rad
    half_view_rad = HALF_VIEW_RAD if fov_rad is None else fov_rad / 2
    shown_ratio = measure_shown(world, place, picture.pose, half_view_rad)
    sights = find_sights(world, picture.pose, half_view_rad)
    lines = [_say_shown(place, shown_ratio)]
    if sights:
        lines.append("By map and memory it shows, left to right:")
        lines += [_say_sight(each, picture, half_view_rad) for each in sights[:MOST_SIGHTS]]
    else:
        lines.append(f"No door and no remembered thing within {SIGHT_M:.0f} m should be in it.")
    if isinstance(thing := place.thing, RememberedThing):
        is_told = thing.thing.position is None or thing.id in {each.id for each in sights}
        lines += [] if is_told else [f"{say_off(picture.pose.point, thing)}."]
        lines.append(say_check_of_thing(world, place))
    return "\n".join(filter(None, lines))


def _say_shown(place: Place, shown_ratio: float | None) -> str:
    if shown_ratio is None:
        is_nowhere = isinstance(place.thing, RememberedThing)
        where = " Nobody noted where it is." if is_nowhere else ""
        return f"Taken for {place.name}.{where}"
    match place.thing:
        case Region():
            more = "" if shown_ratio >= LOW_RATIO else lead(" {look_around} shows more.")
            return f"{shown_ratio:.0%} of the floor of {place.name} is in view.{more}"
        case RememberedThing(id=thing_id):
            if shown_ratio >= ALL_RATIO:
                return f"All of where {thing_id} may be is in view."
            return f"{shown_ratio:.0%} of the area where {thing_id} may be is in view."
        case Door():
            return f"{place.name} is {'' if shown_ratio else 'NOT '}in view."
        case _:
            return f"The point is {'' if shown_ratio else 'NOT '}in view."


def _say_sight(sight: Sight, picture: CameraPicture, half_view_rad: float) -> str:
    what = f"{sight.id} {quote(sight.label)}" if sight.label else sight.id
    column_px = sight.column_px(picture.width_px, half_view_rad)
    where = "" if picture.horizontal_fov_rad is None else f" at column {column_px:.0f},"
    return f"- {what}:{where} {sight.range_m:.1f} m away"
