"""skills.yaml: an owner's words become skills, and mistakes are named with their line."""

import re
from pathlib import Path

import pytest

from mapspeak.errors import ConfigError
from mapspeak.skill import SkillEffect, SkillOutcome, SkillState
from mapspeak.skills.skillsfile import (
    READY_MADE,
    Called,
    OwnersEntry,
    add_correction,
    load_skills,
    write_skills,
)
from skillmaking import FakeSkill, spec, tell_nobody

FULL = """
skills:
- name: open_gripper
  sentence: Opens the gripper
  service: /gripper/set
  fixed: {command: open}
  arguments:
  - {name: width, sets: position, unit: m, least: 0, most: 0.085, default: 0.08, about: how far}
  - {name: side, choices: [left, right]}
  - {name: quietly, default: false}
  succeeded_when: {field: stalled, is: false}
  timeout_s: 10
  needs: {battery_above: 0.2, standing: true, in_room: R3}
  effect: changes
  approval: always
"""


def load(folder: Path, text: str) -> tuple[OwnersEntry, ...]:
    path = folder / "skills.yaml"
    path.write_text(text)
    return load_skills(path)


def test_an_entry_says_all_that_is_known_of_a_skill(tmp_path: Path) -> None:
    (entry,) = load(tmp_path, FULL)
    known = entry.spec
    assert (entry.calls, entry.target, entry.fixed) == (
        Called.SERVICE,
        "/gripper/set",
        {"command": "open"},
    )
    width, side, quietly = (known.parameters[each] for each in ("width", "side", "quietly"))
    assert (width["type"], width["minimum"], width["maximum"], width["default"]) == (
        "number",
        0,
        0.085,
        0.08,
    )
    assert (side["type"], side["enum"], side["required"]) == ("string", ["left", "right"], True)
    assert quietly["type"] == "boolean"
    assert known.needs == {"battery_above": 0.2, "standing": True, "in_room": "R3"}
    assert (known.timeout_s, known.effect, known.is_always_asked) == (
        10.0,
        SkillEffect.CHANGES,
        True,
    )


def test_numbers_that_are_written_as_texts_are_numbers_in_conditions(tmp_path: Path) -> None:
    written = FULL.replace("0.2,", "'0.2',").replace("is: false", "above: '3'")
    (entry,) = load(tmp_path, written)
    assert entry.spec.needs["battery_above"] == 0.2
    assert entry.succeeded_when["above"] == 3.0


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("service:", "servise:", "line 5: 'skills.0.servise' is not a key of skills.yaml"),
        ("  service: /gripper/set\n", "", "needs one of: service, action"),
        ("  fixed:", "  action: /x\n  fixed:", "needs one of: service, action"),
        ("timeout_s: 10", "timeout_s: soon", "line 12: 'skills.0.timeout_s' cannot be 'soon'"),
        ("default: 0.08,", "default: 0.8,", "default cannot be 0.8"),
        ("least: 0,", "least: 1,", "has least above most"),
        ("name: open_gripper", "name: Open it", "not of the form"),
        ("is: false", "was: false", "it takes no 'was'"),
        ("{field: stalled, is: false}", "{field: stalled}", "needs one of: is, above, below"),
        ("battery_above: 0.2", "battery_above: 20", "battery_above cannot be 20"),
        ("effect: changes", "effect: explodes", "'explodes'"),
        ("name: side", "name: width", "two arguments of one name"),
        ("skills:\n", "skills:\n- {name: open_gripper, read: /x}\n", "two skills are called"),
        ("sentence:", "\tsentence:", "is no YAML"),
    ],
)
def test_a_mistake_is_named_with_its_line_and_reason(
    tmp_path: Path, old: str, new: str, fault: str
) -> None:
    assert old in FULL
    with pytest.raises(ConfigError) as error:
        load(tmp_path, FULL.replace(old, new, 1))
    assert fault in str(error.value)


def test_a_mistake_in_the_tree_of_a_mission_is_named_with_its_line_in_the_file(
    tmp_path: Path,
) -> None:
    with pytest.raises(ConfigError, match="skill rounds: Line 5: retry: retry cannot be 'often'"):
        load(
            tmp_path,
            "skills:\n- name: rounds\n  mission:\n  - drive: R1\n  - retry: often\n    do: look\n",
        )


@pytest.mark.parametrize("name", READY_MADE)
def test_what_ships_loads_and_wants_a_persons_word_for_the_pose(name: str) -> None:
    entries = {each.spec.name: each for each in load_skills(Path(name))}
    assert entries["set_initial_pose"].spec.is_always_asked
    assert all(each.spec.description for each in entries.values())


HOWTO = Path(__file__).parents[2] / "docs" / "howto" / "skills.md"


@pytest.mark.parametrize("written", re.findall(r"```yaml\n(.*?)```", HOWTO.read_text(), re.DOTALL))
def test_what_the_howto_shows_is_right(tmp_path: Path, written: str) -> None:
    assert load(tmp_path, written)


@pytest.mark.anyio
async def test_fixed_and_free_arguments_reach_what_is_called_and_its_result_is_judged(
    tmp_path: Path,
) -> None:
    (entry,) = load(tmp_path, FULL)
    called = FakeSkill(spec("set"), outputs={"stalled": False})

    async def open_called() -> FakeSkill:
        return called

    def find(name: str) -> FakeSkill:
        raise AssertionError(name)

    async def run() -> SkillOutcome:
        return await entry.run(open_called, find, {"width": 0.01}, tell_nobody)

    assert (await run()).state is SkillState.SUCCEEDED
    assert called.given == [{"command": "open", "position": 0.01}]
    called.outputs = {"stalled": True}
    assert (await run()).state is SkillState.FAILED
    called.outputs = {}
    assert (await run()).state is SkillState.FAILED, "what is not told does not hold"


def test_a_mission_is_written_anew_as_a_whole(tmp_path: Path) -> None:
    path, before = tmp_path / "round.yaml", tmp_path / "before"
    write_skills(path, {"skills": [{"name": "round", "mission": [{"wait": 1}]}]})
    before.hardlink_to(path)
    add_correction(path, "round", "knock first")
    assert "knock first" in path.read_text()
    assert "knock first" not in before.read_text()
    assert sorted(tmp_path.iterdir()) == [before, path]
