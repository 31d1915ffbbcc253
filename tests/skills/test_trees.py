"""Trees as models and people write them: read, checked, bounded, shown."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from mapspeak.errors import SkillError
from mapspeak.server.text.skills import draw_mission, say_mission
from mapspeak.skill import JsonValue, Schema, Skill, SkillEffect, parameter
from mapspeak.skills.guarding import SkillGate
from mapspeak.skills.missions import MissionBounds, MissionDesk, MissionRecord
from mapspeak.skills.steps import Mission, Step, StepKind, fill_in, parse_tree, read_tree
from skillmaking import FakeFacts, FakeSkill, spec


def read(text: str) -> Step:
    return read_tree(parse_tree(text))


def text(*names: str, is_required: bool = True) -> dict[str, Schema]:
    return dict.fromkeys(names, parameter("string", required=is_required))


LEVEL = parameter("number", minimum=0, maximum=3, default=1)
SKILLS: dict[str, Skill] = {
    "drive": FakeSkill(spec("drive", parameters=text("place"))),
    "speak": FakeSkill(
        spec("speak", effect=SkillEffect.CHANGES, parameters={**text("words"), "level": LEVEL})
    ),
    "dock": FakeSkill(spec("dock", is_always_asked=True)),
    "check": FakeSkill(
        spec("check", effect=SkillEffect.READS, parameters=text("sees", is_required=False))
    ),
}


def mission(tree: str, *parameters: str, name: str = "mission") -> Mission:
    given = spec(name, parameters=text(*parameters), timeout_s=600.0)
    return Mission(given, FakeSkill(given).run, read(tree))


def check(tree: str, *parameters: str, more: dict[str, Skill] | None = None) -> MissionBounds:
    known = SKILLS | (more or {})

    def find(name: str) -> Skill:
        if name not in known:
            raise SkillError(f"There is no skill {name!r}.", hint="Did you mean another?")
        return known[name]

    return desk(find).check(mission(tree, *parameters))


def desk(find: Callable[[str], Skill]) -> MissionDesk:
    gate = SkillGate(FakeFacts(), None)
    return MissionDesk(find, gate, MissionRecord(Path("unused"), wall_clock=lambda: None))


def test_a_list_is_a_sequence_and_a_word_a_skill_that_is_given_nothing() -> None:
    tree = read("- drive: R3\n- dock\n- speak: hello\n  level: 2\n  as: said\n")
    assert tree.kind is StepKind.SEQUENCE
    drive, dock, speak = tree.steps
    assert (drive.skill, drive.main) == ("drive", "R3")
    assert (dock.skill, dock.main, dock.arguments) == ("dock", None, {})
    assert (speak.main, speak.arguments, speak.output) == ("hello", {"level": 2}, "said")


def test_the_name_of_a_result_may_stand_before_its_step() -> None:
    tree = read('{"as": "said", "speak": "hello", "level": 2}')
    assert (tree.skill, tree.main, tree.arguments, tree.output) == (
        "speak",
        "hello",
        {"level": 2},
        "said",
    )


def test_json_is_read_as_well() -> None:
    written = json.dumps({"retry": 3, "do": {"drive": {"place": "R3"}}})
    tree = read(written)
    assert (tree.kind, tree.times, tree.steps[0].arguments) == (
        StepKind.RETRY,
        3,
        {"place": "R3"},
    )


@pytest.mark.parametrize(
    ("written", "fault"),
    [
        ("&a\nsequence: [*a]", "holds itself"),
        ("&a\n- drive: R1\n- sequence: *a", "holds itself"),
        ("- " * 40 + "dock", "deep"),
        ("sequence: [" + "dock, " * 400 + "dock]", "more than 300 steps"),
        ("x" * 40_000, "40,000 characters"),
        ("- drive: [", "no YAML"),
        ("- drive: R1\n- 5\n", "5 is no step"),
        ("- sequence: []", "Line 1: sequence: sequence cannot be []. Give a list of at least 1."),
        ("- drive: R1\n- retry: many\n  do: dock\n", "Line 2: retry: retry cannot be 'many'"),
        ("- repeat: 100000\n  do: dock\n", "to 1000"),
        ("- timeout_s: 5\n", "timeout_s needs do"),
        ("- fallback: [dock]\n  do: dock\n", "fallback takes no 'do'"),
        ("- {}", "an empty step is no step"),
        ("- drop table: x", "is no name of a skill"),
    ],
)
def test_what_is_no_tree_is_refused_with_its_place(written: str, fault: str) -> None:
    with pytest.raises(SkillError) as error:
        read(written)
    assert fault in str(error.value)


def test_aliases_that_multiply_are_counted_as_often_as_they_are_done() -> None:
    bomb = "sequence:\n- &a [dock, dock, dock, dock, dock, dock, dock]\n"
    bomb += "- &b [*a, *a, *a, *a, *a, *a, *a]\n- [*b, *b, *b, *b, *b, *b, *b]\n"
    with pytest.raises(SkillError, match="more than 300"):
        read(bomb)


@pytest.mark.parametrize(
    ("written", "fault"),
    [
        ("- dirve: R1", "Step 2: There is no skill 'dirve'. Did you mean another?"),
        ("- drive: '{door.room}'", "Step 2 (drive) uses {door}, which no step before gives"),
        ("- speak: '{b}'\n- check: {}\n  as: b", "uses {b}"),
        ("- speak: hello\n  volume: 3", "takes no 'volume'"),
        ("- speak: hello\n  level: 9", "level cannot be 9"),
        ("- speak", "needs words"),
        ("- drive: R1\n  to: '{x}'", "uses {x}"),
        ("- dock: now", "takes nothing"),
        ("- drive: R1\n  place: R2", "is given place twice"),
        ("parallel:\n- drive: R1\n- drive: R2", "two places at once"),
        ("repeat: 600\ndo:\n- repeat: 2\n  do: {drive: R1}", "could drive 1,200 times"),
    ],
)
def test_what_cannot_be_done_is_refused_before_anything_moves(written: str, fault: str) -> None:
    with pytest.raises(SkillError) as error:
        check(written)
    assert fault in str(error.value)


def test_missions_that_hold_each_other_are_refused() -> None:
    one = mission("- other", name="one")
    other = mission("- drive: R1\n- one", name="other")
    with pytest.raises(SkillError, match="mission -> one -> other -> one"):
        check("- one", more={"one": one, "other": other})


def test_the_bounds_of_a_mission_are_its_worst_case() -> None:
    tree = """
- repeat: 3
  do:
  - fallback: [{drive: R1}, {drive: R2}]
  - speak: here
- every_min: 10
  times: 4
  do: {drive: R3}
- dock
"""
    bounds = check(tree)
    assert (bounds.n_drives, bounds.n_commands, bounds.asked) == (3 * 2 + 4, 3 + 1, {"dock"})


def test_a_mission_within_a_mission_counts_as_often_as_it_is_run() -> None:
    inner = mission("- drive: '{room}'\n- speak: hello", "room", name="inner")
    bounds = check("repeat: 5\ndo:\n- inner: R1", more={"inner": inner})
    assert (bounds.n_drives, bounds.n_commands) == (5, 5)


def test_missions_of_many_missions_are_checked_once_each() -> None:
    n_found = 0

    def find(name: str) -> Skill:
        nonlocal n_found
        n_found += 1
        return many[name] if name in many else SKILLS[name]

    many = {
        f"level{n}": mission(f"[{', '.join([inner] * 40)}]", name=f"level{n}")
        for n, inner in enumerate(("check", "level0", "level1", "level2"))
    }
    assert desk(find).check(many["level3"]).n_drives == 0
    assert n_found == 4 * 40


@pytest.mark.parametrize(
    ("wanted", "filled"),
    [
        ("{door}", "open"),
        ("{door.width}", 0.9),
        ("{n}", 3),
        ("door {door.answer}, {n} of {door.width}", "door open, 3 of 0.9"),
        ("{door.share} of it", "0.999174 of it"),
        ("{door.share}", 0.999174189814778),
        (["{n}", {"a": "{door}"}], [3, {"a": "open"}]),
        ("{ not a name }", "{ not a name }"),
    ],
)
def test_results_are_filled_in_by_name(wanted: JsonValue, filled: JsonValue) -> None:
    values = {"door": {"answer": "open", "width": 0.9, "share": 0.999174189814778}, "n": 3}
    assert fill_in(wanted, values) == filled


def test_a_result_without_the_field_is_told_with_those_that_it_has() -> None:
    with pytest.raises(SkillError, match=r"There is no \{door.wide\}\. door has: width"):
        fill_in("{door.wide}", {"door": {"width": 0.9}})


def test_a_mission_is_shown_as_a_tree_in_text_and_as_json() -> None:
    shown = mission(
        "- drive: '{room}'\n- fallback:\n  - check: {sees: cat}\n    as: cat\n  - dock\n", "room"
    )
    bounds = MissionBounds(lambda name: FakeSkill(spec(name)), 1, 2, {"dock"})
    said = say_mission(shown, bounds)
    assert said.splitlines() == [
        "Mission mission.",
        "It takes room, a text.",
        "At most 1 drive and 2 other commands within 10 min. A person is asked for dock.",
        "1 one after the other",
        '|- 2 drive "{room}"',
        "`- 3 the first that succeeds of",
        '   |- 4 check sees="cat" -> cat',
        "   `- 5 dock",
    ]
    drawn = draw_mission(shown)
    assert drawn["tree"]["steps"][1]["steps"][1] == {
        "number": 5,
        "kind": "leaf",
        "said": "dock",
        "steps": [],
    }
