"""Tools that drive several times ask a person once, and go no farther than what was agreed to."""

import math
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from mcp.client.session import ClientRequestContext
from mcp_types import ElicitRequestParams, ElicitResult

from drawing import grid_from_text
from fakes import FakeRobot
from guarding import audit_of, make_guard
from mapspeak.geometry import Pose
from mapspeak.installation import shell_command
from mapspeak.robot import GoalState
from mapspeak.safety import Approval, CommandKind, Guard, Otherwise, Policy
from served import MODES, connect, report_of, text_of

pytestmark = pytest.mark.anyio

HALL = grid_from_text(
    """
    ?????????????????????????????????????????????
    #############......##########......##########
    #...........................................#
    #...........................................?
    #...........................................?
    #...........................................#
    #############......##########......##########
    ?????????????????????????????????????????????
    """,
    resolution_m=0.25,
)
START = Pose(1.5, 1.0)
TOOLS = ("explore", "search_for", "look_around", "follow_route", "navigate_to", "stop_robot")


class Person:
    """Agrees to everything, and keeps the questions."""

    def __init__(self, *, agrees: bool = True) -> None:
        self.questions: list[str] = []
        self._agrees = agrees

    async def __call__(
        self,
        context: ClientRequestContext,  # noqa: ARG002 - named so by the protocol
        params: ElicitRequestParams,
    ) -> ElicitResult:
        self.questions.append(params.message)
        return ElicitResult(action="accept", content={"agree": self._agrees})


def careful(folder: Path, *, otherwise: Otherwise = Otherwise.REFUSE) -> Guard:
    approval = Approval(kinds=frozenset({CommandKind.DRIVE}), otherwise=otherwise)
    return make_guard(folder, Policy(approval=approval))


def allowed(folder: Path) -> list[str]:
    return [line.said for line in audit_of(folder) if line.verdict == "allowed"]


LIMITS = "The limits of its policy stay."
ASKED: dict[str, tuple[dict[str, Any], str]] = {
    "explore": (
        {"n_goals": 3, "duration_s": 300},
        f"May the robot explore, up to 3 drives within 300 s? {LIMITS}",
    ),
    "look_around": (
        {"n_pictures": 4},
        f"May the robot turn in place for 4 pictures, up to 3 drives within 25 s? {LIMITS}",
    ),
    "follow_route": (
        {"stops": ["3, 1", "5, 1", "2, 1"]},
        f"May the robot drive past 3, 1; 5, 1; 2, 1, up to 3 drives within 1800 s? {LIMITS}",
    ),
}


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("tool", ASKED)
async def test_one_word_covers_all_drives_of_a_call_and_the_log_says_which(
    tmp_path: Path, tool: str, mode: str
) -> None:
    arguments, question = ASKED[tool]
    person, robot = Person(), FakeRobot(HALL, pose=START)
    guard = careful(tmp_path)
    async with connect(
        robot, tmp_path, guard=guard, mode=mode, tools=TOOLS, on_question=person
    ) as client:
        for _ in range(3):
            result = await client.call_tool(tool, arguments)
            assert not result.is_error, text_of(result)
            if len(robot.goals) == 3:
                break
            arguments = {} if tool == "follow_route" else arguments
    assert person.questions == [question]
    assert len(robot.goals) == 3
    (said,) = Counter(allowed(tmp_path))
    assert said.startswith("by approval ")
    assert said.endswith(question.removeprefix("May the robot ").partition("?")[0])


async def test_what_goes_beyond_the_word_is_asked_for_again(tmp_path: Path) -> None:
    person, robot = Person(), FakeRobot(HALL, pose=START)
    async with connect(
        robot, tmp_path, guard=careful(tmp_path), tools=TOOLS, on_question=person
    ) as client:
        for _ in range(2):
            await client.call_tool("look_around", {"n_pictures": 3})
            assert len(person.questions) * 2 == len(robot.goals)
        await robot.sleep(3600.0)
        await client.call_tool("look_around", {"n_pictures": 3})
    assert len(person.questions) == 3
    assert len(robot.goals) == 6


async def test_a_word_for_one_thing_is_none_for_another(tmp_path: Path) -> None:
    person, robot = Person(), FakeRobot(HALL, pose=START)
    async with connect(
        robot, tmp_path, guard=careful(tmp_path), tools=TOOLS, on_question=person
    ) as client:
        await client.call_tool("explore", {"n_goals": 3, "wait_s": 1})
        await client.call_tool("navigate_to", {"x": 3.0, "y": 1.0})
        for _ in range(2):
            await client.call_tool("explore", {"n_goals": 30, "wait_s": 1})
    assert [question.split(",")[0] for question in person.questions] == [
        "May the robot explore",
        "May the robot drive to (3.00",
        "May the robot explore",
    ]


async def test_one_word_covers_a_drive_to_look_and_the_turn_at_its_end(tmp_path: Path) -> None:
    person, robot = Person(), FakeRobot(HALL, pose=START)
    async with connect(
        robot, tmp_path, guard=careful(tmp_path), toolsets=("drive",), on_question=person
    ) as client:
        sent = report_of(await client.call_tool("navigate_to", {"place": "F1", "wait_s": 0}))
        at = sent["goal"]
        robot.end_goal(GoalState.ARRIVED, pose=Pose(at["x"], at["y"], math.radians(180)))
        await client.call_tool("wait_for_goal", {})
    assert len(robot.goals) == 2
    (question,) = person.questions
    scope = "drive to F1 and turn there to look, up to 4 drives within 600 s"
    assert question == f"May the robot {scope}? {LIMITS}"


async def test_after_a_stop_a_person_is_asked_again(tmp_path: Path) -> None:
    person, robot = Person(), FakeRobot(HALL, pose=START)
    async with connect(
        robot, tmp_path, guard=careful(tmp_path), tools=TOOLS, on_question=person
    ) as client:
        await client.call_tool("explore", {"n_goals": 3, "wait_s": 1})
        await client.call_tool("stop_robot", {})
        assert len(person.questions) == 1
        for _ in range(2):
            await client.call_tool("explore", {"n_goals": 3, "wait_s": 1})
    assert len(person.questions) == 2


async def test_a_person_who_does_not_agree_keeps_the_robot_where_it_is(tmp_path: Path) -> None:
    person, robot = Person(agrees=False), FakeRobot(HALL, pose=START)
    async with connect(
        robot, tmp_path, guard=careful(tmp_path), tools=TOOLS, on_question=person
    ) as client:
        result = await client.call_tool("explore", {})
    assert result.is_error
    assert person.questions == [
        "May the robot explore, up to 50 drives within 600 s? The limits of its policy stay."
    ]
    assert not robot.goals


async def test_a_search_waits_for_an_operators_word_where_nobody_can_be_asked(
    tmp_path: Path,
) -> None:
    guard, robot = careful(tmp_path, otherwise=Otherwise.QUEUE), FakeRobot(HALL, pose=START)
    arguments = {"thing": "ladder", "max_looks": 5, "max_m": 40}
    async with connect(robot, tmp_path, guard=guard, tools=TOOLS) as client:
        await client.call_tool("search_for", arguments)
        refused = await client.call_tool("search_for", {**arguments, "seen": False})
        ((request_id, what),) = guard.approvals.room.list_waiting().items()
        guard.approvals.room.approve(request_id)
        answer = await client.call_tool("search_for", {**arguments, "seen": False})
    assert shell_command("approve") in text_of(refused)
    assert what.startswith("search for 'ladder', up to 40 m, up to 5 drives within 600 s, asked by")
    assert report_of(answer)["state"] != "refused"
    assert robot.goals
    assert all(said.startswith(f"by approval {request_id}: search") for said in allowed(tmp_path))
