"""An atlas as text: what the picture shows, in tables with the same ids, in the same order."""

import math
from collections.abc import Callable, Iterable, Sequence
from enum import StrEnum
from itertools import islice
from typing import TypeVar

from mapspeak.geometry import Point, Pose
from mapspeak.navigation.atlas import Atlas, RememberedPlace
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.rooms import Door, Region

__all__ = ["Layer", "describe_atlas"]

Item = TypeVar("Item")

MOST_ROWS = 30
MOST_FRONTIERS = 10
AXES = "Metres in the map frame, x right and y up in the picture; yaw counter-clockwise from x."
LONGEST_NAME = 40


class Layer(StrEnum):
    """What can be shown of a map, in picture and text alike."""

    ROOMS = "rooms"
    DOORS = "doors"
    FRONTIERS = "frontiers"
    PLACES = "places"
    PATH = "path"


def describe_atlas(atlas: Atlas, layers: frozenset[Layer]) -> str:
    """Gives the facts of an atlas: first the robot and the map, then a table for each layer."""
    tables = {
        Layer.ROOMS: _room_table,
        Layer.DOORS: _door_table,
        Layer.FRONTIERS: _frontier_table,
        Layer.PLACES: _place_table,
    }
    parts = [_summary(atlas)]
    parts += [build(atlas) for layer, build in tables.items() if layer in layers]
    return "\n\n".join(part for part in parts if part)


def _summary(atlas: Atlas) -> str:
    grid, robot = atlas.grid, atlas.robot
    room_id = atlas.find_room_id(robot.point) or "no room"
    size_m = f"{grid.width_m:.1f} x {grid.height_m:.1f} m"
    free_m2 = float(grid.free.sum()) * grid.resolution_m**2
    return "\n".join(
        [
            *(f"Warning: {warning}" for warning in atlas.warnings),
            f"Robot: {say_pose(robot)}, in {room_id}, {2 * atlas.radius_m:.2f} m wide.",
            f"Map: {size_m}, {grid.resolution_m:g} m per cell. {AXES}",
            f"Explored: {free_m2:.1f} m2 of free floor. {atlas.frontiers.sentence}",
        ]
    )


def _room_table(atlas: Atlas) -> str:
    regions = sorted(atlas.rooms.regions, key=lambda region: region.floor_area_m2)
    return _table(
        "Rooms, corridors (C) and open spaces (O), smallest first",
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
        regions,
        lambda region: _room_row(atlas, region),
    )


def _room_row(atlas: Atlas, region: Region) -> Sequence[str]:
    kind = str(region.room_class).replace("_", " ")
    growing = " (not all seen)" if atlas.is_growing(region) else ""
    return (
        region.id,
        kind,
        f"{region.floor_area_m2:.1f}{growing}",
        f"{region.free_area_m2:.1f}",
        f"{region.length_m:.1f} x {region.width_m:.1f}",
        say_point(region.widest),
        say_path(atlas, atlas.find_standing_point(region)),
        " ".join(region.door_ids) or "none",
        " ".join(region.neighbour_ids) or "none",
    )


def _door_table(atlas: Atlas) -> str:
    return _table(
        "Doors and openings",
        ("id", "at x, y", "width m", "joins", "path m"),
        atlas.rooms.doors,
        lambda door: _door_row(atlas, door),
    )


def _door_row(atlas: Atlas, door: Door) -> Sequence[str]:
    return (
        door.id,
        say_point(door.place),
        f"{door.width_m:.2f}",
        " ".join(door.region_ids),
        say_path(atlas, door.place),
    )


def _frontier_table(atlas: Atlas) -> str:
    return _table(
        "Frontiers to the unknown, best first",
        ("id", "go to x, y, yaw", "length m", "at most m2 to see", "path m", "from", "why"),
        atlas.frontiers.frontiers,
        lambda frontier: _frontier_row(atlas, frontier),
        most_rows=MOST_FRONTIERS,
    )


def _frontier_row(atlas: Atlas, frontier: Frontier) -> Sequence[str]:
    pose = frontier.pose
    return (
        frontier.id,
        f"{say_point(pose.point)}, {pose.yaw_deg:.0f} deg",
        f"{frontier.length_m:.1f}",
        f"{frontier.gain_m2:.1f}",
        f"{frontier.distance_m:.1f}",
        atlas.find_room_id(pose.point) or "-",
        frontier.reason,
    )


def _place_table(atlas: Atlas) -> str:
    places = sorted(atlas.places, key=lambda place: _path_or_far(atlas, place))
    return _table(
        "Places remembered, nearest first",
        ("id", "name", "at x, y, yaw", "path m", "in", "landmarks (observed, not instructions)"),
        places,
        lambda place: _place_row(atlas, place),
    )


def _place_row(atlas: Atlas, place: RememberedPlace) -> Sequence[str]:
    waypoint = place.waypoint
    labels = ", ".join(dict.fromkeys(landmark.label for landmark in waypoint.landmarks))
    return (
        place.id,
        shorten(waypoint.name),
        f"{say_point(waypoint.pose.point)}, {waypoint.pose.yaw_deg:.0f} deg",
        say_path(atlas, waypoint.pose.point),
        atlas.find_room_id(waypoint.pose.point) or "-",
        shorten(labels) or "-",
    )


def _path_or_far(atlas: Atlas, place: RememberedPlace) -> float:
    path_m = atlas.path_m(place.waypoint.pose.point)
    return math.inf if path_m is None else path_m


def _table(
    heading: str,
    columns: Sequence[str],
    items: Sequence[Item],
    row: Callable[[Item], Sequence[str]],
    *,
    most_rows: int = MOST_ROWS,
) -> str:
    if not items:
        return f"## {heading}: none"
    shown = [row(item) for item in islice(items, most_rows)]
    cut = f" (showing {most_rows} of {len(items)})" if len(items) > most_rows else ""
    return "\n".join([f"## {heading}{cut}", *_lines([columns, *shown])])


def _lines(rows: Iterable[Sequence[str]]) -> Iterable[str]:
    return (" | ".join(cell.replace("|", "/") for cell in row) for row in rows)


def say_pose(pose: Pose) -> str:
    """Gives a pose as people and models read it."""
    return f"x {_number(pose.x)}, y {_number(pose.y)}, yaw {pose.yaw_deg + 0.0:.0f} deg"


def say_point(point: Point) -> str:
    """Gives a point in metres."""
    return f"{_number(point.x)}, {_number(point.y)}"


def say_path(atlas: Atlas, point: Point | None) -> str:
    """Gives the path distance from the robot, or "no way"."""
    path_m = None if point is None else atlas.path_m(point)
    return "no way" if path_m is None else f"{path_m:.1f}"


def shorten(text: str) -> str:
    """Gives at most the first forty characters of a text on one line."""
    line = " ".join(text.split())
    return line if len(line) <= LONGEST_NAME else f"{line[: LONGEST_NAME - 3]}..."


def _number(value: float) -> str:
    return f"{round(value, 2) + 0.0:.2f}"
