"""Unite two memories of one map, and their files."""

import shutil
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path

from mapspeak.atomic import sync_folder
from mapspeak.errors import SemanticMapError
from mapspeak.memory.episodes.store import BroughtOver, bring_over
from mapspeak.memory.exchange.mounting import mount
from mapspeak.memory.merging import merge_waypoint
from mapspeak.memory.quoting import name_key
from mapspeak.memory.store.memorystore import MemoryStore
from mapspeak.memory.store.records import data_of
from mapspeak.memory.store.semanticmap import SemanticMapStore
from mapspeak.memory.walls import WallFolder
from mapspeak.memory.waypoint import SemanticMap, Waypoint

SAME_PLACE_M = 1.0
"""Poses of one name farther apart are two places."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Union:
    """Two united memories.

    Attributes:
        places: The first memory's in their order, then those only in the second.
        findings: Outcome for each name that differed between both.
    """

    places: SemanticMap
    changed: tuple[Waypoint, ...]
    findings: tuple[str, ...]


def unite(first: SemanticMap, second: SemanticMap) -> Union:
    """Join two memories of one map.

    Places of one name that lie within a metre are joined: the newer says what both say, landmarks
    and layout of both stay. If it is unknown which is newer, they are joined only if that makes no
    difference. Otherwise both stay, the second one with a number behind its name.

    Raises:
        SemanticMapError: They belong to different maps.
    """
    map_id = first.map_id or second.map_id
    if second.map_id not in (None, map_id):
        raise SemanticMapError(
            f"One memory is of the map '{first.map_id}', the other of '{second.map_id}'.",
            hint="Poses of one mean nothing on the other; realign one of them first.",
        )
    places = {name_key(place.name): place for place in first.waypoints}
    taken = places.keys() | {name_key(place.name) for place in second.waypoints}
    findings = []
    for place in second.waypoints:
        key = name_key(place.name)
        mine = places.get(key)
        theirs = place if mine is None else first.frames.bring(place, mine.frame)
        if mine is None:
            places[key] = place
        elif theirs is None or data_of(mine) != data_of(theirs):
            joined, said = (None, APART) if theirs is None else _join(mine, theirs)
            if joined is None:
                joined = _renamed(place, places, taken)
                said = f"{said}: both stay, the second one as '{joined.name}'"
            places[name_key(joined.name)] = joined
            taken |= {name_key(joined.name)}
            findings.append(f"'{place.name}' is in both; {said}.")
    united = tuple(replace(place, map_id=map_id) for place in places.values())
    before = {name_key(place.name): data_of(place) for place in first.waypoints}
    return Union(
        places=SemanticMap(map_id=map_id, waypoints=united),
        changed=tuple(p for p in united if before.get(name_key(p.name)) != data_of(p)),
        findings=tuple(findings),
    )


APART = "nobody knows how the one's map lies to the other's"


def _join(mine: Waypoint, theirs: Waypoint) -> tuple[Waypoint | None, str]:
    """Join both if that is safe; return the result, and what was done or why not."""
    apart_m = mine.pose.point.distance_to(theirs.pose.point)
    if apart_m > SAME_PLACE_M:
        return None, f"they lie {apart_m:.2f} m apart"
    if mine.recorded_at and theirs.recorded_at and mine.recorded_at != theirs.recorded_at:
        is_mine_older = mine.recorded_at < theirs.recorded_at
        older, newer = (mine, theirs) if is_mine_older else (theirs, mine)
        at = max(mine.recorded_at, theirs.recorded_at).isoformat(timespec="seconds")
        # The first one's spelling of the name stays.
        return replace(_joined(older, newer), name=mine.name), f"joined, the record of {at} decides"
    joined = replace(_joined(theirs, mine), name=mine.name)
    if mine.recorded_at is not None and mine.recorded_at == theirs.recorded_at and apart_m == 0:
        return joined, "joined, both are of one look"
    if _unordered(joined) == _unordered(replace(_joined(mine, theirs), name=mine.name)):
        return joined, "joined, they complete each other"
    return None, "they differ, and which is newer is not known"


def _joined(older: Waypoint, newer: Waypoint) -> Waypoint:
    features = {name_key(text): text for text in newer.geometric_features}
    for text in older.geometric_features:
        features.setdefault(name_key(text), text)
    is_same_pose = data_of(older)["pose"] == data_of(newer)["pose"]
    dated = newer if newer.recorded_at or newer.stamp_s is not None else older
    return replace(
        merge_waypoint(older, newer).waypoint,
        description=newer.description or older.description,
        geometric_features=tuple(features.values()),
        stamp_s=dated.stamp_s,
        recorded_at=dated.recorded_at,
        room_id=newer.room_id or (older.room_id if is_same_pose else None),
        picture=newer.picture or (older.picture if is_same_pose else None),
    )


def _unordered(place: Waypoint) -> dict[str, object]:
    """Return the content of a record, regardless of the order of its lists."""
    said = data_of(place)
    return {key: sorted(map(str, v)) if isinstance(v, list) else v for key, v in said.items()}


def _renamed(place: Waypoint, places: Mapping[str, Waypoint], taken: Collection[str]) -> Waypoint:
    """Return a place under a free name; under the one it has already from an earlier time."""
    for number in count(2):
        renamed = replace(place, name=f"{place.name} ({number})")
        key = name_key(renamed.name)
        there = places.get(key)
        if key not in taken or (there and _unordered(there) == _unordered(renamed)):
            return renamed
    raise AssertionError  # There is always a free number.


# --- files -----------------------------------------------------------------------------------


def merge_into(store: MemoryStore, second: SemanticMap) -> Union:
    """Join a memory into another, all of it or nothing (see `unite`).

    Raises:
        SemanticMapError: The maps differ, or the file has a fault or cannot be written.
    """
    unions: list[Union] = []

    def change(first: SemanticMap) -> Iterable[Waypoint]:
        unions.append(unite(first, second))
        return unions[-1].changed

    store.write_all(change)
    return unions[-1]


def merge_files(first: Path, second: Path, *, out: Path) -> tuple[Union, BroughtOver]:
    """Write two semantic map files as one: the first with its comments, and what it lacks.

    Their maps are aligned by the walls kept beside them; if these do not suffice, the second's
    records stay in a separate frame.
    Events of the second one get new ids; records in both appear once. The observations of both
    are copied, with their pictures.

    Raises:
        SemanticMapError: One cannot be read, or the new file is there already.
    """
    if out.exists():
        message = f"{out} is there already."
        raise SemanticMapError(message, hint="Name a file that is not, or remove it.")
    for path in (first, second):
        if not path.exists():
            message = f"There is no file {path}."
            raise SemanticMapError(message, hint="Name a semantic map file, such as places.yaml.")
    mine, theirs = SemanticMapStore(first), SemanticMapStore(second)
    mounted = mount(mine, theirs)
    part = out.with_name(f"{out.stem}.part")
    try:
        # The rest of the first file stays: comments, people's own keys.
        shutil.copyfile(first, part)
        whole = SemanticMapStore(part)
        whole.write_frames(lambda _: mounted.frames)
        union = merge_into(whole, mounted.rename_places(theirs.read()))
        known = [replace(each, id="") for each in whole.read_events()]
        for event in map(mounted.rename_event, theirs.read_events()):
            if event not in known:
                whole.write_event(event)
        map_id = mine.read().map_id
        came = bring_over(
            first,
            second,
            to=out,
            rename_map=lambda name: mounted.rename_map(name, whole_map_id=map_id),
        )
        for name, grid in mounted.walls.items():
            WallFolder(out).keep(grid, name)
        # Last, so that no file exists without its observations.
        part.replace(out)
        sync_folder(out.parent)
    finally:
        for left in (part, part.with_name(f".{part.name}.lock")):
            left.unlink(missing_ok=True)
    findings = tuple(filter(None, (mounted.finding, *union.findings)))
    return replace(union, findings=findings), came
