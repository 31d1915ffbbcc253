"""Failures on purpose: a way that is blocked, and a map that is out of date."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mapspeak.evaluation.scores import Evidence, GroundTruth, TruePassage, judge_room, read_word
from mapspeak.evaluation.tasks.task import dice, draw_start, point_text
from mapspeak.evaluation.trials import Failure, Limits, Score, Setting
from mapspeak.geometry import Pose
from mapspeak.simulator import MeasuredRoom, WorldDoor, WorldObject
from mapspeak.spatial.grid import Mask

THERE, UNREACHABLE = "there", "unreachable"
LEAST_DETOUR = 1.2
LIMITS = Limits(n_calls=80, robot_time_s=1200.0, wall_s=900.0)


@dataclass(frozen=True, slots=True)
class BlockedWay:
    """A door that the map shows is blocked by crates: there is another way, or none."""

    name: str = "blocked-way"
    needs_map: bool = True

    def is_offered(self, site: GroundTruth) -> bool:
        """Return True where a door leads into a room."""
        return bool(find_doors_into_rooms(site))

    def make_setting(self, site: GroundTruth, *, seed: int, memory: str | None) -> Setting:
        """Draw the door and the room behind it."""
        random = dice(self.name, site, seed)
        doors = find_doors_into_rooms(site)
        order = random.permutation(len(doors)).tolist()
        for door, room in (doors[at] for at in order):
            crates = close_door(door)
            blocked = site.with_more(crates)
            goal = site.cells_of(room)
            start = draw_start(site, random, without=goal | ~away_from(site, crates))
            way_m = site.shortest_to_any_m(start.point, goal)
            left_m = blocked.shortest_to_any_m(start.point, goal)
            if left_m >= LEAST_DETOUR * way_m and _is_standable(blocked, start):
                break
        middle = site.middle_of(room)
        return _room_setting(
            site,
            room,
            crates,
            prompt=f"Go to the room around {point_text(middle)}. When you are done, end with "
            f"ANSWER: {THERE} - or, if there is no way into it, with ANSWER: {UNREACHABLE}.",
            start=start,
            memory=memory,
            shortest_m=left_m,
            answer=THERE if math.isfinite(left_m) else UNREACHABLE,
        )

    def score(self, site: GroundTruth, setting: Setting, evidence: Evidence) -> Score:
        """Score place and answer; the crates must not be touched."""
        truth = setting.truth
        if truth["answer"] == THERE:
            return _untouched(evidence, judge_room(site, evidence, [truth["room"]]))
        said = read_word(evidence.answer, (THERE, UNREACHABLE))
        figures = {"n_collisions": float(evidence.last.n_collisions)}
        if said == UNREACHABLE:
            right = Score(is_success=True, figures=figures, reason="It said that there is no way.")
            return _untouched(evidence, right)
        failure = Failure.NO_ANSWER if said is None else Failure.WRONG_ANSWER
        reason = f"There is no way, and it said {said or 'nothing'}."
        return Score(is_success=False, failure=failure, figures=figures, reason=reason)


@dataclass(frozen=True, slots=True)
class StaleMap:
    """Where the map shows the middle of a room as free, crates stand now."""

    name: str = "stale-map"
    needs_map: bool = True

    def is_offered(self, site: GroundTruth) -> bool:
        """Return True where a room is large enough for crates and the robot."""
        return bool(find_spacious_rooms(site))

    def make_setting(self, site: GroundTruth, *, seed: int, memory: str | None) -> Setting:
        """Draw the room, and put the crates where it is widest."""
        random = dice(self.name, site, seed)
        rooms = find_spacious_rooms(site)
        room, crates = rooms[int(random.integers(len(rooms)))]
        goal, middle = site.cells_of(room), site.middle_of(room)
        start = draw_start(site, random, without=goal)
        return _room_setting(
            site,
            room,
            crates,
            prompt=f"Go into the room around {point_text(middle)}; anywhere in it will do.",
            start=start,
            memory=memory,
            shortest_m=site.shortest_to_any_m(start.point, goal),
        )

    def score(self, site: GroundTruth, setting: Setting, evidence: Evidence) -> Score:
        """Score the room; the crates must not be touched."""
        return _untouched(evidence, judge_room(site, evidence, [setting.truth["room"]]))


def _room_setting(
    site: GroundTruth,
    room: MeasuredRoom,
    crates: tuple[WorldObject, ...],
    *,
    prompt: str,
    start: Pose,
    memory: str | None,
    shortest_m: float,
    **truth: str,
) -> Setting:
    """Return the setting of a drive into a room, with crates that the map does not show."""
    middle = site.middle_of(room)
    return Setting(
        prompt=prompt,
        start=site.in_world(start),
        is_known=True,
        memory=memory,
        added=crates,
        limits=LIMITS,
        truth={
            "room": room.room.name,
            "point": [round(middle.x, 2), round(middle.y, 2)],
            "shortest_m": round(shortest_m, 3) if math.isfinite(shortest_m) else None,
            **truth,
        },
    )


def _is_standable(site: GroundTruth, start: Pose) -> bool:
    return site.grid.is_free(site.grid.cell_at(start.point))


def _untouched(evidence: Evidence, score: Score) -> Score:
    if not score.is_success or not evidence.last.n_collisions:
        return score
    return replace(
        score,
        is_success=False,
        failure=Failure.COLLIDED,
        reason=f"It bumped into something {evidence.last.n_collisions} times.",
    )


CRATE = "crate"
CRATE_M = 0.8
"""How wide one is."""
DOOR_REACH_M = 1.0
"""How far from a door the middle of its passage may lie."""
ROOM_LEFT_RATIO = 0.5
"""A thing in the way leaves the robot at least so much of the room."""


def find_doors_into_rooms(site: GroundTruth) -> list[tuple[WorldDoor, MeasuredRoom]]:
    """Return doors with a space that they lead into and that is not the only one on that side."""
    found = []
    map_from_world = site.world.start.inverse()
    for door in site.world.doors:
        middle = map_from_world.transform(door.pose.point)
        passage = min(site.passages, key=lambda each: each.middle.distance_to(middle), default=None)
        if passage is not None and passage.middle.distance_to(middle) <= DOOR_REACH_M:
            found += [(door, room) for room in _smaller_side(site, passage)]
    return found


def _smaller_side(site: GroundTruth, passage: TruePassage) -> list[MeasuredRoom]:
    rooms = [room for room in site.rooms if room.room.name in passage.spaces]
    return sorted(rooms, key=lambda room: room.outline_area_m2)[:1] if len(rooms) > 1 else []


def close_door(door: WorldDoor) -> tuple[WorldObject, ...]:
    """Return crates side by side across a door."""
    n_crates = max(math.ceil((door.width_m - 0.1) / CRATE_M), 1)
    pitch_m = door.width_m / n_crates
    return tuple(
        _crate(number, door.pose @ Pose((number + 0.5) * pitch_m - door.width_m / 2, 0.0))
        for number in range(n_crates)
    )


def _crate(number: int, pose: Pose) -> WorldObject:
    return WorldObject(name=f"added crate {number + 1}", kind=CRATE, pose=pose)


def find_spacious_rooms(site: GroundTruth) -> list[tuple[MeasuredRoom, tuple[WorldObject, ...]]]:
    """Return rooms in which a crate in the middle leaves enough to stand on, with that crate."""
    found: list[tuple[MeasuredRoom, tuple[WorldObject, ...]]] = []
    for room in site.rooms:
        middle = site.middle_of(room)
        crates = (_crate(0, site.in_world(Pose(middle.x, middle.y))),)
        before = site.cells_of(room) & site.floor.standable
        after = before & site.with_more(crates).floor.standable
        if after.sum() >= ROOM_LEFT_RATIO * before.sum() and len(site.rooms) > 1:
            found.append((room, crates))
    return found


def away_from(site: GroundTruth, things: Sequence[WorldObject]) -> Mask:
    """Return the cells that are not near any of some things."""
    near = [site.near(site.place_of(thing), 2 * CRATE_M) for thing in things]
    return np.asarray(~np.logical_or.reduce(near))
