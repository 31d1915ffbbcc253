"""What a label's head says decides what a thing is, with a model and without."""

from functools import cache

import pytest

from embedding import shipped_model
from mapspeak.memory.search.answer import Answer, Entry, EntryKind, Verdict
from mapspeak.memory.search.index import EntryIndex
from mapspeak.memory.search.kinds import calls_by_name, is_carrier
from mapspeak.memory.search.meaningindex import TextVectors

OTHERS = ("desk", "whiteboard")


@cache
def model_vectors() -> TextVectors:
    return TextVectors(shipped_model())


def ask(label: str, request: str, *, way: str) -> Answer:
    entries = [Entry(id=name, kind=EntryKind.THING, name=name) for name in (label, *OTHERS)]
    return EntryIndex(entries, vectors=model_vectors() if way == "model" else None).find(request)


@pytest.mark.parametrize("way", ["model", "words"])
@pytest.mark.parametrize(
    ("label", "request_"),
    [
        ("sofa by the window", "window"),
        ("sofa by the window", "where is the window?"),
        ("picture of a fire extinguisher", "fire extinguisher"),
        ("empty bracket for fire extinguisher", "fire extinguisher"),
        ("box for fire extinguisher", "fire extinguisher"),
        ("missing fire extinguisher, see note", "extinguisher by the lift"),
        ("fire extinguisher sign", "fire extinguisher"),
        ("sign: toilet", "toilet"),
        ("sign to the toilet", "toilet"),
        ("door to the toilet", "toilet"),
        ("toilet paper", "toilet"),
        ("exit sign", "exit"),
        ("fire extinguisher next to the sofa", "couch"),
        ("cabinet with first aid kit", "first aid box"),
        ("AED under the stairs", "stairs"),
        ("tennis table", "dining table"),
        ("mouse", "mouse trap"),
        ("gas valve", "gas station"),
        ("fireplace", "something is burning"),
        ("kitchen sink", "somewhere that is not the kitchen sink"),
        ("first aid kit", "there is no first aid kit here, where is another"),
    ],
)
def test_what_is_not_the_head_of_a_label_makes_no_answer_sure(
    label: str, request_: str, way: str
) -> None:
    answer = ask(label, request_, way=way)

    assert not answer.is_sure
    assert answer.verdict is not Verdict.FOUND


@pytest.mark.parametrize("way", ["model", "words"])
@pytest.mark.parametrize(
    ("label", "request_"),
    [
        ("AED under the stairs", "defibrillator"),
        ("sofa by the window", "couch"),
        ("sofa (red), by the window", "settee"),
        ("sofa 2", "couch"),
        ("AED box", "defibrillator"),
        ("loo", "toilet"),
        ("gents", "toilet"),
        ("W.C.", "toilet"),
        ("men's room", "toilet"),
        ("telly", "tv"),
        ("tennis table", "ping-pong table"),
        ("reading chair", "recliner"),
        ("foam extinguisher", "fire extinguisher"),
        ("red table", "dining table"),
        ("old box of returns", "returns shelf"),
    ],
)
def test_a_thing_is_remembered_by_the_other_names_of_its_head(
    label: str, request_: str, way: str
) -> None:
    answer = ask(label, request_, way=way)

    assert answer.verdict is not Verdict.NOT_REMEMBERED
    assert answer.candidates[0].entry.name == label


@pytest.mark.parametrize(
    ("label", "request_"),
    [
        ("sofa by the window", "couch"),
        ("AED under the stairs", "defibrillator"),
        ("fire extinguisher beside the lift", "I need the fire extinguisher"),
        ("first aid kit on the wall", "how do I get to the first aid box"),
        ("foam extinguisher", "fire extinguisher"),
        ("time clock", "which way is the time clock"),
    ],
)
def test_what_the_head_of_a_label_says_is_sure_with_a_model(label: str, request_: str) -> None:
    assert ask(label, request_, way="model").verdict is Verdict.FOUND


@pytest.mark.parametrize(
    "request_",
    [
        "I'd like you to find the ladder",
        "Let's go to the ladder",
        "I've got to find a ladder",
        "would you kindly help me find the ladder",
    ],
)
def test_what_people_say_before_a_name_makes_it_no_less_sure(request_: str) -> None:
    assert ask("ladder", request_, way="words").verdict is Verdict.FOUND


@pytest.mark.parametrize(
    ("request_", "name", "is_so"),
    [
        ("fire extinguisher", "foam fire extinguisher", True),
        ("the extinguisher near the lift", "fire extinguisher", True),
        ("sinks", "kitchen sink", True),
        ("dining table", "tennis table", False),
        ("mouse trap", "mouse", False),
        ("gas station", "gas valve", False),
        ("not the sink", "sink", False),
        ("", "sink", False),
        ("the", "sink", False),
        ("소화기", "소화기", True),
    ],
)
def test_a_request_calls_a_thing_by_the_end_of_its_head(
    request_: str, name: str, *, is_so: bool
) -> None:
    assert calls_by_name(request_, [name]) is is_so


@pytest.mark.parametrize(
    ("label", "is_so"),
    [
        ("fire extinguisher sign", True),
        ("two signs on the wall", True),
        ("empty bracket for fire extinguisher", True),
        ("label printer", False),
        ("", False),
    ],
)
def test_what_shows_a_thing_or_has_room_for_it_is_a_carrier(label: str, *, is_so: bool) -> None:
    assert is_carrier(label) is is_so
