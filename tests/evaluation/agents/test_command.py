import json
import os
import sys
from pathlib import Path

import anyio
import pytest

import clientprogram
from hearing import Hearing
from mapspeak.errors import ConfigError, LinkError
from mapspeak.evaluation.agent import Assignment, ToolClient
from mapspeak.evaluation.agents.catalogue import find_versions
from mapspeak.evaluation.agents.command.agent import run_program
from mapspeak.evaluation.agents.command.program import AnswerForm, Program, find_program
from mapspeak.evaluation.agents.models.chat import Thinking
from mapspeak.evaluation.trials import Limits, TrialState

pytestmark = pytest.mark.anyio

PATIENCE_S = 300.0
KEY = "not-a-real-key-123456"
CLIENT = Program(
    command=(sys.executable, clientprogram.__file__, "{config}", "{prompt}"),
    environment=("TEST_KEY", "PYTHONPATH"),
    settings={"TEST_SETTING": "kept"},
    answer=AnswerForm.JSON,
    answer_key="said.last",
    input_tokens=("usage.*.in",),
    output_tokens=("usage.*.out",),
)


def assignment(folder: Path, prompt: str, *, wall_s: float = 600.0) -> Assignment:
    """Gives a task in a world that is served over stdio."""
    server = (
        *(sys.executable, "-m", "mapspeak", "serve", "--robot", "sim:office"),
        *("--clock", "virtual", "--semantic-map", str(folder / "memory.yaml")),
        *("--audit", str(folder / "audit.jsonl"), "--control", str(folder / "control")),
        *("--call-log", str(folder / "calls.jsonl")),
    )
    return Assignment(
        prompt=prompt,
        system="",
        limits=Limits(wall_s=wall_s),
        seed=0,
        server=server,
        folder=folder,
    )


@pytest.fixture(autouse=True)
def key(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TEST_KEY", KEY)
    monkeypatch.setenv("NOT_NAMED", "another secret")


def written_in(folder: Path) -> str:
    """Gives all text that a trial has left behind."""
    return "".join(
        path.read_text("utf-8", "replace") for path in folder.rglob("*") if path.is_file()
    )


async def test_a_programs_calls_are_heard_with_their_answers_and_pictures(tmp_path: Path) -> None:
    witness = Hearing()
    end = await run_program(
        CLIENT, None, assignment(tmp_path, "look around"), ToolClient(None, witness)
    )
    assert end.state is TrialState.FINISHED
    assert end.answer == "ANSWER: kept, the key is [TEST_KEY]"
    assert (end.n_input_tokens, end.n_output_tokens) == (15, 3)
    assert witness.calls == ["look_at_map", "describe_place"]
    look, unknown = witness.answers
    assert look.pictures[0].data.startswith(b"\x89PNG")
    assert unknown.is_error
    assert KEY not in written_in(tmp_path)


async def test_a_program_that_fails_breaks_the_trial_without_telling_its_secrets(
    tmp_path: Path,
) -> None:
    with pytest.raises(LinkError, match=r"status 3: cannot log in with \[TEST_KEY\]"):
        await run_program(CLIENT, None, assignment(tmp_path, "crash"), ToolClient(None, Hearing()))
    assert KEY not in written_in(tmp_path)


async def test_a_program_that_calls_nothing_says_nothing_of_its_model(tmp_path: Path) -> None:
    with pytest.raises(LinkError, match="called no tool"):
        await run_program(
            CLIENT, None, assignment(tmp_path, "do nothing"), ToolClient(None, Hearing())
        )


async def test_a_program_that_calls_too_much_is_ended_with_its_server(tmp_path: Path) -> None:
    end = await run_program(
        CLIENT, None, assignment(tmp_path, "look and wait"), ToolClient(None, Hearing(most=1))
    )
    assert end.state is TrialState.OUT_OF_BUDGET
    assert "More than 1 calls" in end.answer
    await until_gone(str(tmp_path))


async def test_a_program_whose_time_is_up_is_ended(tmp_path: Path) -> None:
    end = await run_program(
        CLIENT, None, assignment(tmp_path, "wait", wall_s=10.5), ToolClient(None, Hearing())
    )
    assert end.state is TrialState.OUT_OF_BUDGET
    await until_gone(str(tmp_path))


async def until_gone(word: str) -> None:
    """Waits until no process names something; one that was killed may still be ending."""
    with anyio.fail_after(PATIENCE_S):
        while processes_with(word):  # noqa: ASYNC110 - the system tells nobody
            await anyio.sleep(0.05)


def processes_with(word: str) -> list[str]:
    """Gives the command lines of all processes that name something, where the system tells."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            line = path.read_bytes().replace(b"\0", b" ").decode("utf-8", "replace")
        except OSError:
            continue
        if word in line and path.parent.name != str(os.getpid()):
            found.append(line)
    return found


def test_the_known_programs_are_told_of_the_server_and_the_prompt(tmp_path: Path) -> None:
    server, prompt = ("serve", "--seed", "1"), "Go {answer} there."
    for name in ("claude-code", "codex", "gemini"):
        program = find_program(name)
        command = program.command_line(prompt=prompt, server=server, folder=tmp_path, thinking=None)
        program.write_config(server, tmp_path)
        assert prompt in command
        entry = json.loads((tmp_path / program.config).read_text())["mcpServers"]["robot"]
        assert (entry["command"], entry["args"]) == ("serve", ["--seed", "1"])
        if name == "codex":
            assert 'mcp_servers.robot.args=["--seed", "1"]' in command


def test_how_much_to_think_is_said_only_when_asked(tmp_path: Path) -> None:
    plain, asked = (
        find_program("codex").command_line(
            prompt="Go.", server=("serve",), folder=tmp_path, thinking=thinking
        )
        for thinking in (None, Thinking.LOW)
    )
    assert "effort" not in " ".join(plain)
    assert 'model_reasoning_effort="low"' in asked
    with pytest.raises(ConfigError, match="how much to think"):
        CLIENT.check(Thinking.LOW)


def test_the_version_of_a_program_is_the_first_line_it_says() -> None:
    said = CLIENT.find_version()
    assert said is not None
    assert said.startswith("Python 3.")
    assert CLIENT.model_copy(update={"version": ()}).find_version() is None
    assert Program(command=("no-such-program",)).find_version() is None


def test_a_version_is_short_however_much_a_program_says() -> None:
    chatty = CLIENT.model_copy(update={"version": ("-c", "print('a' * 5000); print('b')")})
    assert chatty.find_version() == "a" * 80


def test_what_stands_behind_an_agent_is_named_with_its_version(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(f'command: ["{sys.executable}", "{{prompt}}"]\n')
    versions = find_versions(["scripted", f"command:{file}"])
    assert list(versions) == [f"command:{file}"]


def test_a_program_is_read_from_a_file(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text('command: [mine, "{prompt}"]\nenvironment: [MY_KEY]\n')
    assert find_program(str(file)).environment == ("MY_KEY",)
    with pytest.raises(ConfigError, match="no program 'mine'"):
        find_program(str(file)).check(None)
    with pytest.raises(ConfigError, match="no client program 'hers'"):
        find_program("hers")


async def test_gemini_is_told_to_trust_the_folder_or_it_would_start_no_server() -> None:
    gemini = find_program("gemini")
    assert gemini.settings == {"GEMINI_CLI_TRUST_WORKSPACE": "true"}
    assert "GOOGLE_GEMINI_BASE_URL" in gemini.environment
