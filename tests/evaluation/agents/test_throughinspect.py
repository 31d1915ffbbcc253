"""Models through inspect-ai; where the extra `eval` is not installed, only that this is said."""

import importlib.util
from pathlib import Path

import pytest

from chatserver import serve_chat
from fakes import FakeRobot, two_rooms
from hearing import Hearing
from mapspeak.errors import ConfigError
from mapspeak.evaluation.agents import Agent, AgentEnd, Assignment
from mapspeak.evaluation.agents.others import check_other, find_other
from mapspeak.evaluation.client import ToolClient
from mapspeak.evaluation.trials import Limits, TrialState
from served import connect

HAS_INSPECT = importlib.util.find_spec("inspect_ai") is not None
needs_inspect = pytest.mark.skipif(not HAS_INSPECT, reason="needs the extra eval: ./run test-eval")
# What the library itself warns of is not ours to mend.
pytestmark = [pytest.mark.anyio, pytest.mark.filterwarnings("default")]

LOCAL = "openai-api/local/scripted"


async def run(name: str, folder: Path, witness: Hearing, thinking: str | None = None) -> AgentEnd:
    agent: Agent | None = find_other(name, thinking)
    assert agent is not None
    task = Assignment(
        prompt="Go there.", system="Be quick.", limits=Limits(), seed=1, server=(), folder=folder
    )
    async with connect(FakeRobot(two_rooms()), folder) as client:
        return await agent.run(task, ToolClient(client, witness))


@pytest.mark.skipif(HAS_INSPECT, reason="needs to be without the extra eval")
def test_without_the_extra_it_is_said_what_to_install() -> None:
    with pytest.raises(ConfigError, match=r"mapspeak\[eval\]"):
        check_other("openai/any")


@needs_inspect
async def test_a_local_server_is_sent_tools_pictures_and_errors(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    witness = Hearing()
    with serve_chat() as chat:
        monkeypatch.setenv("LOCAL_BASE_URL", chat.url)
        monkeypatch.setenv("LOCAL_API_KEY", "none-needed")
        end = await run(LOCAL, tmp_path, witness)
    assert (end.state, end.answer) == (TrialState.FINISHED, "ANSWER: there")
    assert witness.calls[:3] == ["look_at_map", "look_through_camera", "describe_place"]
    assert chat.n_pictures[:4] == [0, 1, 2, 2]
    assert end.n_input_tokens == 100 * len(chat.requests)
    told = str(chat.requests[3]["messages"])
    assert "R0" in told
    assert "Be quick." in told


@needs_inspect
async def test_the_amount_of_thinking_is_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with serve_chat() as chat:
        monkeypatch.setenv("LOCAL_BASE_URL", chat.url)
        monkeypatch.setenv("LOCAL_API_KEY", "none-needed")
        await run(LOCAL, tmp_path, Hearing(), thinking="low")
        await run(LOCAL, tmp_path, Hearing())
    assert chat.requests[0]["reasoning_effort"] == "low"
    assert "reasoning_effort" not in chat.requests[-1]


@needs_inspect
async def test_the_librarys_own_mock_needs_no_server(tmp_path: Path) -> None:
    first, second = Hearing(), Hearing()
    end = await run("mockllm/model", tmp_path, first)
    await run("mockllm/model", tmp_path, second)
    assert end.state is TrialState.FINISHED
    assert first.calls == second.calls
    assert first.answers[0].pictures


@needs_inspect
def test_a_missing_key_is_told_before_the_first_trial(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    with pytest.raises(ConfigError, match="OPENAI_API_KEY"):
        check_other("openai/gpt-4o")
