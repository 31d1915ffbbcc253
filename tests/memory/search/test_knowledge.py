from collections import Counter

import pytest

from mapspeak.memory.search.kinds import (
    find_kinds,
    find_named_kinds,
    find_names,
    read_kinds,
)


@pytest.mark.parametrize(
    ("label", "name"),
    [
        ("fire extinguisher", "fire extinguisher"),
        ("CO2 fire extinguishers", "fire extinguisher"),
        ("the red couch", "sofa"),
        ("robot docking station", "charging station"),
        ("sink of the unicorn", "sink"),
        ("sofa by the window", "sofa"),
        ("fire extinguisher next to the sofa", "fire extinguisher"),
        ("AED under the stairs", "defibrillator"),
        ("fridge (broken) beside the oven", "fridge"),
        ("old box of returns", "box of returns"),
        ("3D printer", "3d printer"),
        ("reading lamp", "lamp"),
    ],
)
def test_a_label_is_of_the_kind_that_the_end_of_its_head_names(label: str, name: str) -> None:
    assert [kind.names[0] for kind in find_kinds(label)] == [name]


@pytest.mark.parametrize(
    "label",
    [
        "",
        "the",
        "unicorn of the sink",
        "zyzzyva",
        "empty bracket for fire extinguisher",
        "fire extinguisher sign",
        "missing fire extinguisher",
        "sign: toilet",
    ],
)
def test_a_label_whose_head_ends_with_no_known_name_is_of_no_kind(label: str) -> None:
    assert find_kinds(label) == ()


@pytest.mark.parametrize(
    ("label", "names"),
    [
        ("tennis table", ("table",)),
        ("table", ("dining table", "kitchen table", "table")),
        ("red table", ("dining table", "kitchen table", "table")),
        ("foam extinguisher", ("fire extinguisher", "extinguisher")),
    ],
)
def test_a_label_that_says_which_of_many_has_no_name_that_says_another(
    label: str, names: tuple[str, ...]
) -> None:
    (kind,) = (kind for kind in read_kinds() if names[-1] in kind.names)

    assert find_names(kind, label) == names


def test_a_text_names_every_kind_that_stands_in_it() -> None:
    named = {kind.names[0] for kind in find_named_kinds("A sink beside two fridges and a wall.")}
    assert named == {"sink", "fridge"}


def test_every_kind_says_what_it_is_for_and_says_nothing_twice() -> None:
    for kind in read_kinds():
        assert all(kind.names)
        assert all(kind.uses)
        assert max(Counter(kind.names + kind.uses).values()) == 1, kind.names[0]


def test_no_kind_is_listed_twice() -> None:
    firsts = Counter(kind.names[0] for kind in read_kinds())
    assert max(firsts.values()) == 1
