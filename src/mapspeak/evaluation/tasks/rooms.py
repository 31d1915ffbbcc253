"""Rooms by their size: the paper's smallest one, the largest, the n-th, the longest corridor."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from mapspeak.evaluation.scores.groundtruth import GroundTruth
from mapspeak.evaluation.scores.judging import judge_room
from mapspeak.evaluation.tasks.task import Draw, Task, point_text
from mapspeak.evaluation.trials import Setting
from mapspeak.simulator import MeasuredRoom
from mapspeak.spatial.rooms import RoomClass

SAME_SIZE = 1.05
"""Rooms whose areas differ by less than this share count as the same size: either is right."""
CLEARLY_DIFFERENT = 1.15
HALLS_COUNT = "Halls and other open spaces count as rooms, corridors do not."
ORDINALS = {2: "second", 3: "third", 4: "fourth"}

Choice = tuple[str, tuple[MeasuredRoom, ...]]
"""A question for a room, and the rooms of which any is right."""
FindChoices = Callable[[GroundTruth], list[Choice]]
"""Finds the questions that have a clear answer in a world."""


def _room_task(name: str, find_choices: FindChoices) -> Task:
    """Return the task of driving to the room that has a size, from anywhere but in it."""

    def draw(draw: Draw) -> Setting:
        prompt, rooms = draw.one_of(find_choices(draw.site))
        goal = np.logical_or.reduce([draw.site.cells_of(room) for room in rooms])
        start = draw.start(without=goal)
        names = [room.room.name for room in rooms]
        truth = {"rooms": names, "shortest_m": draw.shortest_m(start, goal)}
        return draw.setting(prompt, start, truth)

    return Task(
        name=name,
        draw=draw,
        judge=lambda site, truth, evidence: judge_room(site, evidence, truth["rooms"]),
        is_offered=lambda site: bool(find_choices(site)),
    )


def _smallest(site: GroundTruth) -> list[Choice]:
    """Return the paper's Task 2: the least floor, whether or not furniture counts as floor."""
    rooms = _of_class(site, RoomClass.ROOM)
    if len(rooms) < 2:
        return []
    least_m2 = min(map(site.floor_area_m2, rooms)), min(room.free_area_m2 for room in rooms)
    by_floor = [room for room in rooms if site.floor_area_m2(room) <= SAME_SIZE * least_m2[0]]
    by_free = [room for room in rooms if room.free_area_m2 <= SAME_SIZE * least_m2[1]]
    right = {room.room.name: room for room in (*by_floor, *by_free)}
    return [("Go to the smallest room.", tuple(right.values()))]


def _largest(site: GroundTruth) -> list[Choice]:
    rooms = _rooms_and_halls(site)
    if len(rooms) < 2 or not _is_clear(site, rooms, len(rooms) - 1):
        return []
    return [(f"Go to the largest room. {HALLS_COUNT}", (rooms[-1],))]


def _nth(site: GroundTruth) -> list[Choice]:
    """Return the second to fourth from either end, where its size is clearly its own."""
    rooms = _rooms_and_halls(site)
    return [
        (f"Go to the {ORDINALS[number]} {word} room. {HALLS_COUNT}", (rooms[at],))
        for number in ORDINALS
        for word, at in (("smallest", number - 1), ("largest", len(rooms) - number))
        if number < len(rooms) and _is_clear(site, rooms, at)
    ]


def _longest_corridor(site: GroundTruth) -> list[Choice]:
    corridors = sorted(_of_class(site, RoomClass.CORRIDOR), key=_length_m)
    longest_m = [_length_m(corridor) for corridor in corridors[-2:]]
    if not corridors or longest_m[-1] < CLEARLY_DIFFERENT * sum(longest_m[:-1]):
        return []
    return [("Go to the longest corridor.", (corridors[-1],))]


def _of_class(site: GroundTruth, wanted: RoomClass) -> list[MeasuredRoom]:
    return [room for room in site.rooms if room.room.room_class is wanted]


def _rooms_and_halls(site: GroundTruth) -> list[MeasuredRoom]:
    rooms = [room for room in site.rooms if room.room.room_class is not RoomClass.CORRIDOR]
    return sorted(rooms, key=site.floor_area_m2)


def _is_clear(site: GroundTruth, ordered: Sequence[MeasuredRoom], at: int) -> bool:
    """Return True where a room's area is clearly apart from those before and after it."""
    area_m2 = site.floor_area_m2(ordered[at])
    is_above = at == 0 or area_m2 >= CLEARLY_DIFFERENT * site.floor_area_m2(ordered[at - 1])
    is_last = at == len(ordered) - 1
    return is_above and (
        is_last or site.floor_area_m2(ordered[at + 1]) >= CLEARLY_DIFFERENT * area_m2
    )


def _length_m(room: MeasuredRoom) -> float:
    """Return the longest distance between two corners of an outline."""
    corners = room.room.outline
    return max((one.distance_to(other) for one in corners for other in corners), default=math.nan)


MOST_NUMBER = 9


def _draw_stale_id(draw: Draw) -> Setting:
    """Tell an id that a room may have had, and where it lies."""
    room, number = draw.one_of(draw.site.rooms), int(draw.random.integers(1, MOST_NUMBER + 1))
    goal = draw.site.cells_of(room)
    start = draw.start(without=goal)
    prompt = (
        f"A note of last week says: go to R{number}. It is the space around "
        f"{point_text(draw.site.middle_of(room))} by its sketch. Go there; ids may have changed."
    )
    truth = {"rooms": [room.room.name], "shortest_m": draw.shortest_m(start, goal)}
    return draw.setting(prompt, start, truth)


ROOM_TASKS = (
    Task(
        name="stale-id",
        draw=_draw_stale_id,
        judge=lambda site, truth, evidence: judge_room(site, evidence, truth["rooms"]),
        is_offered=lambda site: len(site.rooms) > 1,
    ),
    _room_task("smallest-room", _smallest),
    _room_task("largest-room", _largest),
    _room_task("nth-room", _nth),
    _room_task("longest-corridor", _longest_corridor),
)
