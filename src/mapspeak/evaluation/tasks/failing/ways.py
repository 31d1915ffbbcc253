"""Ways that are not what the map shows."""

import math
from dataclasses import dataclass, replace

from mapspeak.evaluation.scores import Evidence, GroundTruth, judge_room, read_word
from mapspeak.evaluation.tasks.failing.crates import (
    away_from,
    close_door,
    find_doors_into_rooms,
    find_spacious_rooms,
)
from mapspeak.evaluation.tasks.task import dice, draw_start, point_text
from mapspeak.evaluation.trials import Failure, Limits, Score, Setting
from mapspeak.geometry import Pose
from mapspeak.simulator import MeasuredRoom, WorldObject

__all__ = ["BlockedWay", "StaleMap"]

THERE, UNREACHABLE = "there", "unreachable"
LEAST_DETOUR = 1.2
LIMITS = Limits(n_calls=80, robot_time_s=1200.0, wall_s=900.0)


@dataclass(frozen=True, slots=True)
class BlockedWay:
    """A door that the map shows is blocked by crates: there is another way, or none."""

    name: str = "blocked-way"
    needs_map: bool = True

    def is_offered(self, site: GroundTruth) -> bool:
        """True where a door leads into a room."""
        return bool(find_doors_into_rooms(site))

    def make_setting(self, site: GroundTruth, *, seed: int, memory: str | None) -> Setting:
        """Draws the door and the room behind it."""
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
        """Scores place and answer; the crates must not be touched."""
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
        """True where a room is large enough for crates and the robot."""
        return bool(find_spacious_rooms(site))

    def make_setting(self, site: GroundTruth, *, seed: int, memory: str | None) -> Setting:
        """Draws the room, and puts the crates where it is widest."""
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
        """Scores the room; the crates must not be touched."""
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
    """Gives the setting of a drive into a room, with crates that the map does not show."""
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
