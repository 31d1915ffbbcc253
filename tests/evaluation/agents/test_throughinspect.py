"""Models through inspect-ai: one suite over the protocols of three providers, without a network.

Where the extra `eval` is not installed, only that this is said.
"""

import importlib.util
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from fakes import FakeRobot, two_rooms
from hearing import Hearing
from mapspeak.errors import ConfigError, LinkError
from mapspeak.evaluation.agent import AgentEnd, Assignment, ToolClient
from mapspeak.evaluation.agents.catalogue import check_agent, find_agent, find_versions
from mapspeak.evaluation.trials import Limits, TrialState
from modelserver import N_READ, N_WRITTEN, ModelServer, Speech, Trouble, serve_model
from modelspeech import SPEECHES, AnthropicMessages, GoogleContents, OpenAIChat
from served import connect

HAS_INSPECT = importlib.util.find_spec("inspect_ai") is not None
needs_inspect = pytest.mark.skipif(not HAS_INSPECT, reason="needs the extra eval: ./run test-eval")
# What the library itself warns of is not ours to mend.
pytestmark = [pytest.mark.anyio, pytest.mark.filterwarnings("default")]

FIRST_CALLS = ["look_at_map", "look_through_camera", "describe_place"]


@pytest.fixture(params=SPEECHES, ids=lambda speech: type(speech).__name__)
def speech(request: pytest.FixtureRequest) -> Speech:
    """A provider's protocol."""
    found: Speech = request.param
    return found


@contextmanager
def server_of(
    speech: Speech, monkeypatch: pytest.MonkeyPatch, *troubles: Trouble
) -> Iterator[ModelServer]:
    """Gives a server in a provider's place, and leads the library to it."""
    with serve_model(speech, *troubles) as server:
        for name, value in speech.settings(server.url).items():
            monkeypatch.setenv(name, value)
        yield server


async def run(
    name: str,
    folder: Path,
    witness: Hearing,
    *,
    thinking: str | None = None,
    wall_s: float = Limits().wall_s,
) -> AgentEnd:
    """Lets a model work in a building of two rooms; errors come as they are, in no group."""
    agent = find_agent(name, thinking)
    limits = Limits(wall_s=wall_s)
    task = Assignment(
        prompt="Go there.", system="Be quick.", limits=limits, seed=1, server=(), folder=folder
    )
    problem: LinkError | None = None
    async with connect(FakeRobot(two_rooms()), folder) as client:
        try:
            return await agent.work(task, ToolClient(client, witness))
        except LinkError as error:
            problem = error
    raise problem


@pytest.mark.skipif(HAS_INSPECT, reason="needs to be without the extra eval")
def test_without_the_extra_it_is_said_what_to_install() -> None:
    with pytest.raises(ConfigError, match=r"pip install .*inspect-ai\S+ 'openai"):
        check_agent("openai/any")
    with pytest.raises(ConfigError, match=r"inspect-ai\S+ 'openai\S+ google-genai,"):
        check_agent("google/any")


@needs_inspect
async def test_a_model_works_to_the_end_with_tools_pictures_and_errors(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, speech: Speech
) -> None:
    witness = Hearing()
    with server_of(speech, monkeypatch) as server:
        end = await run(speech.model, tmp_path, witness)
    assert server.faults == [], "a strict provider would have refused it"
    assert (end.state, end.answer) == (TrialState.FINISHED, "ANSWER: there")
    assert witness.calls[:4] == [*FIRST_CALLS, "navigate_to"]
    first, *_, last = server.heard
    assert (first.system, first.prompt) == ("Be quick.", "Go there.")
    assert set(witness.calls) <= set(first.tools)
    assert [heard.n_pictures for heard in server.heard][:3] == [0, 2, 2]
    assert last.errors[:4] in [(False, False, True, False), (None,) * 4]
    assert "There is no place called 'R0'" in last.answers[2]


@needs_inspect
async def test_all_that_was_read_and_written_is_counted_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, speech: Speech
) -> None:
    with server_of(speech, monkeypatch) as server:
        end = await run(speech.model, tmp_path, Hearing())
    n_turns = len(server.heard)
    assert end.n_decisions == n_turns
    assert (end.n_input_tokens, end.n_output_tokens) == (N_READ * n_turns, N_WRITTEN * n_turns)


@needs_inspect
@pytest.mark.parametrize(
    ("speech", "asked"),
    [
        (OpenAIChat(), "low"),
        (AnthropicMessages(), {"type": "enabled", "budget_tokens": 4096, "display": "summarized"}),
        (GoogleContents(), {"includeThoughts": True, "thinkingBudget": 4096}),
    ],
    ids=lambda value: type(value).__name__,
)
async def test_the_amount_of_thinking_is_asked_for_as_each_provider_has_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, speech: Speech, asked: object
) -> None:
    with server_of(speech, monkeypatch) as server:
        await run(speech.model, tmp_path, Hearing(), thinking="low")
        n_turns = len(server.heard)
        await run(speech.model, tmp_path, Hearing())
    assert server.faults == [], "thoughts are to come back with their signature"
    assert {str(heard.thinking) for heard in server.heard[:n_turns]} == {str(asked)}
    assert str(server.heard[-1].thinking) != str(asked)


@needs_inspect
@pytest.mark.parametrize("trouble", [Trouble.BUSY, Trouble.BROKEN])
async def test_trouble_that_passes_costs_nothing_but_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, speech: Speech, trouble: Trouble
) -> None:
    witness = Hearing()
    with server_of(speech, monkeypatch, trouble) as server:
        end = await run(speech.model, tmp_path, witness)
    assert end.state is TrialState.FINISHED
    assert witness.calls[:3] == FIRST_CALLS
    assert server.n_asked == len(server.heard) + 1
    assert end.n_input_tokens == N_READ * len(server.heard)


@needs_inspect
async def test_a_model_that_refuses_has_given_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, speech: Speech
) -> None:
    with server_of(speech, monkeypatch, Trouble.REFUSED):
        end = await run(speech.model, tmp_path, Hearing())
    assert end.state is TrialState.GAVE_UP
    assert end.answer in {"I would rather not.", "The model refused to answer."}


@needs_inspect
async def test_a_model_that_was_cut_off_is_out_of_budget(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, speech: Speech
) -> None:
    with server_of(speech, monkeypatch, Trouble.CUT_OFF):
        end = await run(speech.model, tmp_path, Hearing())
    assert (end.state, end.answer) == (TrialState.OUT_OF_BUDGET, "I was about to")


@needs_inspect
async def test_a_wrong_key_is_told_in_the_providers_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, speech: Speech
) -> None:
    with server_of(speech, monkeypatch, Trouble.DENIED) as server:
        with pytest.raises(LinkError, match=r"cannot be asked: .*trouble 401"):
            await run(speech.model, tmp_path, Hearing())
        assert server.n_asked == 1, "it would be wrong another time too"


@needs_inspect
async def test_a_server_that_never_answers_says_nothing_of_the_model(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, speech: Speech
) -> None:
    with (
        server_of(speech, monkeypatch, Trouble.SILENT),
        pytest.raises(LinkError, match="has not answered once"),
    ):
        await run(speech.model, tmp_path, Hearing(), wall_s=2.0)


@needs_inspect
async def test_too_many_calls_end_a_model_that_says_what_it_has_cost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, speech: Speech
) -> None:
    witness = Hearing(most=2)
    with server_of(speech, monkeypatch):
        end = await run(speech.model, tmp_path, witness)
    assert end.state is TrialState.OUT_OF_BUDGET
    assert witness.calls == FIRST_CALLS[:2]
    assert end.n_input_tokens == 2 * N_READ


@needs_inspect
def test_the_versions_behind_a_model_are_known(speech: Speech) -> None:
    client = {"anthropic": "anthropic", "google": "google-genai"}
    wanted = client.get(speech.model.partition("/")[0], "openai")
    assert list(find_versions([speech.model])) == ["inspect-ai", wanted]


@needs_inspect
def test_a_missing_key_is_told_before_the_first_trial(
    monkeypatch: pytest.MonkeyPatch, speech: Speech
) -> None:
    for name in speech.settings("http://127.0.0.1:1"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.delenv("GEMINI_API_KEY", raising=False)
    monkeypatch.delenv("ANTHROPIC_AUTH_TOKEN", raising=False)
    with pytest.raises(ConfigError, match=rf"cannot be asked: .*{speech.key}"):
        check_agent(speech.model)
