"""Questions that are answered without driving; the prompt says the form of the answer."""

from collections.abc import Callable
from typing import Any

import numpy as np

from mapspeak.evaluation.scores.groundtruth import GroundTruth
from mapspeak.evaluation.scores.judging import (
    Evidence,
    count_known,
    judge_choice,
    judge_number,
    read_point,
    verdict,
)
from mapspeak.evaluation.tasks.task import NO_DRIVING, Draw, Task, Truth, pair, point_text
from mapspeak.evaluation.trials import Failure, Limits, Score, Setting
from mapspeak.geometry import Point, Pose
from mapspeak.simulator import MeasuredRoom
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.rooms import RoomClass

LIMITS = Limits(n_calls=30, robot_time_s=60.0, wall_s=600.0)
LETTERS = "ABCDEFGH"
N_SAME = 3
"""Points in one room, when it is asked which are."""
MOST_NEAR, MOST_FAR = 3, 2
"""Rooms to choose from: neighbours, and others."""
ENOUGH_NEW_RATIO = 0.5
"""A place to explore next is good if its gain is at least this share of the best."""
N_VIEWS = 60

Question = tuple[str, dict[str, Any]]
"""A question with the form of its answer, and what the answer is held to."""


def _question(
    ask: Callable[[Draw, Pose], Question], *, is_known: bool = True
) -> Callable[[Draw], Setting]:
    """Return what draws where the robot stands, and then the question."""

    def draw(draw: Draw) -> Setting:
        start = draw.start()
        text, truth = ask(draw, start)
        prompt = f"{text} {NO_DRIVING}"
        return draw.setting(prompt, start, truth, is_known=is_known, limits=LIMITS)

    return draw


# --- how large, how many, which, how far ---------------------------------------------------------


def _ask_area(draw: Draw, _start: Pose) -> Question:
    room = draw.one_of(draw.site.rooms)
    middle = draw.site.middle_of(room)
    text = (
        f"How many square metres of free floor, on which nothing stands, has the room, corridor or "
        f"hall around {point_text(middle)}? End with a line of the form ANSWER: 12.3 m2."
    )
    return text, _number(round(room.free_area_m2, 2), "m2", middle)


def _ask_doors(draw: Draw, _start: Pose) -> Question:
    room = draw.one_of(_closed_rooms(draw.site))
    middle = draw.site.middle_of(room)
    n_doors = sum(room.room.name in passage.spaces for passage in draw.site.passages)
    text = (
        f"How many doors or other openings that the robot can drive through has the room around "
        f"{point_text(middle)}? End with a line of the form ANSWER: 2."
    )
    return text, _number(n_doors, "", middle)


def _closed_rooms(site: GroundTruth) -> list[MeasuredRoom]:
    return [room for room in site.rooms if room.room.room_class is RoomClass.ROOM]


def _ask_neighbours(draw: Draw, _start: Pose) -> Question:
    site = draw.site
    room = draw.one_of(site.rooms)
    beside = set(site.neighbours(room))
    others = [each for each in site.rooms if each.room.name != room.room.name]
    near = [each for each in others if each.room.name in beside]
    far = [each for each in others if each.room.name not in beside]
    shown = draw.shuffled([*draw.shuffled(near)[:MOST_NEAR], *draw.shuffled(far)[:MOST_FAR]])
    choices = dict(zip(LETTERS, shown, strict=False))
    middles = {letter: site.middle_of(each) for letter, each in choices.items()}
    listed = "; ".join(f"{letter} {point_text(middle)}" for letter, middle in middles.items())
    middle = site.middle_of(room)
    text = (
        f"Each letter is a point in another room, corridor or hall: {listed}. Into which of them "
        f"does one come straight from the one around {point_text(middle)}, through one opening "
        "and no third space? End with a line of the form ANSWER: A, C - or ANSWER: none."
    )
    letters = [letter for letter, each in choices.items() if each.room.name in beside]
    return text, {
        "letters": letters,
        "said": ", ".join(letters) or "none",
        "point": pair(middle),
        "choices": {letter: pair(each) for letter, each in middles.items()},
    }


def _ask_same(draw: Draw, _start: Pose) -> Question:
    """Ask which points lie in one room: wrong where rooms are split that are one, or joined."""
    site = draw.site
    room = draw.one_of(site.rooms)
    beside = [each for each in site.rooms if each.room.name in site.neighbours(room)]
    spaces = [room] * N_SAME + draw.shuffled(beside)[:MOST_NEAR]
    shown = dict(zip(LETTERS, draw.shuffled(spaces), strict=False))
    points = {
        letter: site.draw_pose(draw.random, site.cells_of(each)).point
        for letter, each in shown.items()
    }
    listed = "; ".join(f"{letter} {point_text(point)}" for letter, point in points.items())
    middle = site.middle_of(room)
    text = (
        f"Each letter is a point: {listed}. Which of them lie in the same room, corridor or hall "
        f"as {point_text(middle)}? End with a line of the form ANSWER: A, C - or ANSWER: none."
    )
    letters = [letter for letter, each in shown.items() if each is room]
    return text, {"letters": letters, "said": ", ".join(letters), "point": pair(middle)}


def _ask_way(draw: Draw, start: Pose) -> Question:
    goal = draw.site.draw_pose(draw.random).point
    way_m = draw.site.ways_from(start.point).distance_to(goal)
    text = (
        f"How many metres does the robot have to drive from where it stands to {point_text(goal)}? "
        "End with a line of the form ANSWER: 12.3 m."
    )
    return text, _number(round(way_m or 0.0, 2), "m", goal)


def _number(number: float, unit: str, point: Point) -> dict[str, Any]:
    said = f"{number} {unit}".rstrip()
    return {"number": number, "unit": unit, "said": said, "point": pair(point)}


def _judge_number(*, ratio: float, least: float) -> Callable[[GroundTruth, Truth, Evidence], Score]:
    """Judge a number that may be off by a share of the truth and a little more."""

    def judge(_site: GroundTruth, truth: Truth, evidence: Evidence) -> Score:
        number = truth["number"]
        tolerance = ratio * number + least
        return judge_number(evidence, number, unit=truth["unit"], tolerance=tolerance)

    return judge


# --- where to explore next -----------------------------------------------------------------------


def _ask_explore(_draw: Draw, _start: Pose) -> Question:
    text = (
        "The map is not finished. To which place on free floor should the robot drive next to see "
        "as much new floor as possible from there? End with a line of the form ANSWER: 1.5, -2.0 "
        "- x and y in metres on the map."
    )
    return text, {}


def _judge_explore(site: GroundTruth, _truth: Truth, evidence: Evidence) -> Score:
    said, grid = read_point(evidence.answer), evidence.grid
    if said is None or grid is None:
        reason = "There is no place in the form that was asked for."
        return verdict(reason, {}, failure=Failure.NO_ANSWER)
    if not grid.is_free(grid.cell_at(said)):
        reason = f"{point_text(said)} is no free floor on the map."
        return verdict(reason, {}, failure=Failure.WRONG_PLACE)
    new_m2 = _new_floor_m2(site, grid, said)
    best_m2 = max((_new_floor_m2(site, grid, view) for view in _views(site, grid)), default=0.0)
    figures = {"new_m2": round(new_m2, 2), "best_m2": round(best_m2, 2)}
    reason = f"From there {new_m2:.1f} m2 are new, {best_m2:.1f} m2 from the best place."
    is_good = new_m2 >= ENOUGH_NEW_RATIO * best_m2
    return verdict(reason, figures, failure=None if is_good else Failure.WRONG_ANSWER)


def _views(site: GroundTruth, grid: OccupancyGrid) -> list[Point]:
    """Return places on the known free floor, spread evenly and always the same."""
    places = site.grid.points_at(*np.nonzero(site.roomy))
    known = places[grid.look_up(grid.free, places, outside=False)]
    every = max(len(known) // N_VIEWS, 1)
    return [Point(float(x), float(y)) for x, y in known[::every]]


def _new_floor_m2(site: GroundTruth, grid: OccupancyGrid, view: Point) -> float:
    """Return how much floor comes into view from a place that the map does not know."""
    seen = site.floor.see_from([view]) & site.drivable
    n_new = int(seen.sum()) - count_known(grid, site.grid, seen)
    return float(n_new) * site.grid.resolution_m**2


QUESTION_TASKS = (
    Task(
        name="question-area",
        draw=_question(_ask_area),
        judge=_judge_number(ratio=0.15, least=0.5),
        is_offered=lambda site: bool(site.rooms),
    ),
    Task(
        name="question-doors",
        draw=_question(_ask_doors),
        judge=_judge_number(ratio=0.0, least=0.0),
        is_offered=lambda site: bool(_closed_rooms(site)),
    ),
    Task(
        name="question-neighbours",
        draw=_question(_ask_neighbours),
        judge=lambda _site, truth, evidence: judge_choice(evidence, truth["letters"]),
        is_offered=lambda site: len(site.rooms) > 1,
    ),
    Task(
        name="question-same-room",
        draw=_question(_ask_same),
        judge=lambda _site, truth, evidence: judge_choice(evidence, truth["letters"]),
        is_offered=lambda site: len(site.rooms) > 1,
    ),
    Task(
        name="question-way",
        draw=_question(_ask_way),
        judge=_judge_number(ratio=0.1, least=0.5),
    ),
    Task(
        name="question-explore",
        draw=_question(_ask_explore, is_known=False),
        judge=_judge_explore,
        needs_map=False,
    ),
)
