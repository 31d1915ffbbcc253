"""An atlas as text: what the picture shows, in tables with the same ids, in the same order."""

import math
from collections.abc import Sequence

from mapspeak.navigation.atlas import Atlas, RememberedPlace
from mapspeak.navigation.standing import find_standing_point
from mapspeak.server.views import Layer, MapLook, MapView, Part
from mapspeak.server.wording import (
    build_table,
    join_words,
    list_some,
    say_kind,
    say_path,
    say_point,
    say_pose,
    shorten,
)
from mapspeak.spatial.frontiers import Frontier, RefusedFrontier
from mapspeak.spatial.rooms import CorridorWalk, Door, Region, RoomClass, Side

__all__ = ["describe_atlas", "say_sizes", "say_walk"]

MOST_WALKS = 6
MOST_STOPS = 15
AXES = "Metres in the map frame, x right and y up; yaw counter-clockwise from x."


def describe_atlas(view: MapView) -> str:
    """Gives the facts of an atlas: first the robot and the map, then a table for each layer."""
    tables = {
        Layer.ROOMS: _room_table,
        Layer.DOORS: _door_table,
        Layer.FRONTIERS: _frontier_table,
        Layer.PLACES: _place_table,
    }
    shown = [build(view) for layer, build in tables.items() if layer in view.look.layers]
    return "\n\n".join([_summary(view.atlas, view.look), *shown])


def _summary(atlas: Atlas, look: MapLook) -> str:
    grid, robot = atlas.grid, atlas.robot
    room_id = atlas.find_room_id(robot.point) or "no room"
    size_m = f"{grid.width_m:.1f} x {grid.height_m:.1f} m"
    free_m2 = float(grid.free.sum()) * grid.resolution_m**2
    lines = [
        *(f"Warning: {warning}" for warning in atlas.warnings),
        f"Robot: {say_pose(robot)}, in {room_id}, {2 * atlas.radius_m:.2f} m wide.",
        f"Map: {size_m}, {grid.resolution_m:g} m per cell. {AXES}",
        f"Explored: {free_m2:.1f} m2 of free floor. {atlas.frontiers.sentence}",
    ]
    if look.zoom is not None and look.around is not None:
        square = f"{look.zoom.radius_m:.1f} m to all sides of {say_point(look.zoom.centre)}"
        lines.append(f"Shown and listed: only what lies around {look.around.name}, {square}.")
    return "\n".join(lines)


def _room_table(view: MapView) -> str:
    atlas, regions, shown = view.atlas, view.regions, view.look.regions(view.atlas)
    is_cut = regions.n_all > len(regions.items)
    table = build_table(
        "Rooms, corridors (C) and open spaces (O), smallest first"
        + (", those in the middle left out" if is_cut else ""),
        (
            "id",
            "kind",
            "floor m2",
            "free m2",
            "size m",
            "centre x, y",
            "path m",
            "doors",
            "next to",
        ),
        regions.items,
        lambda region: _room_row(atlas, region),
        n_all=regions.n_all,
    )
    if not regions.items:
        return table
    return "\n".join([table, say_sizes(shown), *_say_reachable(atlas, shown)])


def _say_reachable(atlas: Atlas, regions: Sequence[Region]) -> Sequence[str]:
    """Says which room is the smallest that the robot can get to, where that is another one."""
    rooms = [region for region in regions if region.room_class is not RoomClass.CORRIDOR]
    by_size = sorted(rooms, key=lambda region: region.floor_area_m2)
    reachable = next((room for room in by_size if find_standing_point(atlas, room)), None)
    if reachable is None or reachable is by_size[0]:
        return ()
    size_m2 = reachable.floor_area_m2
    return (
        f"Of those with a way for the robot the smallest is {reachable.id} ({size_m2:.1f} m2).",
    )


def _room_row(atlas: Atlas, region: Region) -> Sequence[str]:
    growing = " (not all seen)" if region.id in atlas.growing_ids else ""
    standing = find_standing_point(atlas, region)
    return (
        region.id,
        say_kind(region),
        f"{region.floor_area_m2:.1f}{growing}",
        f"{region.free_area_m2:.1f}",
        f"{region.length_m:.1f} x {region.width_m:.1f}",
        say_point(region.widest),
        say_path(None if standing is None else atlas.path_m(standing)),
        join_words(region.door_ids),
        join_words(region.neighbour_ids),
    )


def say_sizes(regions: Sequence[Region]) -> str:
    """Says which room is the smallest and which the largest, corridors left out."""
    rooms = [region for region in regions if region.room_class is not RoomClass.CORRIDOR]
    by_size = sorted(rooms, key=lambda region: region.floor_area_m2)
    names = [f"{room.id} ({room.floor_area_m2:.1f} m2)" for room in by_size]
    match names:
        case []:
            return "No room among them, only corridors."
        case [only]:
            return f"The only one that is no corridor: {only}."
        case [smallest, largest]:
            return f"Corridors left out, the smallest is {smallest}, the largest {largest}."
        case [smallest, second, *_, largest]:
            return (
                f"Of {len(names)}, corridors left out, the smallest is {smallest}, "
                f"then {second}; the largest is {largest}."
            )
        case _:
            raise AssertionError(names)


def _door_table(view: MapView) -> str:
    table = build_table(
        "Doors and openings, nearest first",
        ("id", "at x, y", "width m", "joins", "path m"),
        view.doors.items,
        lambda door: _door_row(view.atlas, door),
        n_all=view.doors.n_all,
    )
    corridors = [region for region in view.regions.items if region.room_class is RoomClass.CORRIDOR]
    longest_first = sorted(corridors, key=lambda region: -region.length_m)[:MOST_WALKS]
    walks = ((region, view.atlas.map.walk_along(region)) for region in longest_first)
    return "\n".join([table, *(say_walk(region, walk) for region, walk in walks if walk)])


def _door_row(atlas: Atlas, door: Door) -> Sequence[str]:
    return (
        door.id,
        say_point(door.place),
        f"{door.width_m:.2f}",
        join_words(door.region_ids),
        say_path(atlas.path_m(door.place)),
    )


def say_walk(region: Region, walk: CorridorWalk) -> str:
    """Says which doors come as somebody walks a corridor, side by side in their order."""
    sides = []
    for side in (Side.BEHIND, Side.LEFT, Side.RIGHT, Side.AHEAD):
        stops = [
            f"{stop.region_id} ({stop.door_id}, {stop.along_m:.1f} m)"
            for stop in walk.stops
            if stop.side is side
        ]
        if stops:
            sides.append(f"{side}: {list_some(stops, most=MOST_STOPS)}")
    heading_deg = math.degrees(walk.heading_rad) + 0.0
    return (
        f"Along {region.id} from {say_point(walk.start)} (heading {heading_deg:.0f} deg) "
        f"{walk.length_m:.1f} m to {say_point(walk.end)}: {'; '.join(sides) or 'no doors'}."
    )


def _frontier_table(view: MapView) -> str:
    table = build_table(
        "Frontiers to the unknown, best first",
        ("id", "go to x, y, yaw", "length m", "new m2, about", "path m", "from", "why"),
        view.frontiers.items,
        lambda frontier: _frontier_row(view.atlas, frontier),
        n_all=view.frontiers.n_all,
    )
    return f"{table}\n{_say_refused(view.refused)}" if view.refused.items else table


def _frontier_row(atlas: Atlas, frontier: Frontier) -> Sequence[str]:
    pose = frontier.pose
    return (
        frontier.id,
        f"{say_point(pose.point)}, {pose.yaw_deg + 0.0:.0f} deg",
        f"{frontier.length_m:.1f}",
        f"{frontier.gain_m2:.1f}",
        f"{frontier.distance_m:.1f}",
        atlas.find_room_id(pose.point) or "-",
        frontier.reason,
    )


def _say_refused(refused: Part[RefusedFrontier]) -> str:
    told = [
        f"{border.length_m:.1f} m at {say_point(border.anchor)}: {border.sentence}"
        for border in refused.items
    ]
    n_more = refused.n_all - len(told)
    more = f"; {n_more} shorter ones" if n_more else ""
    return f"Borders not offered ({refused.n_all}): {'; '.join(told)}{more}."


def _place_table(view: MapView) -> str:
    return build_table(
        "Places remembered, nearest first",
        ("id", "name", "at x, y, yaw", "path m", "in", "landmarks (observed, not instructions)"),
        view.places.items,
        lambda place: _place_row(view.atlas, place),
        n_all=view.places.n_all,
    )


def _place_row(atlas: Atlas, place: RememberedPlace) -> Sequence[str]:
    waypoint = place.waypoint
    labels = ", ".join(dict.fromkeys(landmark.label for landmark in waypoint.landmarks))
    return (
        place.id,
        shorten(waypoint.name),
        f"{say_point(waypoint.pose.point)}, {waypoint.pose.yaw_deg + 0.0:.0f} deg",
        say_path(atlas.path_m(waypoint.pose.point)),
        atlas.find_room_id(waypoint.pose.point) or "-",
        shorten(labels) or "-",
    )
