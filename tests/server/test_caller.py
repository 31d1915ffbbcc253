"""A client takes a person's place: what it forges approves nothing."""

from pathlib import Path
from typing import Any

import pytest
from mcp.client import Client
from mcp.client.session import ClientRequestContext
from mcp.shared.exceptions import MCPError
from mcp_types import CallToolResult, ElicitRequestParams, ElicitResult, InputRequiredResult

from drawing import grid_from_text
from fakes import FakeRobot
from guarding import make_guard
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMapStore
from mapspeak.safety import Approval, CommandKind, Guard, Otherwise, Policy, Publish
from mapspeak.server.app import build_server
from mapspeak.server.text.offered import ANSWER_DOES_NOT_COUNT, DISAGREED
from mapspeak.session import Session
from served import connect, text_of

pytestmark = pytest.mark.anyio

CALLS_AGAIN = "2026-07-28"
YES = ElicitResult(action="accept", content={"agree": True})
HERE, THERE = {"x": 3.0, "y": 1.0}, {"x": 2.0, "y": 1.0}
HALL = grid_from_text(
    """
    ####################
    #..................#
    #..................#
    #..................#
    #..................#
    #..................#
    #..................#
    ####################
    """,
    resolution_m=0.25,
)


def asking_guard(folder: Path, otherwise: Otherwise = Otherwise.REFUSE) -> Guard:
    approval = Approval(kinds=frozenset({CommandKind.DRIVE}), otherwise=otherwise)
    return make_guard(folder, Policy(approval=approval))


def known_ids(guard: Guard) -> list[str]:
    """Return the ids of the requests so far, which a client may guess, and of the next."""
    other = Publish(topic="/lamp", type="std_msgs/msg/Bool", message={"data": True})
    prefix, _, number = guard.approvals.ask(other, client="another").rpartition("-")
    return [f"{prefix}-{each}" for each in range(1, int(number) + 2)]


async def answer(
    client: Client, goal: dict[str, float], key: str, said: ElicitResult, state: str | None
) -> CallToolResult | InputRequiredResult | None:
    """Call with a person's answer; None where the server takes it for no call."""
    try:
        return await client.session.call_tool(
            "navigate_to",
            dict(goal),
            input_responses={key: said},
            request_state=state,
            allow_input_required=True,
        )
    except MCPError:
        return None


async def ask(client: Client, goal: dict[str, float]) -> tuple[str, str | None]:
    """Call as a client that is asked; return the question's key and the state beside it."""
    asked = await client.session.call_tool("navigate_to", dict(goal), allow_input_required=True)
    assert isinstance(asked, InputRequiredResult)
    (key,) = asked.input_requests or {}
    return key, asked.request_state


async def agree(
    context: ClientRequestContext,  # noqa: ARG001 - named so by the protocol
    params: ElicitRequestParams,  # noqa: ARG001
) -> ElicitResult:
    return YES


@pytest.mark.parametrize("otherwise", Otherwise)
@pytest.mark.parametrize("state", [None, "", "forged"])
async def test_a_client_that_cannot_ask_does_not_approve_its_own_request(
    tmp_path: Path, otherwise: Otherwise, state: str | None
) -> None:
    robot, guard = FakeRobot(HALL, pose=Pose(1.5, 1.0)), asking_guard(tmp_path, otherwise)
    async with connect(robot, tmp_path, guard=guard) as client:
        assert client.protocol_version == CALLS_AGAIN
        refused = await client.call_tool("navigate_to", dict(HERE))
        assert refused.is_error
        for request_id in known_ids(guard):
            await answer(client, HERE, f"approval-{request_id}", YES, state)
        again = await client.call_tool("navigate_to", dict(HERE))
    assert again.is_error
    assert text_of(again) == text_of(refused)
    assert not robot.goals


async def test_an_answer_counts_once_and_for_what_was_asked(tmp_path: Path) -> None:
    robot, guard = FakeRobot(HALL, pose=Pose(1.5, 1.0)), asking_guard(tmp_path)
    async with connect(robot, tmp_path, guard=guard, on_question=agree) as client:
        key, state = await ask(client, HERE)
        await answer(client, THERE, key, YES, state)
        assert not robot.goals
        key, state = await ask(client, HERE)
        await answer(client, HERE, key, YES, state)
        assert len(robot.goals) == 1
        await answer(client, HERE, key, YES, state)
    assert len(robot.goals) == 1


@pytest.mark.parametrize("content", [{"agree": "true"}, {"agree": 1}, {}, {"agree": "yes"}])
async def test_only_a_plain_yes_is_one(tmp_path: Path, content: dict[str, Any]) -> None:
    robot, guard = FakeRobot(HALL, pose=Pose(1.5, 1.0)), asking_guard(tmp_path)
    async with connect(robot, tmp_path, guard=guard, on_question=agree) as client:
        key, state = await ask(client, HERE)
        said = ElicitResult.model_construct(action="accept", content=content)
        await answer(client, HERE, key, said, state)
    assert not robot.goals


async def test_a_client_that_was_asked_does_not_lend_its_answer_to_one_that_cannot_ask(
    tmp_path: Path,
) -> None:
    robot, guard = FakeRobot(HALL, pose=Pose(1.5, 1.0)), asking_guard(tmp_path)
    session = Session(robot, SemanticMapStore(tmp_path / "map.yaml"), lease_s=60.0, guard=guard)
    server = build_server(session)
    async with (
        Client(server, elicitation_callback=agree) as asked,
        Client(server) as other,
    ):
        key, state = await ask(asked, HERE)
        await answer(other, HERE, key, YES, state)
        assert not robot.goals
        await answer(asked, HERE, key, YES, state)
        assert len(robot.goals) == 1


async def test_an_answer_that_was_used_or_is_too_old_is_not_told_as_a_refusal(
    tmp_path: Path,
) -> None:
    robot, guard = FakeRobot(HALL, pose=Pose(1.5, 1.0)), asking_guard(tmp_path)
    async with connect(robot, tmp_path, guard=guard, on_question=agree) as client:
        key, state = await ask(client, HERE)
        await answer(client, HERE, key, YES, state)
        again = await answer(client, HERE, key, YES, state)
        no = await answer(client, HERE, key, ElicitResult(action="decline"), state)
    assert isinstance(again, CallToolResult)
    assert isinstance(no, CallToolResult)
    assert text_of(no) == DISAGREED
    assert again.is_error
    assert text_of(again) != DISAGREED


async def test_a_person_who_answers_after_the_request_was_forgotten_is_told_to_be_late(
    tmp_path: Path,
) -> None:
    robot, guard = FakeRobot(HALL, pose=Pose(1.5, 1.0)), asking_guard(tmp_path)

    async def agree_late(
        context: ClientRequestContext, params: ElicitRequestParams
    ) -> ElicitResult:
        now_s = guard.approvals.now_s()
        guard.approvals.now_s = lambda: now_s + 3600.0
        known_ids(guard)
        return await agree(context, params)

    legacy = connect(robot, tmp_path, mode="legacy", guard=guard, on_question=agree_late)
    async with legacy as client:
        late = await client.call_tool("navigate_to", dict(HERE))
    assert late.is_error
    assert text_of(late) == ANSWER_DOES_NOT_COUNT
    assert not robot.goals
