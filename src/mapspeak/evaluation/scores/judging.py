"""Judges: each compares what a trial left behind with the truth, and says what kind of mistake.

Answers are judged in a strict form: a line with "ANSWER:".
"""

import math
import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from mapspeak.evaluation.scores.groundtruth import BESIDE_M, GroundTruth
from mapspeak.evaluation.trials import Failure, Score, ToolCall, TrialState
from mapspeak.geometry import Point, wrap_angle
from mapspeak.simulator import StateRecord, WorldObject, measure_shares_in_view
from mapspeak.simulator.camera.camera import SMALLEST_AREA_RATIO
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.coverage import measure_coverage
from mapspeak.spatial.grid import Mask
from mapspeak.spatial.rooms import RoomClass

NOWHERE = StateRecord(
    time_s=0.0, x=0.0, y=0.0, yaw_rad=0.0, slam_error_m=0.0, driven_m=0.0, n_collisions=0
)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Evidence:
    """The truth about a trial.

    Attributes:
        states: The simulator's true states from begin to end; poses in a map without errors.
        grid: The robot's final map; None without one.
        memory: The final semantic map, as YAML; None without one.
        pictured_at: Where the robot truly stood when its last picture came; None without one.
    """

    states: tuple[StateRecord, ...]
    grid: OccupancyGrid | None = None
    memory: str | None = None
    answer: str = ""
    state: TrialState = TrialState.FINISHED
    calls: tuple[ToolCall, ...] = ()
    pictured_at: Point | None = None
    n_errors: int = 0

    @property
    def last(self) -> StateRecord:
        """The final state of the simulation."""
        return self.states[-1] if self.states else NOWHERE

    @property
    def end(self) -> Point:
        """Where the robot truly stood in the end, in the map frame."""
        return self.last.pose.point


# --- answers -------------------------------------------------------------------------------------

LINE = re.compile(r"^\W*ANSWER[\s*_`]*:[\s*_`]*(?P<said>.*?)\W*$", re.IGNORECASE | re.MULTILINE)
"""Models print it in bold, in part or as a whole."""
NUMBER = r"[-+]?\d+(?:\.\d+)?"
UNITS = {"m2": r"(?:m2|m²|m\^2|sq\.? ?m|square met(?:re|er)s)", "m": r"(?:m|met(?:re|er)s)", "": ""}


def read_number(text: str, unit: str = "") -> float | None:
    """Read a number with its unit, "m", "m2" or none; None where the form is not kept."""
    said = read_said(text)
    match = re.fullmatch(rf"(?P<number>{NUMBER})\s*{UNITS[unit]}", said or "", re.IGNORECASE)
    return float(match["number"]) if match else None


def read_letters(text: str) -> frozenset[str] | None:
    """Read letters such as "A, C", or "none"; None where the form is not kept."""
    said = read_said(text)
    if said is None:
        return None
    if said.lower() == "none":
        return frozenset()
    parts = [part for part in re.split(r"[\s,;]+|\band\b", said) if part]
    is_right = all(re.fullmatch(r"[A-Z]", part) for part in parts)
    return frozenset(parts) if parts and is_right else None


def read_point(text: str) -> Point | None:
    """Read two coordinates, "1.5, -2"; None where the form is not kept."""
    said = read_said(text) or ""
    match = re.fullmatch(rf"\(?({NUMBER})\s*(?:m)?\s*,\s*({NUMBER})\s*(?:m)?", said.rstrip(")"))
    return Point(float(match[1]), float(match[2])) if match else None


def read_word(text: str, words: Collection[str]) -> str | None:
    """Read one of some words, whatever its case; None where the form is not kept."""
    said = (read_said(text) or "").casefold()
    return next((word for word in words if word.casefold() == said), None)


def judge_number(evidence: Evidence, truth: float, *, unit: str, tolerance: float) -> Score:
    """Judge a number by how far it is off, in its own unit."""
    said = read_number(evidence.answer, unit)
    if said is None:
        return no_answer(evidence)
    figures = {"off": round(abs(said - truth), 3), "truth": round(truth, 3)}
    reason = f"It said {said:g} {unit}, true are {truth:.2f} {unit}.".replace(" .", ".")
    is_right = abs(said - truth) <= tolerance
    return verdict(reason, figures, failure=None if is_right else Failure.WRONG_ANSWER)


def judge_choice(evidence: Evidence, truth: Collection[str]) -> Score:
    """Judge a choice of letters: all right ones and no other."""
    said = read_letters(evidence.answer)
    if said is None:
        return no_answer(evidence)
    wrong = len(said ^ set(truth))
    reason = f"It said {_listed(said)}, true is {_listed(truth)}."
    failure = Failure.WRONG_ANSWER if wrong else None
    return verdict(reason, {"n_wrong": float(wrong)}, failure=failure)


def _listed(letters: Collection[str]) -> str:
    return ", ".join(sorted(letters)) or "none"


def no_answer(evidence: Evidence) -> Score:
    """Return the score of a trial that ended without an answer in the form asked for."""
    gave_up = evidence.state is TrialState.GAVE_UP
    reason = "There is no answer in the form that was asked for."
    return verdict(reason, {}, failure=Failure.GAVE_UP if gave_up else Failure.NO_ANSWER)


def verdict(reason: str, figures: dict[str, float], *, failure: Failure | None = None) -> Score:
    """Return a score: a success unless a failure is named."""
    return Score(is_success=failure is None, failure=failure, figures=figures, reason=reason)


def read_said(text: str) -> str | None:
    """Read the last line of the form; None without one."""
    lines = [match["said"].strip() for match in LINE.finditer(text)]
    return lines[-1] if lines else None


# --- where the robot is, and what it has mapped --------------------------------------------------

ENOUGH_COVERAGE = 0.9
"""The paper's criterion for Task 1, held to recall: the strictest way to count it."""
HARDLY_MOVED_M = 0.5
RECORD = re.compile(r"^\s*- name:", re.MULTILINE)


def spl(*, is_success: bool, shortest_m: float | None, driven_m: float) -> float | None:
    """Return success weighted by path length (Anderson et al., 2018); None without a way."""
    if shortest_m is None or not math.isfinite(shortest_m):
        return None
    if not is_success:
        return 0.0
    longest_m = max(shortest_m, driven_m)
    return 1.0 if longest_m == 0 else shortest_m / longest_m


def judge_coverage(site: GroundTruth, evidence: Evidence) -> Score:
    """Judge a map, and whether anything was remembered.

    `coverage_recall` is, as everywhere, the share of all floor that a perfect robot could see that
    the map shows as free: it lacks the cells along walls that SLAM draws one cell too thick, and
    slivers behind furniture. By it Task 1 succeeds. `coverage_reachable_recall` is that share of
    the reachable floor alone, all that the robot's body can be over, and `coverage_known_ratio`
    the share of the reachable floor that the map knows, be it as free or as solid.
    `coverage_precision` is the share of the map's free floor that is truly free, and
    `coverage_paper_ratio` the paper's: free area over free area, wherever it lies.
    """
    if evidence.grid is None:
        return _judged(evidence, "The robot has left no map.", {}, Failure.INCOMPLETE)
    seeable = site.floor.visible
    whole = measure_coverage(evidence.grid, seeable)
    reachable = measure_coverage(evidence.grid, seeable, reachable=site.reachable)
    wanted = site.reachable & seeable.free
    n_wanted = int(wanted.sum())
    known_ratio = count_known(evidence.grid, seeable, wanted) / n_wanted if n_wanted else 1.0
    n_recorded = len(RECORD.findall(evidence.memory or ""))
    figures = {
        "coverage_recall": whole.recall,
        "coverage_reachable_recall": reachable.recall,
        "coverage_known_ratio": known_ratio,
        "coverage_precision": whole.precision,
        "coverage_paper_ratio": whole.paper_ratio,
        "n_waypoints": float(n_recorded),
    }
    said = (
        f"{100 * whole.recall:.2f} % of the floor in sight shown as free, "
        f"{100 * known_ratio:.2f} % of the reachable floor known, "
        f"{n_recorded} places remembered."
    )
    if whole.recall < ENOUGH_COVERAGE or not n_recorded:
        return _judged(evidence, said, figures, Failure.INCOMPLETE)
    return verdict(said, _rounded(figures))


def count_known(grid: OccupancyGrid, reference: OccupancyGrid, wanted: Mask) -> int:
    """Return how many of some cells of a reference a map knows."""
    places = reference.points_at(*np.nonzero(wanted))
    return int(np.count_nonzero(~grid.look_up(grid.unknown, places, outside=True)))


def judge_room(site: GroundTruth, evidence: Evidence, wanted: Collection[str]) -> Score:
    """Judge whether the robot stands in one of some spaces, by name."""
    here = site.room_at(evidence.end)
    named = " or ".join(sorted(wanted))
    if here is None:
        said = f"It stands in no room, not in {named}."
        return _judged(evidence, said, {}, Failure.WRONG_PLACE)
    figures = {"room_area_m2": here.free_area_m2}
    name = here.room.name
    if name in wanted:
        return _judged(evidence, f"It stands in {name}.", figures)
    classes = {site.room_named(each).room.room_class for each in wanted}
    is_corridor = here.room.room_class is RoomClass.CORRIDOR and RoomClass.CORRIDOR not in classes
    kind = Failure.CORRIDOR_FOR_ROOM if is_corridor else Failure.WRONG_SIZE
    return _judged(evidence, f"It stands in {name}, not in {named}.", figures, kind)


PICTURING = ("look_through_camera", "look_at", "look_around", "explore", "search_for")
STAYED_M = 0.3
"""A robot that has moved less than this stays where it is."""
FACED_M, FACED_RAD = 1.5, math.radians(30.0)
"""A robot faces a thing from within this distance and angle."""


def judge_thing(site: GroundTruth, evidence: Evidence, things: Sequence[WorldObject]) -> Score:
    """Judge whether the robot stands near one of some things, in free sight of it.

    `faced_near_ratio` is 1 where it stands within 1.5 m of one that it faces, in sight of it, else
    0: what a person means by "go to it". The success is the paper's, as far as it saw things from.
    """
    here = evidence.end
    away_m = {thing.name: here.distance_to(site.place_of(thing)) for thing in things}
    in_sight = [thing for thing in things if site.is_in_sight(here, thing)]
    nearest = min(in_sight or things, key=lambda thing: away_m[thing.name])
    distance_m = away_m[nearest.name]
    is_faced = any(
        away_m[thing.name] <= FACED_M and _heading_off_rad(site, evidence, thing) <= FACED_RAD
        for thing in in_sight
    )
    seen = "in sight" if in_sight else "out of sight"
    said = f"{distance_m:.1f} m from {nearest.name}, {seen}{', facing it' if is_faced else ''}."
    is_there = bool(in_sight) and distance_m <= BESIDE_M
    failure = None if is_there else Failure.WRONG_OBJECT
    figures = {"distance_to_object_m": distance_m, "faced_near_ratio": float(is_faced)}
    return _judged(evidence, said, figures, failure)


def _heading_off_rad(site: GroundTruth, evidence: Evidence, thing: WorldObject) -> float:
    """Return how far the robot's heading in the end is off a thing."""
    here = evidence.last.pose
    return abs(wrap_angle(here.point.bearing_to(site.place_of(thing)) - here.yaw_rad))


def judge_view(site: GroundTruth, evidence: Evidence, things: Sequence[WorldObject]) -> Score:
    """Judge whether a picture was taken, and whether one from there shows one of some things.

    The world is drawn anew from there: a thing counts that takes up as much of the picture as the
    detector's smallest.
    """
    if evidence.pictured_at is None:
        return _judged(evidence, "It took no picture.", {}, Failure.NO_ANSWER)
    if evidence.pictured_at.distance_to(evidence.end) > STAYED_M:
        return _judged(evidence, "It went on after its last picture.", {}, Failure.WRONG_PLACE)
    shares = measure_shares_in_view(site.world, site.in_world(evidence.last.pose))
    share = max(shares.get(thing.name, 0.0) for thing in things)
    said = f"{100 * share:.2f} % of the picture are {things[0].kind.replace('_', ' ')}."
    failure = None if share >= SMALLEST_AREA_RATIO else Failure.WRONG_OBJECT
    return _judged(evidence, said, {"shown_ratio": share}, failure)


def judge_near(evidence: Evidence, goal: Point, *, within_m: float) -> Score:
    """Judge whether the robot is at its goal, within a tolerance in metres."""
    away_m = evidence.end.distance_to(goal)
    said = f"It stands {away_m:.2f} m from where it should."
    failure = None if away_m <= within_m else Failure.WRONG_PLACE
    return _judged(evidence, said, {"distance_to_goal_m": away_m}, failure)


def judge_pose(
    site: GroundTruth, evidence: Evidence, thing: WorldObject, *, within_m: float, facing_rad: float
) -> Score:
    """Judge whether the robot looks at a thing from near, with nothing in between."""
    here, place = evidence.last.pose, site.place_of(thing)
    away_m = here.point.distance_to(place)
    off_rad = _heading_off_rad(site, evidence, thing)
    figures = {"distance_to_object_m": away_m, "heading_off_deg": math.degrees(off_rad)}
    said = f"{away_m:.1f} m from {thing.name}, {math.degrees(off_rad):.0f} deg off."
    is_posed = away_m <= within_m and off_rad <= facing_rad
    is_right = is_posed and site.is_in_sight(here.point, thing)
    return _judged(evidence, said, figures, None if is_right else Failure.WRONG_PLACE)


def judge_route(
    site: GroundTruth, evidence: Evidence, stops: Sequence[Sequence[WorldObject]]
) -> Score:
    """Judge whether the robot came past some things in their order, near each and in sight."""
    n_reached = 0
    for state in evidence.states:
        if n_reached < len(stops) and is_at(site, state.pose.point, stops[n_reached]):
            n_reached += 1
    figures = {"n_stops_reached": float(n_reached), "n_stops": float(len(stops))}
    said = f"It came to {n_reached} of {len(stops)} stops in their order."
    if n_reached < len(stops):
        return _judged(evidence, said, figures, Failure.INCOMPLETE)
    if not is_at(site, evidence.end, stops[-1]):
        said = "It went on after the last stop."
        return _judged(evidence, said, figures, Failure.WRONG_PLACE)
    return _judged(evidence, said, figures)


def is_at(site: GroundTruth, point: Point, things: Iterable[WorldObject]) -> bool:
    """Return True near one of some things, in sight of it."""
    return any(
        point.distance_to(site.place_of(thing)) <= BESIDE_M and site.is_in_sight(point, thing)
        for thing in things
    )


def _judged(
    evidence: Evidence, reason: str, figures: dict[str, float], failure: Failure | None = None
) -> Score:
    """Return the score of a drive; where it never set out, its place is not what went wrong."""
    figures = _rounded({**figures, "n_collisions": float(evidence.last.n_collisions)})
    if failure is not None and evidence.state is TrialState.GAVE_UP:
        failure = Failure.GAVE_UP
    elif failure not in (None, Failure.INCOMPLETE) and evidence.last.driven_m < HARDLY_MOVED_M:
        failure = Failure.GOAL_REFUSED if evidence.n_errors else Failure.NO_ANSWER
    return verdict(reason, figures, failure=failure)


def _rounded(figures: dict[str, float]) -> dict[str, float]:
    return {name: float(np.round(value, 4)) for name, value in figures.items()}
