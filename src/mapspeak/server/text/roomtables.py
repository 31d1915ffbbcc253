"""Rooms and corridors as text: tables by size, and the doors along a corridor."""

import math
from collections.abc import Sequence

from mapspeak.places.standing import choose_standing_point, find_standing_point
from mapspeak.server.text.look import MapPart, MapView
from mapspeak.server.text.wording import (
    build_table,
    list_some,
    say_compass,
    say_kind,
    say_path,
    say_point,
)
from mapspeak.spatial.rooms import CorridorWalk, Door, DoorSide, PassedDoor, Region, RoomClass
from mapspeak.worldmodel.model import WorldModel

MOST_STOPS = 15
COLUMNS = ("id", "kind", "floor m2", "free m2", "size m", "stand at x, y", "path m", "doors")
BENT_RAD = math.radians(45)


def room_tables(view: MapView) -> str:
    """Return a table of rooms and one of corridors, with what is to be said of their sizes."""
    shown = view.look.regions(view.world)
    rooms = build_table(
        f"Rooms{_say_open_spaces(view.rooms)}, smallest first",
        COLUMNS,
        view.rooms.items,
        lambda region: _region_row(view.world, region),
        n_all=view.rooms.n_all,
        gap_after=view.rooms.gap_after,
    )
    corridors = build_table(
        "Corridors, smallest first",
        COLUMNS,
        view.corridors.items,
        lambda region: _region_row(view.world, region),
        n_all=view.corridors.n_all,
        gap_after=view.corridors.gap_after,
    )
    sizes = [say_sizes(view.world, shown), *_say_reachable(view.world, shown)]
    return "\n\n".join(["\n".join([rooms, *sizes]), corridors])


def say_sizes(world: WorldModel, regions: Sequence[Region]) -> str:
    """Say which room is the smallest and which the largest, corridors left out."""
    names = [_say_size(world, room) for room in _rooms_by_size(regions)]
    match names:
        case []:
            return "No rooms among them."
        case [only]:
            return f"The only room: {only}."
        case [smallest, largest]:
            return f"The smaller room is {smallest}, the larger {largest}."
        case [smallest, second, *_, largest]:
            return (
                f"Of {len(names)} rooms the smallest is {smallest}, then {second}; "
                f"the largest is {largest}."
            )
        case _:
            raise AssertionError(names)


def say_walk(region: Region, walk: CorridorWalk) -> str:
    """Say which doors come as somebody walks a corridor, side by side in their order."""
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
    return (
        region.id,
        say_kind(region),
        f"{region.floor_area_m2:.1f}{_say_growing(world, region)}",
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


def _say_growing(world: WorldModel, region: Region) -> str:
    return " (not all seen)" if region.id in world.growing_ids else ""


def _say_size(world: WorldModel, room: Region) -> str:
    seen = ", not all seen" if room.id in world.growing_ids else ""
    return f"{room.id} ({room.floor_area_m2:.1f} m2{seen})"


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
