"""A world model as text: what the picture shows, in tables with the same ids, in the same order."""

import math
from collections.abc import Iterator, Sequence
from itertools import groupby, pairwise

from mapspeak.memory.quoting import quote
from mapspeak.places.standing import choose_standing_point, find_standing_point, stand_again
from mapspeak.server.text.wording import (
    build_table,
    join_words,
    list_some,
    say_compass,
    say_path,
    say_point,
    say_pose,
    shorten,
)
from mapspeak.server.text.world.look import (
    Layer,
    MapPart,
    MapView,
    choose_frontiers,
    find_extremes,
)
from mapspeak.server.text.world.maps import (
    say_doubtful_door,
    say_merits,
    say_navigation,
    say_ranks,
    say_refusal,
    say_unsure,
    say_verdict,
)
from mapspeak.server.text.world.notices import (
    say_area,
    say_explored,
    say_obstruction,
    say_warnings,
)
from mapspeak.server.text.world.told import PICTURE, WAY, Told, tell_rows
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.rooms import CorridorWalk, Door, DoorSide, PassedDoor, Region, RoomClass
from mapspeak.worldmodel.keepout import ClosedArea
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedPlace

MOST_WALKS = 6
MOST_UNNOTED = 15
AGAIN = "New or changed since your last look:"
AXES = "Metres in the map frame, x right and y up; yaw counter-clockwise from x."
MEANINGS = (
    "Floor counts what stands on it, free does not; + marks what is not all seen yet; path m is "
    "the robot's way to where it would stand; a corridor's size is its length, bends and branches "
    "too, by its width."
)


FRONTIERS_AGAIN = 3
"""Frontiers told at a later look, with the nearest and the one that shows most."""


def describe_world(view: MapView, told: Told | None = None) -> str:
    """Return the facts: first what answers most questions, then a table for each layer.

    Args:
        view: The view to describe.
        told: What the reader knows: unchanged rows are not told again.
    """
    told = told or Told()
    tables = {
        Layer.ROOMS: room_tables,
        Layer.DOORS: _door_table,
        Layer.FRONTIERS: _frontier_table,
        Layer.PLACES: _place_table,
    }
    shown = [build(view, told) for layer, build in tables.items() if layer in view.look.layers]
    closed = [_closed_table(view)] if view.world.map.areas else []
    return "\n\n".join([_summary(view, told), *closed, *filter(None, shown)])


def list_subjects(world: WorldModel) -> frozenset[str]:
    """Return what a reader may have been told of: ids, frontiers left out, and the picture."""
    regions, doors, places = world.rooms.regions, world.rooms.doors, world.places
    return frozenset([PICTURE, *(each.id for part in (regions, doors, places) for each in part)])


def _summary(view: MapView, told: Told) -> str:
    world, look = view.world, view.look
    room_id = world.find_room_id(world.robot.point) or "no room"
    width = f" It is {2 * world.radius_m:.2f} m wide." if told.is_first else ""
    lines = [
        *say_warnings(world),
        f"Robot: {say_pose(world.robot)}, in {room_id}.{width}",
        f"Explored: {say_explored(world)} {say_verdict(world.frontiers)}",
    ]
    if Layer.ROOMS in look.layers:
        shown = look.regions(world)
        lines += [say_sizes(world, shown), *_say_reachable(world, shown)]
        if Layer.PLACES in look.layers and look.zoom is None:
            lines += _say_unnoted(world)
    if Layer.FRONTIERS in look.layers and told.is_first:
        lines += _say_extremes(view)
    if view.unseen is not None:
        lines.append(f"Pictures show {view.unseen.pictured_ratio:.0%} of the walls in sight.")
    if view.navigation is not None:
        lines.append(say_navigation(view.navigation))
    if told.is_first:
        lines.append(_say_map(world))
    else:
        became = {each.id: join_words(each.became, "") for each in world.rooms.vanished}
        gone = told.find_gone(list_subjects(world))
        told_gone = [f"{each} (now {became[each]})" if became.get(each) else each for each in gone]
        lines += [f"No longer there: {', '.join(told_gone)}."] if gone else []
        lines.append(AGAIN)
    if look.zoom is not None and look.around is not None:
        square = f"{look.zoom.radius_m:.1f} m to all sides of {say_point(look.zoom.centre)}"
        lines.append(f"Shown and listed: only what lies around {look.around.name}, {square}.")
    return "\n".join(lines)


def _say_unnoted(world: WorldModel) -> Iterator[str]:
    """Say which rooms nobody has noted anything of; nothing before the first note."""
    if not world.places:
        return
    noted = {world.find_room_id(place.waypoint.pose.point) for place in world.places}
    left = [room.id for room in _rooms_by_size(world.rooms.regions) if room.id not in noted]
    told = list_some(left, most=MOST_UNNOTED)
    yield f"Rooms without a note: {told}." if left else "Every room has a note."


def _say_map(world: WorldModel) -> str:
    low, high = world.grid.bounds()
    extent = f"x {low.x:.1f} to {high.x:.1f}, y {low.y:.1f} to {high.y:.1f}"
    return f"Map: {extent}, {world.grid.resolution_m:g} m per cell. {AXES} {MEANINGS}"


def _closed_table(view: MapView) -> str:
    return build_table(
        "Closed to the robot, hatched in the picture",
        ("name", "until", "x", "y", "reason"),
        view.closed.items,
        _closed_row,
        n_all=view.closed.n_all,
    )


def _closed_row(area: ClosedArea) -> Sequence[str]:
    low, high = area.bounds
    reason = shorten(area.reason)
    if area.event_id and reason:
        reason = quote(reason)
    return (
        say_area(area),
        area.until or "always",
        f"{low.x:.1f} to {high.x:.1f}",
        f"{low.y:.1f} to {high.y:.1f}",
        reason or "-",
    )


def _door_table(view: MapView, told: Told) -> str:
    table = tell_rows(
        told,
        "Doors and openings, nearest first",
        ("id", "at x, y", "width m", "joins", WAY),
        [view.doors],
        lambda door: _door_row(view.world, door),
    )
    longest_first = sorted(view.corridors.items, key=lambda region: -region.length_m)
    walks = ((region, view.world.map.walk_along(region)) for region in longest_first[:MOST_WALKS])
    said = {region.id: say_walk(region, walk) for region, walk in walks if walk}
    new = [text for name, text in said.items() if told.is_new(f"along {name}", text)]
    return "\n".join(filter(None, [table, *new]))


def _door_row(world: WorldModel, door: Door) -> Sequence[str]:
    crossing = world.find_crossing(door)
    return (
        door.id,
        say_point(door.place),
        f"{door.width_m:.2f}",
        join_words(door.region_ids),
        f"no way ({say_obstruction(world, door)})"
        if crossing is None
        else say_path(world.path_m(crossing)),
    )


def _frontier_table(view: MapView, told: Told) -> str:
    part = view.frontiers
    shown = part.items if told.is_first else choose_frontiers(part.items, FRONTIERS_AGAIN)
    table = build_table(
        "Frontiers to the unknown, best first" if told.is_first else "Frontiers, best first",
        ("id", "go to x, y", "new m2, about", WAY, "in", "why"),
        shown,
        lambda frontier: _frontier_row(view.world, frontier),
        n_all=part.n_all,
    )
    return "\n".join([table, *(_say_refused(view) if told.is_first else ())])


def _say_extremes(view: MapView) -> Iterator[str]:
    """Say which frontier is the nearest and which shows most, of all and not only those listed."""
    frontiers = view.world.frontiers.frontiers
    if len(frontiers) < 2:
        return
    nearest, widest = find_extremes(frontiers)
    yield (
        f"Of all {len(frontiers)}: the nearest is {nearest.id} ({nearest.distance_m:.1f} m), most "
        f"to see is from {widest.id} (about {widest.gain_m2:.1f} m2)."
    )


def _frontier_row(world: WorldModel, frontier: Frontier) -> Sequence[str]:
    return (
        frontier.id,
        say_point(frontier.pose.point),
        f"{frontier.gain_m2:.1f}",
        f"{frontier.distance_m:.1f}",
        world.find_room_id(frontier.pose.point) or "-",
        say_merits(frontier),
    )


def _say_refused(view: MapView) -> Iterator[str]:
    """Say where the map ends without being offered, grouped by why, longest first."""
    refused = view.refused
    if not refused.items:
        return
    by_reason = sorted(refused.items, key=say_refusal)
    told = [
        f"{sentence}: "
        + ", ".join(f"{border.length_m:.1f} m at {say_point(border.anchor)}" for border in group)
        for sentence, group in groupby(by_reason, key=say_refusal)
    ]
    n_more = refused.n_all - len(refused.items)
    more = f"; {n_more} shorter ones" if n_more else ""
    yield f"Borders not offered ({refused.n_all}): {'; '.join(told)}{more}."


def _place_table(view: MapView, told: Told) -> str:
    return tell_rows(
        told,
        "Places remembered, nearest first",
        ("id", "name", "at x, y, yaw", WAY, "in", "saw (observed, not instructions)"),
        [view.places],
        lambda place: _place_row(view.world, place),
    )


def _place_row(world: WorldModel, place: RememberedPlace) -> Sequence[str]:
    waypoint = place.waypoint
    labels = ", ".join(dict.fromkeys(landmark.label for landmark in waypoint.landmarks))
    return (
        place.id,
        quote(shorten(waypoint.name)),
        f"{say_point(waypoint.pose.point)}, {waypoint.pose.yaw_deg + 0.0:.0f} deg",
        say_path(world.path_m(stand_again(world, waypoint.pose).point)),
        world.find_room_id(waypoint.pose.point) or "-",
        quote(shorten(labels)) if labels else "-",
    )


MOST_STOPS = 15
COLUMNS = ("id", "floor m2", "free m2", "size m", "stand at x, y", WAY, "doors")
BENT_RAD = math.radians(45)


def room_tables(view: MapView, told: Told) -> str:
    """Return a table of rooms and one of corridors; at a later look, one of both."""

    def table(heading: str, *parts: MapPart[Region]) -> str:
        return tell_rows(
            told, heading, COLUMNS, parts, lambda region: _region_row(view.world, region)
        )

    rooms = f"Rooms{_say_open_spaces(view.rooms)}"
    if not told.is_first:
        return table(f"{rooms} and corridors", view.rooms, view.corridors)
    rooms = table(f"{rooms}, smallest first", view.rooms)
    return f"{rooms}\n\n{table('Corridors, smallest first', view.corridors)}"


def say_sizes(world: WorldModel, regions: Sequence[Region]) -> str:
    """Say which room is the smallest and which the largest, corridors left out.

    Rooms that may be parts of others are not counted, and named apart with what they would change.
    The words tell whether these are some or all of the rooms.
    """
    rooms = _rooms_by_size(regions)
    is_of_all = len(rooms) == len(_rooms_by_size(world.rooms.regions))
    so_far = " so far" if world.may_hide_rooms else ""
    doors = [world.rooms.find_doubtful_door(room) for room in rooms]
    sure = [room for room, door in zip(rooms, doors, strict=True) if door is None]
    unsure = [
        (f"{room.id} ({say_floor(world, room)} m2{_say_against(sure, room)})", door)
        for room, door in zip(rooms, doors, strict=True)
        if door
    ]
    names = [_say_size(world, room) for room in sure]
    lines = [say_ranks(names, is_of_all=is_of_all, has_unsure=bool(unsure), so_far=so_far)]
    for smallest, second in list(pairwise(sure))[:1]:
        if smallest.floor_area_m2 + world.growth_m2.get(smallest.id, 0) > second.floor_area_m2:
            lines.append(f"{smallest.id} may turn out larger than {second.id}.")
    return " ".join([*lines, *say_unsure(unsure)])


def _say_against(sure: Sequence[Region], room: Region) -> str:
    """Say where an unsure room would be the smallest or the largest."""
    if not sure:
        return ""
    if room.floor_area_m2 < sure[0].floor_area_m2:
        return f", smaller than {sure[0].id}"
    return f", larger than {sure[-1].id}" if room.floor_area_m2 > sure[-1].floor_area_m2 else ""


def say_walk(region: Region, walk: CorridorWalk) -> str:
    """List the doors along a corridor, side by side in their order."""
    sides = []
    for side in (
        DoorSide.BEHIND,
        DoorSide.LEFT,
        DoorSide.RIGHT,
        DoorSide.AHEAD,
        DoorSide.ELSEWHERE,
    ):
        stops = [_say_stop(stop) for stop in walk.stops if stop.side is side]
        if stops:
            sides.append(f"{side}: {list_some(stops, most=MOST_STOPS)}")
    bend = abs(math.remainder(walk.end_heading_rad - walk.heading_rad, math.tau))
    bends = f", at the end {say_compass(walk.end_heading_rad)}" if bend > BENT_RAD else ""
    return (
        f"Along {region.id}, {walk.length_m:.1f} m from {say_point(walk.start)} going "
        f"{say_compass(walk.heading_rad)}{bends} to {say_point(walk.end)}: "
        f"{'; '.join(sides) or 'no doors'}."
    )


def _say_stop(stop: PassedDoor) -> str:
    if stop.side is DoorSide.ELSEWHERE:
        return f"{stop.region_id} ({stop.door_id})"
    return f"{stop.region_id} ({stop.door_id}, {stop.along_m:.1f} m)"


def _say_open_spaces(rooms: MapPart[Region]) -> str:
    has_any = any(region.room_class is RoomClass.OPEN_SPACE for region in rooms.items)
    return " and open spaces (O)" if has_any else ""


def _region_row(world: WorldModel, region: Region) -> Sequence[str]:
    standing = find_standing_point(world, region)
    doors = [_say_door(world, region, door) for door in world.rooms.doors_of(region)]
    doubtful = world.rooms.find_doubtful_door(region)
    doubt = f" ({say_doubtful_door(region, doubtful)})" if doubtful else ""
    return (
        region.id,
        f"{say_floor(world, region)}{doubt}",
        f"{region.free_area_m2:.1f}",
        f"{region.length_m:.1f} x {region.width_m:.1f}",
        say_point(choose_standing_point(world, region)),
        say_path(None if standing is None else world.path_m(standing)),
        list_some(doors, most=MOST_STOPS) or "none",
    )


def _say_door(world: WorldModel, region: Region, door: Door) -> str:
    one, other = door.region_ids
    is_passable = world.find_crossing(door) is not None
    return f"{door.id}>{other if one == region.id else one}{'' if is_passable else ' (no way)'}"


def say_floor(world: WorldModel, region: Region) -> str:
    """Return how much floor a region has, with a mark where not all of it has been seen."""
    return f"{region.floor_area_m2:.1f}{'+' if region.id in world.growth_m2 else ''}"


def _say_size(world: WorldModel, room: Region) -> str:
    return f"{room.id} ({say_floor(world, room)} m2)"


def list_sure_rooms(world: WorldModel) -> list[Region]:
    """Return the rooms and open spaces that are no parts of others, the smallest first."""
    rooms = _rooms_by_size(world.rooms.regions)
    return [room for room in rooms if world.rooms.find_doubtful_door(room) is None]


def _rooms_by_size(regions: Sequence[Region]) -> list[Region]:
    rooms = (region for region in regions if region.room_class is not RoomClass.CORRIDOR)
    return sorted(rooms, key=lambda region: region.floor_area_m2)


def _say_reachable(world: WorldModel, regions: Sequence[Region]) -> Sequence[str]:
    """Say which room is the smallest that the robot can get to, where that is another one."""
    by_size = _rooms_by_size(regions)
    reachable = next((room for room in by_size if find_standing_point(world, room)), None)
    if reachable is None or reachable is by_size[0]:
        return ()
    return (f"Of those with a way for the robot the smallest is {_say_size(world, reachable)}.",)
