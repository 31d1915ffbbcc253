import pytest

from mapspeak.evaluation.scores.answers import (
    judge_choice,
    judge_number,
    read_letters,
    read_number,
    read_point,
    read_word,
)
from mapspeak.evaluation.trials import Failure
from mapspeak.geometry import Point
from sites import HALL, ended_at


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
