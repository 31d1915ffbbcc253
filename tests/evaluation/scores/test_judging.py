import math
from dataclasses import replace

import pytest

from mapspeak.evaluation.scores.groundtruth import GroundTruth
from mapspeak.evaluation.scores.judging import (
    Evidence,
    judge_choice,
    judge_coverage,
    judge_near,
    judge_number,
    judge_pose,
    judge_room,
    judge_route,
    judge_thing,
    judge_view,
    read_letters,
    read_number,
    read_point,
    read_word,
    spl,
)
from mapspeak.evaluation.trials import Failure, TrialState
from mapspeak.geometry import Point
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.coverage import measure_coverage
from sites import CORRIDOR, HALL, LARGE_ROOM, SMALL_ROOM, ended_at, make_flat

MEMORY = "waypoints:\n  - name: view 1\n"


@pytest.fixture(scope="module")
def flat(tmp_path_factory: pytest.TempPathFactory) -> GroundTruth:
    """The truth of a small flat."""
    return GroundTruth(make_flat(tmp_path_factory.mktemp("flat")))


def test_the_neighbours_of_a_room_are_those_behind_its_doors(flat: GroundTruth) -> None:
    assert flat.neighbours(flat.room_named("small room")) == ("corridor", "hall")
    assert flat.neighbours(flat.room_named("large room")) == ("hall",)
    assert len(flat.passages) == 3


def test_the_floor_of_a_room_ends_at_its_walls(flat: GroundTruth) -> None:
    inside_m2 = (3 - 0.12) * (3 - 0.12)
    assert flat.floor_area_m2(flat.room_named("small room")) == pytest.approx(inside_m2, rel=0.03)


def test_whoever_stands_in_the_right_room_has_done_it(flat: GroundTruth) -> None:
    assert judge_room(flat, ended_at(SMALL_ROOM), ["small room"]).is_success


@pytest.mark.parametrize(
    ("place", "failure"),
    [
        (LARGE_ROOM, Failure.WRONG_SIZE),
        (CORRIDOR, Failure.CORRIDOR_FOR_ROOM),
        (Point(50.0, 50.0), Failure.WRONG_PLACE),
    ],
)
def test_a_wrong_room_is_said_to_be_wrong_in_its_own_way(
    flat: GroundTruth, place: Point, failure: Failure
) -> None:
    assert judge_room(flat, ended_at(place), ["small room"]).failure is failure


def test_a_robot_that_never_set_out_was_refused_or_never_asked(flat: GroundTruth) -> None:
    still = replace(ended_at(HALL).last, driven_m=0.0)
    refused = Evidence(states=(still,), n_errors=2)
    assert judge_room(flat, refused, ["small room"]).failure is Failure.GOAL_REFUSED
    silent = Evidence(states=(still,))
    assert judge_room(flat, silent, ["small room"]).failure is Failure.NO_ANSWER
    gave_up = Evidence(states=(still,), state=TrialState.GAVE_UP)
    assert judge_room(flat, gave_up, ["small room"]).failure is Failure.GAVE_UP


def test_a_thing_behind_a_wall_is_not_reached_however_near_it_is(flat: GroundTruth) -> None:
    things = flat.things("fire_extinguisher")
    assert judge_thing(flat, ended_at(Point(4.0, 0.5)), things).is_success
    assert judge_thing(flat, ended_at(CORRIDOR), things).failure is Failure.WRONG_OBJECT


def test_a_thing_is_faced_from_near_and_in_sight_of_it_alone(flat: GroundTruth) -> None:
    things = flat.things("fire_extinguisher")

    def faced(place: Point, yaw_rad: float) -> float:
        return judge_thing(flat, ended_at(place, yaw_rad=yaw_rad), things).figures[
            "faced_near_ratio"
        ]

    assert faced(Point(5.8, 0.5), 0.0) == 1.0
    assert faced(Point(5.8, 0.5), math.pi / 2) == 0.0
    assert faced(Point(4.0, 0.5), 0.0) == 0.0
    assert faced(Point(7.6, 0.5), math.pi) == 0.0


def test_a_picture_counts_that_was_taken_and_shows_the_thing(flat: GroundTruth) -> None:
    things = flat.things("fire_extinguisher")
    ahead = replace(ended_at(Point(4.0, 0.5)), pictured_at=Point(4.0, 0.5))
    assert judge_view(flat, ahead, things).is_success
    before = replace(ahead, pictured_at=Point(1.0, 0.5))
    assert judge_view(flat, before, things).failure is Failure.WRONG_PLACE
    aside = replace(ended_at(Point(4.0, 0.5), yaw_rad=math.pi), pictured_at=Point(4.0, 0.5))
    assert judge_view(flat, aside, things).failure is Failure.WRONG_OBJECT
    assert judge_view(flat, ended_at(Point(4.0, 0.5)), things).failure is Failure.NO_ANSWER


def test_a_place_counts_to_so_many_metres() -> None:
    goal = Point(3.0, 0.5)
    assert judge_near(ended_at(Point(3.2, 0.5)), goal, within_m=0.4).is_success
    assert not judge_near(ended_at(Point(3.5, 0.5)), goal, within_m=0.4).is_success


def test_who_looks_away_does_not_face_a_thing(flat: GroundTruth) -> None:
    (thing,) = flat.things("fire_extinguisher")
    facing, away = ended_at(Point(4.5, 0.5)), ended_at(Point(4.5, 0.5), yaw_rad=math.pi)
    assert judge_pose(flat, facing, thing, within_m=3.5, facing_rad=0.5).is_success
    assert not judge_pose(flat, away, thing, within_m=3.5, facing_rad=0.5).is_success


def test_a_route_has_to_keep_its_order(flat: GroundTruth) -> None:
    stops = [flat.things("fire_extinguisher"), flat.things("printer")]
    there, then = Point(5.0, 0.5), Point(0.5, 3.5)
    assert judge_route(flat, ended_at(HALL, there, then), stops).is_success
    wrong = judge_route(flat, ended_at(HALL, then, there), stops)
    assert wrong.failure is Failure.INCOMPLETE
    assert wrong.figures["n_stops_reached"] == 1


def test_a_perfect_map_recalls_everything_and_an_unremembered_one_is_incomplete(
    flat: GroundTruth,
) -> None:
    perfect = ended_at(HALL, grid=flat.floor.visible, memory=MEMORY)
    score = judge_coverage(flat, perfect)
    assert score.is_success
    assert score.figures["coverage_recall"] == score.figures["coverage_paper_ratio"] == 1.0
    without_memory = replace(perfect, memory=None)
    assert judge_coverage(flat, without_memory).failure is Failure.INCOMPLETE


def test_floor_that_a_map_knows_as_solid_is_known_and_not_recalled(flat: GroundTruth) -> None:
    whole = flat.floor.visible
    cells = whole.cells.copy()
    cells[:, : whole.n_cols // 2] = 100
    walled = OccupancyGrid(cells=cells, resolution_m=whole.resolution_m, origin=whole.origin)
    score = judge_coverage(flat, ended_at(HALL, grid=walled, memory=MEMORY))
    assert score.failure is Failure.INCOMPLETE
    assert score.figures["coverage_known_ratio"] == 1.0
    assert score.figures["coverage_recall"] == pytest.approx(0.5, abs=0.05)
    assert score.figures["coverage_reachable_recall"] == pytest.approx(0.5, abs=0.05)


def test_recall_is_what_the_demo_calls_so(flat: GroundTruth) -> None:
    whole = flat.floor.visible
    cells = whole.cells.copy()
    cells[: whole.n_rows // 3] = -1
    part = OccupancyGrid(cells=cells, resolution_m=whole.resolution_m, origin=whole.origin)
    score = judge_coverage(flat, ended_at(HALL, grid=part, memory=MEMORY))
    demo = measure_coverage(part, whole)
    assert score.figures["coverage_recall"] == pytest.approx(demo.recall, abs=1e-4)


def test_half_a_map_recalls_half(flat: GroundTruth) -> None:
    whole = flat.floor.visible
    cells = whole.cells.copy()
    cells[:, : whole.n_cols // 2] = -1
    half = OccupancyGrid(cells=cells, resolution_m=whole.resolution_m, origin=whole.origin)
    score = judge_coverage(flat, ended_at(HALL, grid=half, memory=MEMORY))
    assert score.failure is Failure.INCOMPLETE
    assert score.figures["coverage_recall"] == pytest.approx(0.5, abs=0.05)


def test_success_is_weighted_by_the_shortest_way_over_the_way_that_was_driven() -> None:
    assert spl(is_success=True, shortest_m=5.0, driven_m=10.0) == 0.5
    assert spl(is_success=True, shortest_m=5.0, driven_m=4.9) == 1.0
    assert spl(is_success=False, shortest_m=5.0, driven_m=5.0) == 0.0
    assert spl(is_success=True, shortest_m=None, driven_m=5.0) is None


@pytest.mark.parametrize(
    ("text", "unit", "number"),
    [
        ("ANSWER: 12.3 m2", "m2", 12.3),
        ("I think so.\n**ANSWER: 12.3 m²**", "m2", 12.3),
        ("answer: 4 metres", "m", 4.0),
        ("ANSWER: 3", "", 3.0),
        ("ANSWER: 1 m\nANSWER: 2 m", "m", 2.0),
        ("ANSWER: 12.3", "m2", None),
        ("ANSWER: 12.3 m", "m2", None),
        ("ANSWER: about 12 m2", "m2", None),
        ("12.3 m2", "m2", None),
    ],
)
def test_a_number_needs_its_line_and_its_unit(text: str, unit: str, number: float | None) -> None:
    assert read_number(text, unit) == number


@pytest.mark.parametrize(
    ("text", "letters"),
    [
        ("ANSWER: A, C", {"A", "C"}),
        ("ANSWER: B and D.", {"B", "D"}),
        ("ANSWER: none", set()),
        ("ANSWER: room A", None),
        ("ANSWER:", None),
    ],
)
def test_letters_stand_alone(text: str, letters: set[str] | None) -> None:
    assert read_letters(text) == letters


def test_points_and_words_are_read_in_their_forms_alone() -> None:
    assert read_point("ANSWER: (1.5, -2.0)") == Point(1.5, -2.0)
    assert read_point("ANSWER: 1.5") is None
    assert read_word("ANSWER: Unreachable.", ("there", "unreachable")) == "unreachable"
    assert read_word("It is unreachable.", ("there", "unreachable")) is None


def test_a_number_may_be_off_by_its_tolerance() -> None:
    near = ended_at(HALL, answer="ANSWER: 11 m2")
    assert judge_number(near, 10.0, unit="m2", tolerance=1.0).is_success
    far = ended_at(HALL, answer="ANSWER: 12 m2")
    assert judge_number(far, 10.0, unit="m2", tolerance=1.0).failure is Failure.WRONG_ANSWER
    silent = ended_at(HALL, answer="Twelve or so.")
    assert judge_number(silent, 10.0, unit="m2", tolerance=1.0).failure is Failure.NO_ANSWER


def test_a_choice_is_all_or_nothing() -> None:
    said = ended_at(HALL, answer="ANSWER: A, B")
    assert judge_choice(said, ["B", "A"]).is_success
    assert judge_choice(said, ["A"]).figures["n_wrong"] == 1


@pytest.mark.parametrize(
    "answer",
    [
        "ANSWER: {}",
        "**ANSWER:** {}",
        "ANSWER: **{}**",
        "**ANSWER: {}**",
        "`ANSWER: {}`",
        "*Answer*: {}.",
    ],
)
def test_an_answer_may_be_printed_in_bold(answer: str) -> None:
    assert read_number(answer.format("-2.5 m"), "m") == -2.5
    assert read_letters(answer.format("A, C")) == frozenset({"A", "C"})
    assert read_point(answer.format("-1.5, -2")) == Point(-1.5, -2.0)
    assert read_word(answer.format("unreachable"), ("there", "unreachable")) == "unreachable"
