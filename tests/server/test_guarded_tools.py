"""Every tool that moves the robot is held to every rule, whoever wrote the tool."""

import random
from collections.abc import Callable
from dataclasses import replace
from datetime import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from mcp.client.session import ClientRequestContext
from mcp_types import ElicitRequestParams, ElicitResult

from drawing import grid_from_text
from fakes import FakeRobot
from guarding import audit_of, make_guard, rectangle
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMapStore
from mapspeak.safety import (
    Approval,
    AreaRule,
    CommandKind,
    Guard,
    GuardedRobot,
    Hours,
    Otherwise,
    Policy,
    Publish,
    load_policy,
)
from mapspeak.server.app import name_client
from mapspeak.server.tools.toolset import Tool, ToolEffect
from mapspeak.server.toolsets import build_toolsets
from mapspeak.session import Session
from served import MODES, connect, pictures_of, report_of, text_of

pytestmark = pytest.mark.anyio

HALL = grid_from_text(
    """
    #############################################
    #....................#......................?
    #....................#......................?
    #...........................................?
    #...........................................?
    #....................#......................?
    #....................#......................?
    #############################################
    """,
    resolution_m=0.25,
)
START = Pose(1.5, 1.0)
EVERYWHERE = rectangle("everywhere", (-50.0, -50.0), (50.0, 50.0))
MOVING_CALLS: dict[str, list[dict[str, Any]]] = {
    "navigate_to": [{"x": 3.0, "y": 1.0}],
    "turn": [{"by_deg": 90}],
    "look_at": [{"place": "3.0, 1.0"}],
    "search_for": [{"thing": "extinguisher"}, {"thing": "extinguisher", "seen": False}],
    "follow_route": [{"stops": ["3.0, 1.0"]}],
    "run_mission": [{"tree": "- drive: 3.0, 1.0"}],
}
"""The calls that make a tool move the robot, where an empty one does not."""


OTHER_PORTS = {"ros"}
"""Groups that act on ROS and not on the robot's navigation; their port has a guard of its own."""


def tools_of(session: Session) -> dict[str, list[Tool]]:
    return build_toolsets(session)


def moving_tools() -> list[str]:
    session = Session(FakeRobot(HALL), SemanticMapStore(Path("none.yaml")), lease_s=60.0)
    groups = [group for name, group in tools_of(session).items() if name not in OTHER_PORTS]
    return [tool.name for group in groups for tool in group if tool.effect is ToolEffect.MOVES]


def put_hold(guard: Guard) -> None:
    guard.hold.put("a test", at=guard.wall_clock())


def break_log(guard: Guard) -> None:
    guard.audit.path.mkdir(parents=True)


def do_nothing(_guard: Guard) -> None:
    """Stands for rules that need nothing done."""


RULES: dict[str, tuple[Policy, Callable[[Guard], None]]] = {
    "read-only": (Policy(is_read_only=True), do_nothing),
    "hold": (Policy(), put_hold),
    "closed area": (Policy(areas=(EVERYWHERE,)), do_nothing),
    "rate": (Policy(rates={CommandKind.DRIVE: 0}), do_nothing),
    "approval": (Policy(approval=Approval(kinds=frozenset({CommandKind.DRIVE}))), do_nothing),
    "broken log": (Policy(), break_log),
}


async def call(tool: str, robot: FakeRobot, folder: Path, guard: Guard) -> str:
    toolsets = tuple(tools_of(Session(robot, SemanticMapStore(folder / "none.yaml"), lease_s=60.0)))
    async with connect(robot, folder, guard=guard, toolsets=toolsets) as client:
        said = ""
        for arguments in MOVING_CALLS.get(tool, [{}]):
            said = text_of(await client.call_tool(tool, arguments))
        return said


@pytest.mark.parametrize("tool", moving_tools())
async def test_a_moving_tool_moves_the_robot_and_its_drive_is_in_the_log(
    tmp_path: Path, tool: str
) -> None:
    robot = FakeRobot(HALL, pose=START)
    said = await call(tool, robot, tmp_path, make_guard(tmp_path))
    assert robot.goals, f"add the calls with which {tool} moves to MOVING_CALLS: {said}"
    decisions = [line for line in audit_of(tmp_path) if line.event == "decision"]
    assert {(line.tool, line.verdict) for line in decisions} == {(tool, "allowed")}
    assert len([line for line in decisions if line.kind == CommandKind.DRIVE]) == len(robot.goals)


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("tool", moving_tools())
async def test_a_moving_tool_is_held_to_each_rule(tmp_path: Path, tool: str, rule: str) -> None:
    robot = FakeRobot(HALL, pose=START)
    policy, prepare = RULES[rule]
    guard = make_guard(tmp_path, policy)
    prepare(guard)
    await call(tool, robot, tmp_path, guard)
    assert not robot.goals
    assert robot.pose == START


def test_tools_get_the_guarded_robot_and_no_other(tmp_path: Path) -> None:
    robot = FakeRobot(HALL)
    memory = SemanticMapStore(tmp_path / "m.yaml")
    session = Session(robot, memory, lease_s=60.0, guard=make_guard(tmp_path))
    assert isinstance(session.robot, GuardedRobot)
    assert [name for name, value in vars(session).items() if value is robot] == []
    assert session.drives._robot is session.robot


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(
    ("answer", "is_moved"),
    [
        (ElicitResult(action="accept", content={"agree": True}), True),
        (ElicitResult(action="accept", content={"agree": False}), False),
        (ElicitResult(action="decline"), False),
        (ElicitResult(action="cancel"), False),
    ],
)
async def test_a_person_is_asked_through_a_client_that_can_ask(
    tmp_path: Path, mode: str, answer: ElicitResult, *, is_moved: bool
) -> None:
    questions: list[str] = []

    async def on_question(
        context: ClientRequestContext,  # noqa: ARG001 - named so by the protocol
        params: ElicitRequestParams,
    ) -> ElicitResult:
        questions.append(params.message)
        return answer

    robot = FakeRobot(HALL, pose=START)
    guard = make_guard(tmp_path, Policy(approval=Approval(kinds=frozenset({CommandKind.DRIVE}))))
    async with connect(robot, tmp_path, guard=guard, mode=mode, on_question=on_question) as client:
        result = await client.call_tool("navigate_to", {"x": 3.0, "y": 1.0})
    assert questions[0] == "May the robot drive to (3.00, 1.00), yaw 0 deg?"
    assert bool(robot.goals) is is_moved
    assert result.is_error is not is_moved
    assert is_moved or "did not agree" in text_of(result)
    assert len(questions) == 1


@pytest.mark.parametrize("mode", MODES)
async def test_each_drive_needs_a_word_of_its_own(tmp_path: Path, mode: str) -> None:
    n_asked = 0

    async def on_question(
        context: ClientRequestContext,  # noqa: ARG001 - named so by the protocol
        params: ElicitRequestParams,  # noqa: ARG001
    ) -> ElicitResult:
        nonlocal n_asked
        n_asked += 1
        return ElicitResult(action="accept", content={"agree": True})

    guard = make_guard(tmp_path, Policy(approval=Approval(kinds=frozenset({CommandKind.DRIVE}))))
    async with connect(
        FakeRobot(HALL, pose=START), tmp_path, guard=guard, mode=mode, on_question=on_question
    ) as client:
        for x in (3.0, 2.0):
            result = await client.call_tool("navigate_to", {"x": x, "y": 1.0})
            assert report_of(result)["state"] == "arrived"
    assert n_asked == 2


async def test_a_client_that_cannot_ask_is_told_what_is_missing(tmp_path: Path) -> None:
    guard = make_guard(tmp_path, Policy(approval=Approval(kinds=frozenset({CommandKind.DRIVE}))))
    async with connect(FakeRobot(HALL, pose=START), tmp_path, guard=guard) as client:
        result = await client.call_tool("navigate_to", {"x": 3.0, "y": 1.0})
    assert result.is_error
    assert "A person must agree first." in text_of(result)


async def test_a_goal_in_a_closed_area_is_refused_by_name_with_another_pose(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(HALL, pose=START)
    pit = rectangle("pit", (2.5, 0.2), (3.5, 1.3))
    async with connect(robot, tmp_path, guard=make_guard(tmp_path, Policy(areas=(pit,)))) as client:
        drive = await client.call_tool("navigate_to", {"x": 3.0, "y": 1.0})
        checked = report_of(await client.call_tool("check_goal", {"place": "3.0, 1.0"}))
    assert "lies in the keep-out area 'pit'" in text_of(drive)
    assert "nearest pose that works is x=" in text_of(drive)
    assert checked["verdict"] == "closed"
    assert checked["nearest"] is not None


async def test_what_is_closed_is_told_with_the_map(tmp_path: Path) -> None:
    pit = replace(rectangle("pit", (2.5, 0.2), (3.5, 1.3)), reason="deep | dark")
    lab = replace(rectangle("lab", (6.0, 0.5), (7.0, 1.0)), hours=Hours(ends=time(14)))
    dock = replace(rectangle("dock", (6.0, 0.5), (7.0, 1.0)), hours=Hours(begins=time(18)))
    guard = make_guard(tmp_path, Policy(areas=(pit, lab, dock)))
    async with connect(FakeRobot(HALL, pose=START), tmp_path, guard=guard) as client:
        answer = await client.call_tool("look_at_map", {"layers": ["doors"]})
        again = await client.call_tool("look_at_map", {"layers": ["doors"]})
        zoomed = text_of(await client.call_tool("look_at_map", {"around": "9, 1", "radius_m": 3}))
    assert (
        "## Closed to the robot, hatched in the picture\n"
        "name | until | x | y | reason\n"
        "pit | always | 2.5 to 3.5 | 0.2 to 1.3 | deep / dark\n"
        "lab | 14:00 | 6.0 to 7.0 | 0.5 to 1.0 | -\n"
    ) in text_of(answer)
    assert "dock" not in text_of(answer)
    assert pictures_of(answer)[0].data == pictures_of(again)[0].data
    assert "\nlab | 14:00" in zoomed
    assert "\npit |" not in zoomed


async def test_very_many_closed_areas_leave_the_map_readable(tmp_path: Path) -> None:
    many = tuple(
        replace(rectangle(f"{n} {'x' * 75}", (2.5, 0.2), (3.5, 1.3)), reason="y" * 200)
        for n in range(500)
    )
    guard = make_guard(tmp_path, Policy(areas=many))
    async with connect(FakeRobot(HALL, pose=START), tmp_path, guard=guard) as client:
        answer = text_of(await client.call_tool("look_at_map", {}))
    assert "(showing 20 of 500)" in answer
    assert len(answer) < 20_000


async def test_a_mask_of_the_policy_file_is_kept_out_of_and_shown(tmp_path: Path) -> None:
    (tmp_path / "mask.pgm").write_bytes(b"P5\n4 3\n255\n" + bytes([0] * 4 + [254] * 8))
    (tmp_path / "mask.yaml").write_text(
        "image: mask.pgm\nresolution: 0.25\norigin: [2.75, 0.5, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.25\nmode: scale\n"
    )
    (tmp_path / "policy.yaml").write_text("keep_out: [{name: machines, mask: mask.yaml}]\n")
    guard = make_guard(tmp_path, load_policy(tmp_path / "policy.yaml"))
    robot = FakeRobot(HALL, pose=START)
    async with connect(robot, tmp_path, guard=guard) as client:
        drive = await client.call_tool("navigate_to", {"x": 3.0, "y": 1.1})
        seen = text_of(await client.call_tool("look_at_map", {}))
    assert "lies in the keep-out area 'machines'" in text_of(drive)
    assert not robot.goals
    assert "machines | always | 2.7 to 3.8 | 0.9 to 1.3 | -" in seen


async def test_a_rule_about_a_region_that_is_not_there_is_told(tmp_path: Path) -> None:
    policy = Policy(areas=(AreaRule(name="the archive", region_id="R77"),))
    robot = FakeRobot(HALL, pose=START)
    async with connect(robot, tmp_path, guard=make_guard(tmp_path, policy)) as client:
        answer = text_of(await client.call_tool("look_at_map", {}))
    assert "The policy closes R77 (the archive), which is not on this map." in answer


async def test_an_area_off_the_map_is_told(tmp_path: Path) -> None:
    policy = Policy(areas=(rectangle("quay", (900.0, 900.0), (901.0, 901.0)),))
    robot = FakeRobot(HALL, pose=START)
    async with connect(robot, tmp_path, guard=make_guard(tmp_path, policy)) as client:
        answer = text_of(await client.call_tool("look_at_map", {}))
    assert "The policy's area 'quay' lies off this map: it closes nothing here." in answer


@pytest.mark.parametrize("mode", MODES)
async def test_a_client_is_never_asked_for_what_waits_for_an_operator(
    tmp_path: Path, mode: str
) -> None:
    async def agree(
        context: ClientRequestContext,  # noqa: ARG001 - named so by the protocol
        params: ElicitRequestParams,  # noqa: ARG001
    ) -> ElicitResult:
        return ElicitResult(action="accept", content={"agree": True})

    robot = FakeRobot(HALL, pose=START)
    approval = Approval(kinds=frozenset({CommandKind.DRIVE}), otherwise=Otherwise.QUEUE)
    guard = make_guard(tmp_path, Policy(approval=approval))
    async with connect(robot, tmp_path, guard=guard, mode=mode, on_question=agree) as client:
        result = await client.call_tool("navigate_to", {"x": 3.0, "y": 1.0})
        assert "once a person has typed" in text_of(result)
        (request_id,) = guard.approvals.room.list_waiting()
        guard.approvals.room.approve(request_id)
        await client.call_tool("navigate_to", {"x": 3.0, "y": 1.0})
    assert len(robot.goals) == 1


def test_a_word_is_taken_only_from_the_client_that_was_asked_for_it(tmp_path: Path) -> None:
    approvals = make_guard(tmp_path).approvals
    wanted = Publish(topic="/lamp", type="std_msgs/msg/Bool", message={"data": True})
    request_id = approvals.ask(wanted, client="a")
    assert not approvals.grant(request_id, client="a", secret="")
    secret = approvals.ask_client(request_id)
    assert not approvals.grant(request_id, client="b", secret=secret)
    assert not approvals.grant(request_id, client="a", secret="")
    assert not approvals.grant("other", client="a", secret=secret)
    assert approvals.take_word(wanted, client="a") is None
    assert approvals.grant(request_id, client="a", secret=secret)
    assert not approvals.grant(request_id, client="a", secret=secret)
    assert approvals.take_word(wanted, client="a") == request_id


async def test_what_is_remembered_is_in_the_log(tmp_path: Path) -> None:
    robot = FakeRobot(HALL, pose=START)
    async with connect(robot, tmp_path, guard=make_guard(tmp_path)) as client:
        await client.call_tool("write_semantic_data", {"name": "robot", "description": "refused"})
        await client.call_tool("write_semantic_data", {"name": "dock", "description": "a dock"})
    (line,) = audit_of(tmp_path)
    assert (line.event, line.tool, line.said) == (
        "memory",
        "write_semantic_data",
        "remembered 'dock'",
    )


async def test_stopping_works_while_everything_is_refused(tmp_path: Path) -> None:
    robot = FakeRobot(HALL, pose=START)
    guard = make_guard(tmp_path, Policy(is_read_only=True, rates=dict.fromkeys(CommandKind, 0)))
    put_hold(guard)
    break_log(guard)
    async with connect(robot, tmp_path, guard=guard) as client:
        result = await client.call_tool("stop_robot", {})
    assert not result.is_error
    assert robot.n_stops == 1


async def test_a_hostile_caller_breaks_no_rule(tmp_path: Path) -> None:
    """The long version of this, against the simulator, is `benchmarks/safety.py`."""
    pit = rectangle("pit", (2.5, 0.2), (3.5, 1.3))
    policy = Policy(areas=(pit,), rates={CommandKind.DRIVE: 20}, farthest_m=8.0)
    robot = FakeRobot(HALL, pose=START)
    chooser = random.Random(5)  # noqa: S311 - no secret
    async with connect(robot, tmp_path, guard=make_guard(tmp_path, policy)) as client:
        for _ in range(150):
            goal = {"x": chooser.uniform(-1, 12), "y": chooser.uniform(-1, 3)}
            await client.call_tool("navigate_to", {**goal, "wait_s": chooser.choice((0, 1, 5))})
            assert not (2.4 <= robot.pose.x <= 3.6 and robot.pose.y <= 1.4), robot.pose
    lines = audit_of(tmp_path)
    allowed = [line for line in lines if line.verdict == "allowed"]
    led_on = [line for line in lines if line.event == "leg"]
    assert len(allowed) + len(led_on) == len(robot.goals)
    assert [line.number for line in lines if line.event == "result"] == [
        line.number for line in allowed
    ]


def test_a_clients_name_is_one_printable_line_in_the_log() -> None:
    info = SimpleNamespace(name="good\n9-9  drive\x1b[2K\u202e" + "x" * 300)
    session = SimpleNamespace(client_params=SimpleNamespace(client_info=info))
    context = SimpleNamespace(session=session, headers={"mcp-session-id": "a\nb"})
    named = name_client(context)  # type: ignore[arg-type]
    assert named.isprintable()
    assert named.startswith("good 9-9 drive")
    assert len(named) <= 70
