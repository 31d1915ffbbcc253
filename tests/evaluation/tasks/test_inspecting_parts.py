import pytest

from mapspeak.evaluation.scores.judging import Evidence
from mapspeak.evaluation.tasks.inspections import AnswerPart, judge_parts
from mapspeak.evaluation.trials import Failure, TrialState

MAP = (
    AnswerPart("/map"),
    AnswerPart("384 x 320"),
    AnswerPart("0.05 m", 0.001),
)


def judged(answer: str, *parts: AnswerPart, is_ordered: bool = True) -> tuple[bool, Failure | None]:
    score = judge_parts(Evidence(states=(), answer=answer), parts, is_ordered=is_ordered)
    return score.is_success, score.failure


@pytest.mark.parametrize(
    "answer",
    [
        "ANSWER: /map, 384 x 320, 0.05 m",
        "I looked.\nANSWER: `map`, 384x320 cells, 0.05",
        "**ANSWER: /map, 384 by 320, 0.0501 metres**",
    ],
)
def test_a_right_answer_may_be_written_in_the_usual_ways(answer: str) -> None:
    assert judged(answer, *MAP) == (True, None)


@pytest.mark.parametrize(
    "answer",
    [
        "ANSWER: /map, 320 x 384, 0.05 m",
        "ANSWER: /maps, 384 x 320, 0.05 m",
        "ANSWER: /map, 384 x 320, 0.1 m",
        "ANSWER: /map, 384 x 320",
        "ANSWER: /map, 384 x 320, 0.05 m, /scan",
        "ANSWER: the map is /map, 384 x 320, 0.05 m",
    ],
)
def test_one_wrong_part_makes_an_answer_wrong(answer: str) -> None:
    assert judged(answer, *MAP) == (False, Failure.WRONG_ANSWER)


def test_without_a_line_in_the_form_there_is_no_answer() -> None:
    assert judged("It is /map.", *MAP) == (False, Failure.NO_ANSWER)
    given_up = Evidence(states=(), answer="I do not know.", state=TrialState.GAVE_UP)
    assert judge_parts(given_up, MAP).failure is Failure.GAVE_UP


def test_parts_right_are_counted_in_a_wrong_answer() -> None:
    score = judge_parts(Evidence(states=(), answer="ANSWER: /map, 1 x 1, 0.05"), MAP)
    assert score.figures == {"n_right": 2.0, "n_asked": 3.0}


def test_names_in_any_order_must_be_all_and_no_others() -> None:
    both = (AnswerPart("/a"), AnswerPart("/b"))
    assert judged("ANSWER: /b, /a", *both, is_ordered=False)[0]
    assert not judged("ANSWER: /b, /a", *both)[0]
    assert not judged("ANSWER: /a", *both, is_ordered=False)[0]
    assert not judged("ANSWER: /a, /a", *both, is_ordered=False)[0]
    assert not judged("ANSWER: /a, /b, /c", *both, is_ordered=False)[0]


def test_types_count_in_the_words_of_either_ros() -> None:
    kind = AnswerPart("std_srvs/Trigger")
    assert judged("ANSWER: std_srvs/srv/Trigger", kind)[0]
    assert judged("ANSWER: std_srvs/Trigger", kind)[0]
    assert not judged("ANSWER: Trigger", kind)[0]
    assert not judged("ANSWER: std_srvs/srv/Empty", kind)[0]


def test_a_link_is_two_frames_in_their_order() -> None:
    link = AnswerPart("map -> odom")
    assert judged("ANSWER: map -> odom", link)[0]
    assert judged("ANSWER: map to odom", link)[0]
    assert not judged("ANSWER: odom -> map", link)[0]
