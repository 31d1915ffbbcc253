import io
from collections.abc import Sequence
from pathlib import Path

import pytest
from mcp_types import Tool
from PIL import Image

from fakes import FakeRobot, two_rooms
from hearing import Hearing
from mapspeak.errors import ConfigError
from mapspeak.evaluation.agent import (
    AgentEnd,
    Assignment,
    Picture,
    ToolAnswer,
    ToolClient,
    Witness,
)
from mapspeak.evaluation.agents.catalogue import check_agent, find_agent
from mapspeak.evaluation.agents.models.chat import (
    AnsweredCalls,
    Begin,
    ModelConversation,
    Reply,
    ToolCallRequest,
    estimate_picture_tokens,
    work_with_model,
)
from mapspeak.evaluation.agents.models.mock import MockModel
from mapspeak.evaluation.trials import Limits, TrialState
from mapspeak.server.reports.representations import Representation
from served import connect

pytestmark = pytest.mark.anyio


def assignment(folder: Path, *, seed: int = 0, prompt: str = "Go there.") -> Assignment:
    return Assignment(
        prompt=prompt, system="Be quick.", limits=Limits(), seed=seed, server=(), folder=folder
    )


async def run(
    begin: Begin,
    task: Assignment,
    witness: Witness,
    representation: Representation = Representation.PICTURE_TABLE,
) -> tuple[AgentEnd, ToolClient]:
    """Lets an agent work in a building of two rooms."""
    robot = FakeRobot(two_rooms())
    async with connect(robot, task.folder, representation=representation) as client:
        tools = ToolClient(client, witness)
        return await work_with_model(begin, task, tools), tools


class Scripted:
    """A model that says what it is told to say, and remembers what it heard."""

    def __init__(self, *replies: Reply) -> None:
        self.replies = list(replies)
        self.heard: list[tuple[ToolCallRequest, ToolAnswer]] = []

    def begin(self, task: Assignment, tools: Sequence[Tool]) -> ModelConversation:
        assert (task.system, task.prompt, task.seed) == ("Be quick.", "Go there.", 0)
        assert "look_at_map" in {tool.name for tool in tools}
        return self

    async def ask(self, answers: AnsweredCalls) -> Reply:
        self.heard += answers
        return self.replies.pop(0)


LOOK = ToolCallRequest(id="1", tool="look_at_map", arguments={})


@pytest.mark.parametrize("representation", Representation)
async def test_the_mock_model_comes_to_an_end_however_the_map_is_shown(
    tmp_path: Path, representation: Representation
) -> None:
    witness = Hearing()
    agent = MockModel
    end, _ = await run(agent, assignment(tmp_path), witness, representation)
    assert (end.state, end.answer) == (TrialState.FINISHED, "ANSWER: there")
    assert witness.calls[:3] == ["look_at_map", "look_through_camera", "describe_place"]
    assert "navigate_to" in witness.calls
    assert end.n_decisions == len(witness.calls) + 1 == len(witness.words)


async def test_the_same_seed_gives_the_same_conversation(tmp_path: Path) -> None:
    async def calls_with(seed: int) -> list[tuple[str, str]]:
        task = assignment(tmp_path, seed=seed)
        ledger = Hearing()
        await run(MockModel, task, ledger)
        return [(call.tool, str(call.arguments)) for call in ledger.made]

    assert await calls_with(1) == await calls_with(1)
    assert len({tuple(await calls_with(seed)) for seed in range(4)}) > 1


async def test_tokens_are_summed_and_pictures_count_in_every_request_after_them(
    tmp_path: Path,
) -> None:
    model = Scripted(
        Reply(text="I look.", calls=(LOOK,), n_input_tokens=100, n_output_tokens=5),
        Reply(text="Again.", calls=(LOOK,), n_input_tokens=1500, n_output_tokens=5),
        Reply(text="Done.", n_input_tokens=3000, n_output_tokens=2),
    )
    witness = Hearing()
    end, _ = await run(model.begin, assignment(tmp_path), witness)
    one = estimate_picture_tokens(witness.answers[0].pictures[0])
    assert (end.n_input_tokens, end.n_output_tokens, end.n_picture_tokens) == (4600, 12, 3 * one)
    counted = [n_tokens for _, n_tokens in witness.words]
    assert counted == [0, one, 2 * one]
    assert [text for text, _ in witness.words] == ["I look.", "Again.", ""]


async def test_an_api_that_does_not_count_leaves_tokens_unknown(tmp_path: Path) -> None:
    end, _ = await run(Scripted(Reply(text="Done.")).begin, assignment(tmp_path), Hearing())
    assert (end.n_input_tokens, end.n_output_tokens) == (None, None)


async def test_errors_reach_the_model_as_errors_and_it_may_go_on(tmp_path: Path) -> None:
    wrong = ToolCallRequest(id="1", tool="describe_place", arguments={"place": "R99"})
    unknown = ToolCallRequest(id="2", tool="fly", arguments={"tool": "wings", "self": 1})
    garbled = ToolCallRequest(
        id="3", tool="measure", arguments={}, mistake="The arguments are no JSON."
    )
    model = Scripted(Reply(text="", calls=(wrong, unknown, garbled)), Reply(text="Done."))
    witness = Hearing()
    end, _ = await run(model.begin, assignment(tmp_path), witness)
    assert end.state is TrialState.FINISHED
    assert [call for call, _ in model.heard] == [wrong, unknown, garbled]
    assert [answer.is_error for _, answer in model.heard] == [True, True, True]
    assert witness.calls == ["describe_place", "fly", "measure"]


async def test_out_of_budget_it_still_says_what_it_has_cost(tmp_path: Path) -> None:
    looking = [
        Reply(text="", calls=(LOOK,), n_input_tokens=10, n_output_tokens=1) for _ in range(3)
    ]
    end, _ = await run(Scripted(*looking).begin, assignment(tmp_path), Hearing(most=2))
    assert end.state is TrialState.OUT_OF_BUDGET
    assert (end.n_decisions, end.n_input_tokens) == (3, 30)


@pytest.mark.parametrize(
    ("said", "state", "answer"),
    [
        ("", TrialState.GAVE_UP, "The model refused to answer."),
        ("I will not.", TrialState.GAVE_UP, "I will not."),
        ("The room", TrialState.OUT_OF_BUDGET, "The room"),
    ],
)
async def test_a_model_that_did_not_end_by_itself_has_not_finished(
    tmp_path: Path, said: str, state: TrialState, answer: str
) -> None:
    model = Scripted(Reply(text=said, state=state))
    end, _ = await run(model.begin, assignment(tmp_path), Hearing())
    assert (end.state, end.answer) == (state, answer)


async def test_a_call_that_came_before_the_cut_is_made(tmp_path: Path) -> None:
    cut = Reply(text="", calls=(LOOK,), state=TrialState.OUT_OF_BUDGET)
    witness = Hearing()
    agent = Scripted(cut, Reply(text="Done.")).begin
    end, _ = await run(agent, assignment(tmp_path), witness)
    assert (end.state, witness.calls) == (TrialState.FINISHED, ["look_at_map"])


def test_a_picture_is_estimated_by_its_pixels() -> None:
    file = io.BytesIO()
    Image.new("L", (1000, 751)).save(file, "PNG")
    assert estimate_picture_tokens(Picture(file.getvalue(), "image/png")) == 1002


def test_a_model_cannot_think_in_any_way_but_the_known_ones() -> None:
    assert find_agent("mock", "high").name == "mock"
    with pytest.raises(ConfigError, match="think 'hard'"):
        check_agent("mock", "hard")


def test_a_name_of_no_agent_is_told() -> None:
    with pytest.raises(ConfigError, match="no agent 'nobody'"):
        check_agent("nobody")
