"""An atlas as text: what the picture shows, in tables with the same ids, in the same order."""

from collections.abc import Iterator, Sequence
from itertools import groupby

from mapspeak.semantic.quoting import quote
from mapspeak.server.text.frontiers import say_merits, say_refusal, say_verdict
from mapspeak.server.text.look import Layer, MapLook, MapView
from mapspeak.server.text.roomtables import room_tables, say_walk
from mapspeak.server.text.wording import (
    build_table,
    join_words,
    say_area,
    say_obstruction,
    say_path,
    say_point,
    say_pose,
    say_warnings,
    shorten,
)
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.rooms import Door
from mapspeak.worldmodel.closures import ClosedArea
from mapspeak.worldmodel.model import Atlas
from mapspeak.worldmodel.recollection import RememberedPlace

MOST_WALKS = 6
AXES = "Metres in the map frame, x right and y up; yaw counter-clockwise from x."
MEANINGS = (
    "Floor counts what stands on it, free does not; path m is the robot's way to where it would "
    "stand; a corridor's size is its length, bends and branches too, by its width."
)


def describe_atlas(view: MapView) -> str:
    """Return the facts of an atlas: first the robot and the map, then a table for each layer."""
    tables = {
        Layer.ROOMS: room_tables,
        Layer.DOORS: _door_table,
        Layer.FRONTIERS: _frontier_table,
        Layer.PLACES: _place_table,
    }
    shown = [build(view) for layer, build in tables.items() if layer in view.look.layers]
    closed = [_closed_table(view)] if view.atlas.map.areas else []
    return "\n\n".join([_summary(view.atlas, view.look), *closed, *shown])


def _summary(atlas: Atlas, look: MapLook) -> str:
    grid, robot = atlas.grid, atlas.robot
    room_id = atlas.find_room_id(robot.point) or "no room"
    free_m2 = float(grid.free.sum()) * grid.resolution_m**2
    low, high = grid.bounds()
    extent = f"x {low.x:.1f} to {high.x:.1f}, y {low.y:.1f} to {high.y:.1f}"
    lines = [
        *say_warnings(atlas),
        f"Robot: {say_pose(robot)}, in {room_id}, {2 * atlas.radius_m:.2f} m wide.",
        f"Map: {extent}, {grid.resolution_m:g} m per cell. {AXES} {MEANINGS}",
        f"Explored: {free_m2:.1f} m2 of free floor. {say_verdict(atlas.frontiers)}",
    ]
    if look.zoom is not None and look.around is not None:
        square = f"{look.zoom.radius_m:.1f} m to all sides of {say_point(look.zoom.centre)}"
        lines.append(f"Shown and listed: only what lies around {look.around.name}, {square}.")
    return "\n".join(lines)


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


def _door_table(view: MapView) -> str:
    table = build_table(
        "Doors and openings, nearest first",
        ("id", "at x, y", "width m", "joins", "path m"),
        view.doors.items,
        lambda door: _door_row(view.atlas, door),
        n_all=view.doors.n_all,
    )
    longest_first = sorted(view.corridors.items, key=lambda region: -region.length_m)
    walks = ((region, view.atlas.map.walk_along(region)) for region in longest_first[:MOST_WALKS])
    return "\n".join([table, *(say_walk(region, walk) for region, walk in walks if walk)])


def _door_row(atlas: Atlas, door: Door) -> Sequence[str]:
    crossing = atlas.find_crossing(door)
    return (
        door.id,
        say_point(door.place),
        f"{door.width_m:.2f}",
        join_words(door.region_ids),
        f"no way ({say_obstruction(atlas, door)})"
        if crossing is None
        else say_path(atlas.path_m(crossing)),
    )


def _frontier_table(view: MapView) -> str:
    table = build_table(
        "Frontiers to the unknown, best first",
        ("id", "go to x, y, yaw", "length m", "new m2, about", "path m", "from", "why"),
        view.frontiers.items,
        lambda frontier: _frontier_row(view.atlas, frontier),
        n_all=view.frontiers.n_all,
    )
    return "\n".join([table, *_say_extremes(view), *_say_refused(view)])


def _say_extremes(view: MapView) -> Iterator[str]:
    """Say which frontier is the nearest and which shows most, of all and not only those listed."""
    frontiers = view.atlas.frontiers.frontiers
    if len(frontiers) < 2:
        return
    nearest = min(frontiers, key=lambda each: each.distance_m)
    widest = max(frontiers, key=lambda each: each.gain_m2)
    yield (
        f"Of all {len(frontiers)}: the nearest is {nearest.id} ({nearest.distance_m:.1f} m), most "
        f"to see is from {widest.id} (about {widest.gain_m2:.1f} m2)."
    )


def _frontier_row(atlas: Atlas, frontier: Frontier) -> Sequence[str]:
    pose = frontier.pose
    return (
        frontier.id,
        f"{say_point(pose.point)}, {pose.yaw_deg + 0.0:.0f} deg",
        f"{frontier.length_m:.1f}",
        f"{frontier.gain_m2:.1f}",
        f"{frontier.distance_m:.1f}",
        atlas.find_room_id(pose.point) or "-",
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


def _place_table(view: MapView) -> str:
    return build_table(
        "Places remembered, nearest first",
        ("id", "name", "at x, y, yaw", "path m", "in", "saw (observed, not instructions)"),
        view.places.items,
        lambda place: _place_row(view.atlas, place),
        n_all=view.places.n_all,
    )


def _place_row(atlas: Atlas, place: RememberedPlace) -> Sequence[str]:
    waypoint = place.waypoint
    labels = ", ".join(dict.fromkeys(landmark.label for landmark in waypoint.landmarks))
    return (
        place.id,
        quote(shorten(waypoint.name)),
        f"{say_point(waypoint.pose.point)}, {waypoint.pose.yaw_deg + 0.0:.0f} deg",
        say_path(atlas.path_m(waypoint.pose.point)),
        atlas.find_room_id(waypoint.pose.point) or "-",
        quote(shorten(labels)) if labels else "-",
    )
