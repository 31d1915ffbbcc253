"""Failures on purpose: a way that is blocked, and a map that is out of date."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mapspeak.evaluation.scores.answers import Evidence, read_word, verdict
from mapspeak.evaluation.scores.judging import judge_room
from mapspeak.evaluation.scores.site import GroundTruth, TruePassage
from mapspeak.evaluation.tasks.task import Draw, Task, Truth, pair, point_text
from mapspeak.evaluation.trials import Failure, Limits, Score, Setting
from mapspeak.geometry import Pose
from mapspeak.simulator import MeasuredRoom, WorldDoor, WorldObject
from mapspeak.spatial.grid import Mask

THERE, UNREACHABLE = "there", "unreachable"
LEAST_DETOUR = 1.2
LIMITS = Limits(n_calls=80, robot_time_s=1200.0, wall_s=900.0)
CRATE = "crate"
CRATE_M = 0.8
"""How wide one is."""
DOOR_REACH_M = 1.0
"""How far from a door the middle of its passage may lie."""
ROOM_LEFT_RATIO = 0.5
"""A thing in the way leaves the robot at least so much of the room."""


def _draw_blocked_way(draw: Draw) -> Setting:
    """Draw a door that the map shows and crates block: there is another way, or none."""
    site = draw.site
    for door, room in draw.shuffled(_find_doors_into_rooms(site)):
        crates = _close_door(door)
        blocked = site.with_more(crates)
        goal = site.cells_of(room)
        start = draw.start(without=goal | ~_away_from(site, crates))
        way_m = site.shortest_to_any_m(start.point, goal)
        left_m = blocked.shortest_to_any_m(start.point, goal)
        is_standable = blocked.grid.is_free(blocked.grid.cell_at(start.point))
        if left_m >= LEAST_DETOUR * way_m and is_standable:
            break
    prompt = (
        f"Go to the room around {point_text(site.middle_of(room))}. When you are done, end with "
        f"ANSWER: {THERE} - or, if there is no way into it, with ANSWER: {UNREACHABLE}."
    )
    answer = {"answer": THERE if math.isfinite(left_m) else UNREACHABLE}
    return _room_setting(draw, prompt, room, crates, start, left_m, answer)


def _judge_blocked_way(site: GroundTruth, truth: Truth, evidence: Evidence) -> Score:
    if truth["answer"] == THERE:
        return _judge_untouched(site, truth, evidence)
    said = read_word(evidence.answer, (THERE, UNREACHABLE))
    figures = {"n_collisions": float(evidence.last.n_collisions)}
    if said == UNREACHABLE:
        return _untouched(evidence, verdict("It said that there is no way.", figures))
    failure = Failure.NO_ANSWER if said is None else Failure.WRONG_ANSWER
    return verdict(f"There is no way, and it said {said or 'nothing'}.", figures, failure=failure)


def _draw_stale_map(draw: Draw) -> Setting:
    """Put crates where a room is widest, and the map shows it as free."""
    site = draw.site
    room, crates = draw.one_of(_find_spacious_rooms(site))
    goal = site.cells_of(room)
    start = draw.start(without=goal)
    prompt = f"Go into the room around {point_text(site.middle_of(room))}; anywhere in it will do."
    shortest_m = site.shortest_to_any_m(start.point, goal)
    return _room_setting(draw, prompt, room, crates, start, shortest_m, {})


def _room_setting(
    draw: Draw,
    prompt: str,
    room: MeasuredRoom,
    crates: tuple[WorldObject, ...],
    start: Pose,
    shortest_m: float,
    truth: Truth,
) -> Setting:
    """Return the setting of a drive into a room, with crates that the map does not show."""
    truth = {
        "room": room.room.name,
        "point": pair(draw.site.middle_of(room)),
        "shortest_m": round(shortest_m, 3) if math.isfinite(shortest_m) else None,
        **truth,
    }
    return draw.setting(prompt, start, truth, limits=LIMITS, added=crates)


def _judge_untouched(site: GroundTruth, truth: Truth, evidence: Evidence) -> Score:
    """Score the room; the crates must not be touched."""
    return _untouched(evidence, judge_room(site, evidence, [truth["room"]]))


def _untouched(evidence: Evidence, score: Score) -> Score:
    if not score.is_success or not evidence.last.n_collisions:
        return score
    reason = f"It bumped into something {evidence.last.n_collisions} times."
    return replace(score, is_success=False, failure=Failure.COLLIDED, reason=reason)


def _find_doors_into_rooms(site: GroundTruth) -> list[tuple[WorldDoor, MeasuredRoom]]:
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


def _close_door(door: WorldDoor) -> tuple[WorldObject, ...]:
    """Return crates side by side across a door."""
    n_crates = max(math.ceil((door.width_m - 0.1) / CRATE_M), 1)
    pitch_m = door.width_m / n_crates
    return tuple(
        _crate(number, door.pose @ Pose((number + 0.5) * pitch_m - door.width_m / 2, 0.0))
        for number in range(n_crates)
    )


def _crate(number: int, pose: Pose) -> WorldObject:
    return WorldObject(name=f"added crate {number + 1}", kind=CRATE, pose=pose)


def _find_spacious_rooms(site: GroundTruth) -> list[tuple[MeasuredRoom, tuple[WorldObject, ...]]]:
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


def _away_from(site: GroundTruth, things: Sequence[WorldObject]) -> Mask:
    """Return the cells that are not near any of some things."""
    near = [site.near(site.place_of(thing), 2 * CRATE_M) for thing in things]
    return np.asarray(~np.logical_or.reduce(near))


BLOCKED_TASKS = (
    Task(
        name="blocked-way",
        draw=_draw_blocked_way,
        judge=_judge_blocked_way,
        is_offered=lambda site: bool(_find_doors_into_rooms(site)),
    ),
    Task(
        name="stale-map",
        draw=_draw_stale_map,
        judge=_judge_untouched,
        is_offered=lambda site: bool(_find_spacious_rooms(site)),
    ),
)
