"""The same room keeps the same id while the map grows, shifts its origin or is turned."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from mapspeak.spatial.rooms.room_map import Door, Region, RoomMap, Vanished

Old = TypeVar("Old", str, int)
New = TypeVar("New", str, int)

_SAMPLES = 200_000
_SAME_DOOR_M = 0.6
_SAME_SIZE_RATIO = 1.5
"""Largest ratio, either way, between the floor of a region that is back and its old floor."""
_REMAINS_RATIO = 0.25
"""A vanished region became every region that covers at least this share of what is still seen."""


def match_best_first(pairs: Iterable[tuple[Any, Old, New]]) -> dict[New, Old]:
    """Return for each new thing the old one that it continues: the best pair first, each once.

    Args:
        pairs: How unlike two are, which may be compared with that of others, the old one and the
            new one.
    """
    matched: dict[New, Old] = {}
    taken: set[Old] = set()
    for _, old, new in sorted(pairs):
        if new not in matched and old not in taken:
            matched[new] = old
            taken.add(old)
    return matched


def match_rooms(previous: RoomMap, current: RoomMap) -> RoomMap:
    """Return the current map with the ids of the previous one where they mean the same place.

    Regions are matched one to one by overlap in world coordinates, the largest overlap first;
    doors by place. A region keeps its number; its letter says what it is taken for now. New ones
    get numbers never used before; lost ones are remembered, and get their numbers back when they
    are found again in their place.
    """
    overlap = _count_overlap(previous, current)
    ids = _match_regions(previous, current, overlap)
    door_ids = _match_doors(previous, current, ids)
    vanished = _remember(previous, current, overlap, ids, door_ids)
    now = {ids[region.id]: f"{region.id[0]}{ids[region.id][1:]}" for region in current.regions}
    final = {name: now[kept] for name, kept in ids.items()}
    renamed = {kept: name for kept, name in now.items() if kept != name}
    earlier = {old: now[name] for old, name in previous.former_ids.items() if name in now}
    return RoomMap(
        grid=current.grid,
        labels=current.labels,
        regions=tuple(_rename(region, final, door_ids) for region in current.regions),
        doors=tuple(
            replace(
                door,
                id=door_ids[door.id],
                region_ids=(final[door.region_ids[0]], final[door.region_ids[1]]),
            )
            for door in current.doors
        ),
        vanished=tuple(
            replace(gone, became=tuple(now.get(name, name) for name in gone.became))
            for gone in vanished
        ),
        # Former names of regions, by their kept and their present names.
        former_ids={old: name for old, name in (earlier | renamed).items() if old != name},
    )


def _count_overlap(previous: RoomMap, current: RoomMap) -> NDArray[np.float64]:
    """Return the shared area in square metres; row by previous, column by current index."""
    rows, cols = np.nonzero(previous.labels)
    every = max(1, rows.size // _SAMPLES)
    rows, cols = rows[::every], cols[::every]
    here = previous.labels[rows, cols].astype(np.intp)
    points = previous.grid.points_at(rows, cols)
    there = current.grid.look_up(current.labels, points, outside=0).astype(np.intp)
    shape = (len(previous.regions) + 1, len(current.regions) + 1)
    counts = np.bincount(here * shape[1] + there, minlength=shape[0] * shape[1]).reshape(shape)
    return np.asarray(counts * (every * previous.grid.resolution_m**2), np.float64)


def _match_regions(
    previous: RoomMap, current: RoomMap, overlap: NDArray[np.float64]
) -> dict[str, str]:
    """Return the final id for each id of the current map."""
    old = {region.index: region.id for region in previous.regions}
    new = {region.index: region.id for region in current.regions}
    rows, cols = np.nonzero(_keeps_enough(overlap)[1:, 1:])
    same = match_best_first(
        (-overlap[before, now], before, now)
        for before, now in zip((rows + 1).tolist(), (cols + 1).tolist(), strict=True)
        if before in old and now in new
    )
    ids = {new[now]: old[before] for now, before in same.items()}
    ids |= _revive_regions(previous, [each for each in current.regions if each.index not in same])
    missing = [name for name in new.values() if name not in ids]
    return ids | _fresh(missing, _used(previous))


def _keeps_enough(overlap: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return True where a new region has enough of an old one's floor to be the same.

    A region with less is another one, unless no other region has more of that floor.
    """
    shared = overlap.copy()
    shared[:, 0] = 0.0
    needed = np.minimum(_REMAINS_RATIO * shared.sum(axis=1), shared.max(axis=1))
    return np.asarray((shared > 0) & (shared >= needed[:, np.newaxis]))


def _revive_regions(previous: RoomMap, regions: list[Region]) -> dict[str, str]:
    """Return the ids of vanished regions that are back: about as large, and in their place."""
    return match_best_first(
        (gone.place.distance_to(region.widest), gone.id, region.id)
        for gone in previous.vanished
        for region in regions
        if gone.floor_area_m2 is not None
        and gone.place.distance_to(region.widest) <= region.clearance_m
        and 1 / _SAME_SIZE_RATIO <= region.floor_area_m2 / gone.floor_area_m2 <= _SAME_SIZE_RATIO
    )


def _used(previous: RoomMap) -> set[str]:
    used = {region.id for region in previous.regions} | {door.id for door in previous.doors}
    return used | {gone.id for gone in previous.vanished}


def _fresh(wanted: Iterable[str], used: set[str]) -> dict[str, str]:
    """Return for each wanted id one with the next number that no region, or door, has used."""
    highest = dict.fromkeys((True, False), 0)
    for name in used:
        is_door = name[0] == "D"
        highest[is_door] = max(highest[is_door], int(name[1:]))
    fresh = {}
    for name in wanted:
        is_door = name[0] == "D"
        highest[is_door] += 1
        fresh[name] = f"{name[0]}{highest[is_door]}"
    return fresh


def _match_doors(previous: RoomMap, current: RoomMap, ids: dict[str, str]) -> dict[str, str]:
    """Return the final id for each door id of the current map, the nearest doors matched first."""
    near = [
        (before.place.distance_to(now.place), before.id, now.id)
        for before, now in _find_near_doors(previous.doors, current.doors)
        if before.place.distance_to(now.place)
        <= _SAME_DOOR_M * (1 + (set(before.region_ids) == {ids[name] for name in now.region_ids}))
    ]
    # Doors that were there a while ago come after those that were there just now.
    near += [
        (_SAME_DOOR_M * 2 + gone.place.distance_to(door.place), gone.id, door.id)
        for gone in previous.vanished
        for door in current.doors
        if gone.floor_area_m2 is None and gone.place.distance_to(door.place) <= _SAME_DOOR_M
    ]
    matched = match_best_first(near)
    new = [door.id for door in current.doors if door.id not in matched]
    return matched | _fresh(new, _used(previous))


def _find_near_doors(
    previous: tuple[Door, ...], current: tuple[Door, ...]
) -> Iterator[tuple[Door, Door]]:
    """Return the pairs of doors at most twice the matching distance apart."""
    places = [
        np.array([(door.place.x, door.place.y) for door in doors]).reshape(-1, 1, 2)
        for doors in (previous, current)
    ]
    off_m = np.linalg.norm(places[0] - places[1].swapaxes(0, 1), axis=2)
    for before, now in np.argwhere(off_m < 2 * _SAME_DOOR_M + 1e-6).tolist():
        yield previous[before], current[now]


def _rename(region: Region, ids: dict[str, str], door_ids: dict[str, str]) -> Region:
    return replace(
        region,
        id=ids[region.id],
        door_ids=tuple(sorted((door_ids[name] for name in region.door_ids), key=sort_key)),
        neighbour_ids=tuple(sorted((ids[name] for name in region.neighbour_ids), key=sort_key)),
    )


def sort_key(name: str) -> tuple[str, int]:
    """Return the sort key of an id: its letter, then its number."""
    return name[0], int(name[1:])


def _remember(
    previous: RoomMap,
    current: RoomMap,
    overlap: NDArray[np.float64],
    ids: dict[str, str],
    door_ids: dict[str, str],
) -> tuple[Vanished, ...]:
    """Return the vanished regions and doors, with the regions that replaced them."""
    kept = set(ids.values()) | set(door_ids.values())
    final = {region.index: ids[region.id] for region in current.regions}
    lost = [
        Vanished(
            id=region.id,
            place=region.widest,
            floor_area_m2=region.floor_area_m2,
            became=_heirs(overlap[region.index], final),
        )
        for region in previous.regions
    ]
    lost += [
        Vanished(id=door.id, place=door.place, floor_area_m2=None, became=())
        for door in previous.doors
    ]
    for gone in previous.vanished:
        # The region that now covers the place of an earlier vanished one.
        region = None if gone.floor_area_m2 is None else current.find_region_at(gone.place)
        lost.append(replace(gone, became=() if region is None else (ids[region.id],)))
    return tuple(
        sorted((gone for gone in lost if gone.id not in kept), key=lambda g: sort_key(g.id))
    )


def _heirs(shared: NDArray[np.float64], final: dict[int, str]) -> tuple[str, ...]:
    seen = float(shared[1:].sum())
    heirs = np.flatnonzero((shared > 0) & (shared >= _REMAINS_RATIO * seen)).tolist()
    return tuple(sorted((final[index] for index in heirs if index), key=sort_key))
