"""Questions that are answered without driving; the prompt says the form of the answer."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mapspeak.evaluation.scores import Evidence, GroundTruth, judge_choice, judge_number, read_point
from mapspeak.evaluation.tasks.task import dice, draw_start, point_text
from mapspeak.evaluation.trials import Failure, Limits, Score, Setting
from mapspeak.geometry import Point, Pose
from mapspeak.simulator import MeasuredRoom
from mapspeak.simulator.robot.lidar import MAX_RANGE_M
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.rooms import RoomClass

LIMITS = Limits(n_calls=30, robot_time_s=60.0, wall_s=600.0)
NO_DRIVING = "Answer without driving."
LETTERS = "ABCDEFGH"
MOST_CHOICES = 5
AREA_RATIO, AREA_M2 = 0.15, 0.5
WAY_RATIO, WAY_M = 0.1, 0.5
ENOUGH_NEWS_RATIO = 0.5
"""A place to explore next is good when it shows half of what the best one would."""
N_VIEWS = 60


@dataclass(frozen=True, slots=True)
class AskedQuestion:
    """A question as it was drawn.

    Attributes:
        text: The question and the form of the answer.
        truth: What the answer is held to.
    """

    text: str
    truth: dict[str, Any] = field(default_factory=dict)


Ask = Callable[[GroundTruth, np.random.Generator, Pose], AskedQuestion]
Judge = Callable[[GroundTruth, dict[str, Any], Evidence], Score]


@dataclass(frozen=True, slots=True, kw_only=True)
class QuestionTask:
    """The agent reads map and memory and answers.

    Attributes:
        name: Of the task.
        ask: Draws the question.
        judge: Scores the answer.
        is_offered_in: True for worlds that it can be asked in.
        needs_map: The robot has the finished map; else only what it sees from its start.
    """

    name: str
    ask: Ask
    judge: Judge
    is_offered_in: Callable[[GroundTruth], bool]
    needs_map: bool = True

    def is_offered(self, site: GroundTruth) -> bool:
        """Return True where the world has what it asks about."""
        return self.is_offered_in(site)

    def make_setting(self, site: GroundTruth, *, seed: int, memory: str | None) -> Setting:
        """Draw where the robot stands, and the question."""
        random = dice(self.name, site, seed)
        start = draw_start(site, random)
        asked = self.ask(site, random, start)
        return Setting(
            prompt=f"{asked.text} {NO_DRIVING}",
            start=site.in_world(start),
            is_known=self.needs_map,
            memory=memory if self.needs_map else None,
            limits=LIMITS,
            truth=asked.truth,
        )

    def score(self, site: GroundTruth, setting: Setting, evidence: Evidence) -> Score:
        """Score the answer; who has driven has not kept to the question."""
        return self.judge(site, setting.truth, evidence)


# --- how large, how many, which, how far ---------------------------------------------------------


def _ask_area(site: GroundTruth, random: np.random.Generator, _start: Pose) -> AskedQuestion:
    room = _draw(site.rooms, random)
    middle = site.middle_of(room)
    return AskedQuestion(
        f"How many square metres of free floor, on which nothing stands, has the room, corridor or "
        f"hall around {point_text(middle)}? End with a line of the form ANSWER: 12.3 m2.",
        {"number": round(room.free_area_m2, 2), "unit": "m2", "point": _pair(middle)},
    )


def _judge_area(_site: GroundTruth, truth: dict[str, Any], evidence: Evidence) -> Score:
    tolerance = AREA_RATIO * truth["number"] + AREA_M2
    return judge_number(evidence, truth["number"], unit="m2", tolerance=tolerance)


def _ask_doors(site: GroundTruth, random: np.random.Generator, _start: Pose) -> AskedQuestion:
    room = _draw(_closed_rooms(site), random)
    middle = site.middle_of(room)
    n_doors = sum(room.room.name in passage.spaces for passage in site.passages)
    return AskedQuestion(
        f"How many doors or other openings that the robot can drive through has the room around "
        f"{point_text(middle)}? End with a line of the form ANSWER: 2.",
        {"number": n_doors, "unit": "", "point": _pair(middle)},
    )


def _judge_doors(_site: GroundTruth, truth: dict[str, Any], evidence: Evidence) -> Score:
    return judge_number(evidence, truth["number"], unit="", tolerance=0.0)


def _ask_neighbours(site: GroundTruth, random: np.random.Generator, _start: Pose) -> AskedQuestion:
    room = _draw(site.rooms, random)
    beside = set(site.neighbours(room))
    others = [each for each in site.rooms if each.room.name != room.room.name]
    near = [each for each in others if each.room.name in beside]
    far = [each for each in others if each.room.name not in beside]
    shown = [*_some(near, random, MOST_CHOICES - 2), *_some(far, random, 2)]
    shown = [shown[at] for at in random.permutation(len(shown)).tolist()]
    listed = "; ".join(
        f"{letter} {point_text(site.middle_of(each))}"
        for letter, each in zip(LETTERS, shown, strict=False)
    )
    right = [
        letter for letter, each in zip(LETTERS, shown, strict=False) if each.room.name in beside
    ]
    middle = site.middle_of(room)
    return AskedQuestion(
        f"Each letter is a point in another room, corridor or hall: {listed}. Into which of them "
        f"does one come straight from the one around {point_text(middle)}, through one opening "
        "and no third space? End with a line of the form ANSWER: A, C - or ANSWER: none.",
        {
            "letters": right,
            "point": _pair(middle),
            "choices": {
                letter: _pair(site.middle_of(each))
                for letter, each in zip(LETTERS, shown, strict=False)
            },
        },
    )


def _judge_letters(_site: GroundTruth, truth: dict[str, Any], evidence: Evidence) -> Score:
    return judge_choice(evidence, truth["letters"])


def _ask_way(site: GroundTruth, random: np.random.Generator, start: Pose) -> AskedQuestion:
    goal = site.draw_pose(random).point
    way_m = site.ways_from(start.point).distance_to(goal)
    return AskedQuestion(
        f"How many metres does the robot have to drive from where it stands to {point_text(goal)}? "
        "End with a line of the form ANSWER: 12.3 m.",
        {"number": round(way_m or 0.0, 2), "unit": "m", "point": _pair(goal)},
    )


def _judge_way(_site: GroundTruth, truth: dict[str, Any], evidence: Evidence) -> Score:
    tolerance = WAY_RATIO * truth["number"] + WAY_M
    return judge_number(evidence, truth["number"], unit="m", tolerance=tolerance)


# --- where to explore next -----------------------------------------------------------------------


def _ask_explore(_site: GroundTruth, _random: np.random.Generator, _start: Pose) -> AskedQuestion:
    return AskedQuestion(
        "The map is not finished. To which place on free floor should the robot drive next to see "
        "as much new floor as possible from there? End with a line of the form ANSWER: 1.5, -2.0 "
        "- x and y in metres on the map."
    )


def _judge_explore(site: GroundTruth, _truth: dict[str, Any], evidence: Evidence) -> Score:
    said = read_point(evidence.answer)
    if said is None or evidence.grid is None:
        return Score(
            is_success=False,
            failure=Failure.NO_ANSWER,
            reason="There is no place in the form that was asked for.",
        )
    grid = evidence.grid
    cell = grid.cell_at(said)
    if not grid.is_free(cell):
        return Score(
            is_success=False,
            failure=Failure.WRONG_PLACE,
            reason=f"{point_text(said)} is no free floor on the map.",
        )
    new_m2 = _news_m2(site, grid, said)
    best_m2 = max((_news_m2(site, grid, view) for view in _views(site, grid)), default=0.0)
    figures = {"new_m2": round(new_m2, 2), "best_m2": round(best_m2, 2)}
    reason = f"From there {new_m2:.1f} m2 are new, {best_m2:.1f} m2 from the best place."
    if new_m2 >= ENOUGH_NEWS_RATIO * best_m2:
        return Score(is_success=True, figures=figures, reason=reason)
    return Score(is_success=False, failure=Failure.WRONG_ANSWER, figures=figures, reason=reason)


def _views(site: GroundTruth, grid: OccupancyGrid) -> list[Point]:
    """Return places on the known free floor, spread evenly and always the same."""
    rows, cols = np.nonzero(site.roomy)
    places = site.grid.points_at(rows, cols)
    at_rows, at_cols = grid.cells_at(places)
    is_inside = grid.contains_cells(at_rows, at_cols)
    known = places[is_inside][grid.free[at_rows[is_inside], at_cols[is_inside]]]
    every = max(len(known) // N_VIEWS, 1)
    return [Point(float(x), float(y)) for x, y in known[::every]]


def _news_m2(site: GroundTruth, grid: OccupancyGrid, view: Point) -> float:
    """Return how much floor comes into view from a place that the map does not know."""
    seen = site.seen_near(view, MAX_RANGE_M)
    rows, cols = np.nonzero(seen)
    if not rows.size:
        return 0.0
    at_rows, at_cols = grid.cells_at(site.grid.points_at(rows, cols))
    is_inside = grid.contains_cells(at_rows, at_cols)
    is_known = np.zeros(rows.size, dtype=bool)
    is_known[is_inside] = ~grid.unknown[at_rows[is_inside], at_cols[is_inside]]
    return float((~is_known).sum()) * site.LOOK_EVERY_M**2


# --- drawing -------------------------------------------------------------------------------------


def _draw(rooms: tuple[MeasuredRoom, ...], random: np.random.Generator) -> MeasuredRoom:
    return rooms[int(random.integers(len(rooms)))]


def _some(rooms: list[MeasuredRoom], random: np.random.Generator, most: int) -> list[MeasuredRoom]:
    return [rooms[at] for at in random.permutation(len(rooms))[:most].tolist()]


def _closed_rooms(site: GroundTruth) -> tuple[MeasuredRoom, ...]:
    return tuple(room for room in site.rooms if room.room.room_class is RoomClass.ROOM)


def _pair(point: Point) -> list[float]:
    return [round(point.x, 2), round(point.y, 2)]


def _has_rooms(site: GroundTruth) -> bool:
    return bool(site.rooms)


def _has_closed_rooms(site: GroundTruth) -> bool:
    return bool(_closed_rooms(site))


def _has_neighbours(site: GroundTruth) -> bool:
    return len(site.rooms) > 1


def _always(site: GroundTruth) -> bool:
    return math.isfinite(site.grid.resolution_m)


QUESTION_TASKS = (
    QuestionTask(name="question-area", ask=_ask_area, judge=_judge_area, is_offered_in=_has_rooms),
    QuestionTask(
        name="question-doors", ask=_ask_doors, judge=_judge_doors, is_offered_in=_has_closed_rooms
    ),
    QuestionTask(
        name="question-neighbours",
        ask=_ask_neighbours,
        judge=_judge_letters,
        is_offered_in=_has_neighbours,
    ),
    QuestionTask(name="question-way", ask=_ask_way, judge=_judge_way, is_offered_in=_always),
    QuestionTask(
        name="question-explore",
        ask=_ask_explore,
        judge=_judge_explore,
        is_offered_in=_always,
        needs_map=False,
    ),
)
