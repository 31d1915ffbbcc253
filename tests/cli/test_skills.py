"""`mapspeak skills`: an owner checks, lists and tries what is written in skills.yaml."""

import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from mapspeak.cli.commands import cli

WRITTEN = """skills:
- name: say
  sentence: Says something aloud
  robot_skill: speak
  arguments:
  - {name: words, sets: text, kind: text, most: 200}
- name: greet
  arguments: [{name: whom, default: all}]
  mission:
  - say: Good morning, {whom}
  - wait: "1"
"""


@pytest.fixture
def skills(tmp_path: Path) -> Path:
    path = tmp_path / "skills.yaml"
    path.write_text(WRITTEN)
    return path


def run(*arguments: str) -> Result:
    return CliRunner().invoke(cli, ["skills", *arguments])


def test_a_file_without_a_mistake_is_told_and_listed_with_what_its_skills_take(
    skills: Path,
) -> None:
    assert "2 skills, no mistake" in run("check", str(skills)).output
    listed = run("list", str(skills)).output
    assert "say: Says something aloud\n  words: a text of at most 200 letters" in listed


def test_a_mistake_is_told_with_its_line(skills: Path) -> None:
    skills.write_text(WRITTEN.replace("robot_skill", "robot_skil"))
    told = run("check", str(skills))
    assert told.exit_code != 0
    assert "line 4" in str(told.exception)


def test_a_robot_that_offers_all_of_it_runs_each_of_them(skills: Path) -> None:
    checked = run("check", str(skills), "--robot", "sim:flat_1")
    assert checked.output.splitlines()[-2:] == ["say: offered", "greet: offered"]
    told = run("try", str(skills), "greet", "whom=you", "--robot", "sim:flat_1")
    assert "S1 (greet): succeeded" in told.output
    assert told.exit_code == 0


def test_what_a_robot_does_not_offer_is_told_and_leads_to_no_tool_of_a_model(
    skills: Path,
) -> None:
    skills.write_text(WRITTEN.replace("speak", "shout"))
    checked = run("check", str(skills), "--robot", "sim:flat_1")
    assert "The robot has no skill 'shout'" in checked.output
    assert "1 of 2 skills cannot be run" in str(checked.exception)
    tried = run("try", str(skills), "greet", "--robot", "sim:flat_1")
    assert "skill_status" not in tried.output
    assert "S1 (greet): failed" in tried.output
    assert tried.exit_code == 1


def test_trying_a_skill_loads_no_memory_of_what_was_seen(skills: Path) -> None:
    end = "atexit.register(lambda: print('onnxruntime' in sys.modules))"  # after all threads
    command = ["skills", "try", str(skills), "say", "words=hello", "--robot", "sim:flat_1"]
    told = subprocess.run(  # noqa: S603 - our own program
        [
            sys.executable,
            "-c",
            f"import atexit, sys; {end}; from mapspeak.cli import cli; cli({command})",
        ],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    assert "S1 (say): succeeded" in told.stdout
    assert told.stdout.splitlines()[-1] == "False"
