"""Rooms by their size: the paper's smallest one, the largest, the n-th, the longest corridor."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mapspeak.evaluation.scores import Evidence, GroundTruth, judge_room
from mapspeak.evaluation.tasks.task import dice, draw_start, drive_setting
from mapspeak.evaluation.trials import Score, Setting
from mapspeak.simulator import MeasuredRoom
from mapspeak.spatial.rooms import RoomClass

SAME_SIZE = 1.05
"""Rooms whose areas differ by less than this share count as the same size: either is right."""
CLEARLY_DIFFERENT = 1.15
HALLS_COUNT = "Halls and other open spaces count as rooms, corridors do not."
ORDINALS = {2: "second", 3: "third", 4: "fourth"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """A question for a room, and the rooms that are right.

    Attributes:
        prompt: The question.
        rooms: Any of them is right.
    """

    prompt: str
    rooms: tuple[MeasuredRoom, ...]


Choose = Callable[[GroundTruth, np.random.Generator | None], Choice | None]


@dataclass(frozen=True, slots=True)
class RoomTask:
    """The robot goes to the room that has a size.

    Attributes:
        name: Of the task.
        choose: Draws a question; None where the world has no clear answer.
        needs_map: It does.
    """

    name: str
    choose: Choose
    needs_map: bool = True

    def is_offered(self, site: GroundTruth) -> bool:
        """Return True where the world has a room that is clearly the right one."""
        return self.choose(site, None) is not None

    def make_setting(self, site: GroundTruth, *, seed: int, memory: str | None) -> Setting:
        """Start anywhere but in the right room."""
        random = dice(self.name, site, seed)
        choice = self.choose(site, random)
        if choice is None:
            raise AssertionError("the task is offered here")
        goal = np.logical_or.reduce([site.cells_of(room) for room in choice.rooms])
        start = draw_start(site, random, without=goal)
        return drive_setting(
            site,
            prompt=choice.prompt,
            start=start,
            right=goal,
            memory=memory,
            rooms=[room.room.name for room in choice.rooms],
        )

    def score(self, site: GroundTruth, setting: Setting, evidence: Evidence) -> Score:
        """Score the room that the robot stands in."""
        return judge_room(site, evidence, setting.truth["rooms"])


def _smallest(site: GroundTruth, random: np.random.Generator | None) -> Choice | None:
    """Return the paper's Task 2: the least floor, whether or not furniture counts as floor."""
    del random
    rooms = _of_class(site, RoomClass.ROOM)
    if len(rooms) < 2:
        return None
    right = {
        room.room.name: room
        for area in (site.floor_area_m2, _free_area_m2)
        for room in rooms
        if area(room) <= SAME_SIZE * min(map(area, rooms))
    }
    return Choice(prompt="Go to the smallest room.", rooms=tuple(right.values()))


def _largest(site: GroundTruth, random: np.random.Generator | None) -> Choice | None:
    del random
    rooms = sorted(_rooms_and_halls(site), key=site.floor_area_m2)
    if len(rooms) < 2 or not _is_clear(site, rooms, len(rooms) - 1):
        return None
    return Choice(prompt=f"Go to the largest room. {HALLS_COUNT}", rooms=(rooms[-1],))


def _nth(site: GroundTruth, random: np.random.Generator | None) -> Choice | None:
    """Return the second to fourth from either end, where its size is clearly its own."""
    rooms = sorted(_rooms_and_halls(site), key=site.floor_area_m2)
    found = [
        (f"{ORDINALS[number]} {word}", rooms[at])
        for number in ORDINALS
        for word, at in (("smallest", number - 1), ("largest", len(rooms) - number))
        if number < len(rooms) and _is_clear(site, rooms, at)
    ]
    if not found:
        return None
    words, room = found[0 if random is None else int(random.integers(len(found)))]
    return Choice(prompt=f"Go to the {words} room. {HALLS_COUNT}", rooms=(room,))


def _longest_corridor(site: GroundTruth, random: np.random.Generator | None) -> Choice | None:
    del random
    corridors = sorted(_of_class(site, RoomClass.CORRIDOR), key=_length_m)
    is_clear = len(corridors) < 2 or (
        _length_m(corridors[-1]) >= CLEARLY_DIFFERENT * _length_m(corridors[-2])
    )
    if not corridors or not is_clear:
        return None
    return Choice(prompt="Go to the longest corridor.", rooms=(corridors[-1],))


def _of_class(site: GroundTruth, wanted: RoomClass) -> list[MeasuredRoom]:
    return [room for room in site.rooms if room.room.room_class is wanted]


def _rooms_and_halls(site: GroundTruth) -> list[MeasuredRoom]:
    return [room for room in site.rooms if room.room.room_class is not RoomClass.CORRIDOR]


def _free_area_m2(room: MeasuredRoom) -> float:
    return room.free_area_m2


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


ROOM_TASKS = (
    RoomTask("smallest-room", _smallest),
    RoomTask("largest-room", _largest),
    RoomTask("nth-room", _nth),
    RoomTask("longest-corridor", _longest_corridor),
)
