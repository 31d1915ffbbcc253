"""World files: YAML that people write, read into a `World`.

Lengths are metres in the world's own frame (x right, y up on the plan), angles are degrees counter-
clockwise. `docs/reference/world-files.md` explains every key.
"""

import difflib
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from mapspeak.errors import ConfigError, say_cause, say_nearest
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.simulator.worlds.models import kind_names
from mapspeak.simulator.worlds.slices import slice_world
from mapspeak.simulator.worlds.world import (
    BODY_BAND_M,
    BODY_RADIUS_M,
    TrueRoom,
    World,
    WorldDoor,
    WorldObject,
    WorldWall,
    build_map_world,
)
from mapspeak.spatial.mapfiles import load_map
from mapspeak.spatial.rooms import RoomClass

_DOOR_REACH_M = 0.05
"""Tolerance for a door beside a wall's centre line, beyond half the wall's thickness."""

_IN_LINE_SINE = 0.02
"""The sine of the angle below which a wall counts as in line with a door."""

_Location = tuple[str | int, ...]
_Coordinate = Annotated[float, Field(ge=-500, le=500)]
_Place = tuple[_Coordinate, _Coordinate]
_Angle = Annotated[float, Field(ge=-360, le=360)]
_Name = Annotated[str, Field(min_length=1, max_length=80)]
_Height = Annotated[float, Field(gt=0, le=30)]
_Thickness = Annotated[float, Field(ge=0.01, le=2)]


def world_names() -> tuple[str, ...]:
    """Return the names of the worlds that come with mapspeak."""
    files = resources.files("mapspeak.simulator.worlds").iterdir()
    return tuple(sorted(file.name[:-5] for file in files if file.name.endswith(".yaml")))


def load_world(name_or_path: str | Path) -> World:
    """Read a shipped world by its name, or a world file or a map's .yaml by its path.

    A map that map_server loads becomes a building without objects.

    Raises:
        ConfigError: There is no such world, or its file has a fault; the message names the file,
            the line and the fault.
        MapError: A map is damaged, or the robot fits nowhere on it.
    """
    label, stem, text = _read_text(name_or_path)
    tree = _parse_yaml(text, label)
    if "image" in tree:
        return build_map_world(load_map(Path(name_or_path)).grid, name=stem)
    return _read_tree(tree, label, stem)


def parse_world(text: str, *, name: str) -> World:
    """Read the text of a world file.

    Raises:
        ConfigError: It has a fault; the message names the line and the fault.
    """
    return _read_tree(_parse_yaml(text, name), name, name)


def _read_tree(tree: CommentedMap, label: str, stem: str) -> World:
    try:
        written = _WorldFile.model_validate(tree)
        world = _build_world(written, stem)
        _check_start(world)
    except ValidationError as error:
        first = error.errors()[0]
        raise _fault(label, tree, first["loc"], first["msg"]) from error
    except _FaultError as error:
        raise _fault(label, tree, error.location, error.message) from error
    return world


def read_world_text(name_or_path: str | Path) -> str:
    """Return the text of a world's file.

    Raises:
        ConfigError: There is no such world.
    """
    return _read_text(name_or_path)[2]


def write_as_changed(name_or_path: str | Path, world: World, path: Path) -> Path:
    """Write a world file with the changes of a world that was made from it; return its path.

    Added things, shut doors, the battery and the faults of skills are written.

    Raises:
        ConfigError: The world is made from a map, which has no things.
    """
    yaml = YAML(typ="safe", pure=True)
    tree = yaml.load(read_world_text(name_or_path))
    if "image" in tree:
        raise ConfigError(
            f"{name_or_path} is a map: nothing can be put into it.", hint="Use a world file."
        )
    written = tree.get("objects", [])
    tree["objects"] = [*written, *map(_as_written, world.objects[len(written) :])]
    for door, told in zip(world.doors, tree.get("doors", []), strict=True):
        told["shut"] = door.is_shut
    tree["battery_percent"] = 100 * world.battery_ratio
    tree["faults"] = dict(world.n_faults)
    with path.open("w", encoding="utf-8") as file:
        yaml.dump(tree, file)
    return path


def _as_written(thing: WorldObject) -> dict[str, object]:
    pose = thing.pose
    written: dict[str, object] = {
        "name": thing.name,
        "kind": thing.kind,
        "at": [pose.x, pose.y],
        "yaw_deg": math.degrees(pose.yaw_rad),
    }
    if thing.base_height_m is not None:
        written["base_height_m"] = thing.base_height_m
    return written


# --- what a file says ------------------------------------------------------------------------


class _Written(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class _WrittenPose(_Written):
    at: _Place
    yaw_deg: _Angle = 0.0


class _WrittenWall(_Written):
    line: Annotated[tuple[_Place, ...], Field(min_length=2)]
    height_m: _Height | None = None
    thickness_m: _Thickness | None = None


class _WrittenDoor(_Written):
    at: _Place
    width_m: Annotated[float, Field(gt=0, le=50)]
    name: _Name | None = None
    is_shut: Annotated[bool, Field(alias="shut")] = False


class _WrittenRoom(_Written):
    name: _Name
    room_class: Annotated[RoomClass, Field(alias="class")]
    outline: Annotated[tuple[_Place, ...], Field(min_length=3)]


class _WrittenObject(_Written):
    name: _Name
    kind: str
    at: _Place
    yaw_deg: _Angle = 0.0
    base_height_m: Annotated[float, Field(ge=0, le=30)] | None = None


class _WorldFile(_Written):
    title: Annotated[str, Field(min_length=1, max_length=300)]
    wall_height_m: _Height = 2.6
    wall_thickness_m: _Thickness = 0.12
    start: _WrittenPose
    walls: Annotated[tuple[_WrittenWall, ...], Field(min_length=1)]
    doors: tuple[_WrittenDoor, ...] = ()
    rooms: tuple[_WrittenRoom, ...] = ()
    objects: tuple[_WrittenObject, ...] = ()
    battery_percent: Annotated[float, Field(ge=0, le=100)] = 100.0
    faults: dict[_Name, Annotated[int, Field(ge=0, le=100)]] = {}


# --- from a file to its faults ---------------------------------------------------------------


class _FaultError(Exception):
    """A fault that concerns several fields, at a place in the file."""

    def __init__(self, location: _Location, message: str) -> None:
        super().__init__(message)
        self.location = location
        self.message = message


def _read_text(name_or_path: str | Path) -> tuple[str, str, str]:
    """Return how to call the file, the world's name and the text."""
    name = str(name_or_path)
    if name in world_names():
        file = resources.files("mapspeak.simulator.worlds").joinpath(f"{name}.yaml")
        return f"{name}.yaml", name, file.read_text(encoding="utf-8")
    path = Path(name_or_path)
    try:
        return str(path), path.stem, path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        names = world_names()
        raise ConfigError(
            f"There is no world {name!r}: it is no shipped world, and as a file it cannot be read"
            f" ({say_cause(error)}).",
            hint=f"{say_nearest(name, names)}Name one of {', '.join(names)}, or a world file.",
        ) from error


def _parse_yaml(text: str, label: str) -> CommentedMap:
    try:
        tree = YAML(typ="rt", pure=True).load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark
        line = mark.line + 1 if mark else 1
        raise _fault_at(label, line, str(error.problem)) from error
    except (ValueError, RecursionError, YAMLError) as error:
        raise _fault_at(label, 1, str(error)) from error
    if not isinstance(tree, CommentedMap):
        raise _fault_at(label, 1, "a world file is a mapping of keys such as walls and start")
    return tree


def _fault(label: str, tree: CommentedMap, location: _Location, message: str) -> ConfigError:
    where = ".".join(str(part) for part in location)
    return _fault_at(label, _line_of(tree, location), f"{where}: {message}" if where else message)


def _fault_at(label: str, line: int, message: str) -> ConfigError:
    return ConfigError(
        f"{label}, line {line}: {message}.",
        hint="Correct the line; docs/reference/world-files.md explains every key.",
    )


def _line_of(tree: CommentedMap, location: _Location) -> int:
    """Return the line of the deepest part of a location that stands in the file, from 1."""
    node: Any = tree
    line = 0
    for part in location:
        if isinstance(node, CommentedMap) and part in node:
            line = node.lc.key(part)[0]
        elif isinstance(node, CommentedSeq) and isinstance(part, int) and part < len(node):
            line = node.lc.item(part)[0]
        else:
            break
        node = node[part]
    return line + 1


# --- from a file to a world ------------------------------------------------------------------


def _build_world(written: _WorldFile, name: str) -> World:
    _check_names("rooms", [room.name for room in written.rooms])
    _check_names("objects", [thing.name for thing in written.objects])
    _check_kinds(written.objects)
    whole_walls = list(_raise_walls(written))
    doors = tuple(_place_doors(written.doors, whole_walls))
    _check_names("doors", [door.name for door in doors])
    return World(
        name=name,
        title=written.title,
        walls=tuple(piece for wall in whole_walls for piece in _cut_wall(wall, doors)),
        objects=tuple(_place_object(thing) for thing in written.objects),
        rooms=tuple(_outline_room(room, index) for index, room in enumerate(written.rooms)),
        start=_pose(written.start.at, written.start.yaw_deg),
        doors=doors,
        battery_ratio=written.battery_percent / 100,
        n_faults=written.faults,
    )


def _check_names(section: str, names: Sequence[str]) -> None:
    for index, name in enumerate(names):
        if name in names[:index]:
            raise _FaultError((section, index), f"the name {name!r} is taken already")


def _check_kinds(objects: Sequence[_WrittenObject]) -> None:
    kinds = sorted(kind_names())
    for index, thing in enumerate(objects):
        if thing.kind not in kinds:
            near = difflib.get_close_matches(thing.kind, kinds, n=3) or kinds
            raise _FaultError(
                ("objects", index, "kind"),
                f"there is no kind {thing.kind!r}; perhaps one of {', '.join(near)}",
            )


def _check_start(world: World) -> None:
    low_m, high_m = BODY_BAND_M
    solids = slice_world(world, low_m=low_m, high_m=high_m)
    if not solids.has_room_at(world.start.point, radius_m=BODY_RADIUS_M):
        raise _FaultError(
            ("start", "at"), f"the robot, {BODY_RADIUS_M} m in radius, does not fit here"
        )


def _raise_walls(written: _WorldFile) -> Iterator[WorldWall]:
    """Turn each line into straight walls, each longer by half its thickness: corners close."""
    for index, wall in enumerate(written.walls):
        thickness = wall.thickness_m or written.wall_thickness_m
        for first, second in zip(wall.line, wall.line[1:], strict=False):
            if first == second:
                raise _FaultError(("walls", index, "line"), f"the point {first} comes twice")
            straight = WorldWall(
                start=Point(*first),
                end=Point(*second),
                thickness_m=thickness,
                height_m=wall.height_m or written.wall_height_m,
            )
            yield _shorten(straight, -thickness / 2, straight.length_m + thickness / 2)


def _place_doors(doors: Sequence[_WrittenDoor], walls: Sequence[WorldWall]) -> Iterator[WorldDoor]:
    for index, door in enumerate(doors):
        middle = Point(*door.at)
        nearest = min(walls, key=lambda wall: _distance_beside(wall, middle))
        beside = _distance_beside(nearest, middle)
        if beside > nearest.thickness_m / 2 + _DOOR_REACH_M:
            raise _FaultError(
                ("doors", index, "at"), f"no wall is here; the nearest one is {beside:.2f} m away"
            )
        yield WorldDoor(
            name=door.name or f"door {index + 1}",
            pose=Pose(middle.x, middle.y, wrap_angle(nearest.pose.yaw_rad)),
            width_m=door.width_m,
            is_shut=door.is_shut,
        )


def _distance_beside(wall: WorldWall, point: Point) -> float:
    """Return the distance from a point to a wall's centre line."""
    along = wall.pose.inverse().transform(point).x
    return wall.point_at(min(max(along, 0.0), wall.length_m)).distance_to(point)


def _cut_wall(wall: WorldWall, doors: Sequence[WorldDoor]) -> Iterator[WorldWall]:
    """Return the pieces of a wall that its doors leave standing."""
    position = 0.0
    for low, high in sorted(_gaps(wall, doors)):
        if low > position:
            yield _shorten(wall, position, low)
        position = max(position, high)
    if position < wall.length_m:
        yield _shorten(wall, position, wall.length_m)


def _shorten(wall: WorldWall, low_m: float, high_m: float) -> WorldWall:
    return replace(wall, start=wall.point_at(low_m), end=wall.point_at(high_m))


def _gaps(wall: WorldWall, doors: Sequence[WorldDoor]) -> Iterator[tuple[float, float]]:
    """Return from where to where each door cuts a wall: one it stands in line with."""
    wall_from_world = wall.pose.inverse()
    for door in doors:
        door_in_wall = wall_from_world @ door.pose
        is_in_line = abs(math.sin(door_in_wall.yaw_rad)) < _IN_LINE_SINE
        if is_in_line and abs(door_in_wall.y) <= wall.thickness_m / 2 + _DOOR_REACH_M:
            low = max(door_in_wall.x - door.width_m / 2, 0.0)
            high = min(door_in_wall.x + door.width_m / 2, wall.length_m)
            if low < high:
                yield low, high


def _outline_room(room: _WrittenRoom, index: int) -> TrueRoom:
    outline = tuple(Point(*corner) for corner in room.outline)
    if len(set(outline)) < 3:
        raise _FaultError(("rooms", index, "outline"), "an outline needs three different corners")
    return TrueRoom(name=room.name, room_class=room.room_class, outline=outline)


def _place_object(thing: _WrittenObject) -> WorldObject:
    return WorldObject(
        name=thing.name,
        kind=thing.kind,
        pose=_pose(thing.at, thing.yaw_deg),
        base_height_m=thing.base_height_m,
    )


def _pose(at: _Place, yaw_deg: float) -> Pose:
    return Pose(at[0], at[1], wrap_angle(math.radians(yaw_deg)))
