"""Nothing that a model reads leads to a tool that it cannot call."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from mcp_types import CallToolResult

from fakes import FakeRobot, two_rooms
from guarding import make_guard
from mapspeak.geometry import Pose
from mapspeak.robot import Detection
from mapspeak.server.app import DEFAULT_TOOLSETS
from mapspeak.server.text.offered import lead, offering
from mapspeak.server.text.ros.outcomes import refuse_name
from served import connect, text_of

pytestmark = pytest.mark.anyio

ALL = (*DEFAULT_TOOLSETS, "explore", "routes", "memory")
CALLS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("find_place", {"query": "ladder"}),
    ("find_place", {"query": "giraffe", "since": "09:00"}),
    ("find_place", {"query": "sink"}),
    ("get_semantic_data", {"query": "giraffe"}),
    ("look_at_map", {}),
    ("describe_place", {"place": "R1"}),
    ("describe_place", {"place": "giraffe"}),
    ("describe_place", {"place": "snk"}),
    ("measure", {"places": ["robot"]}),
    ("check_goal", {"place": "R1"}),
    ("check_goal", {"place": "0.05, 0.05"}),
    ("navigate_to", {"place": "R1"}),
    ("navigate_to", {"place": "0.05, 0.05"}),
    ("wait_for_goal", {}),
    ("search_for", {"thing": "sink", "max_looks": 1}),
    ("search_for", {"thing": "sink", "seen": True}),
    ("explore", {}),
    ("check_memory", {}),
    ("recall_episodes", {"picture_of": "nobody"}),
    ("write_semantic_data", {"name": "b", "description": "", "functional_landmarks": ["tap"]}),
)


def test_names_of_ros_that_are_not_there_lead_to_a_list_only_where_it_is_offered() -> None:
    with offering(()):
        assert str(refuse_name("service", "/lift", ["/lift_up"])).endswith("of 1: /lift_up.")
    with offering({"ros_services"}):
        assert str(refuse_name("service", "/lift", ["/lift_up"])).endswith(
            "ros_services lists all."
        )


def tools_in(text: str) -> set[str]:
    own = re.sub(r"\"[^\"]*\"|(?<!\w)'[^']*'(?!\w)", "", text)
    return set(re.findall(r"(?<!/)\b[a-z]+(?:_[a-z]+)+\b", own))


async def everything_said(
    folder: Path, *, toolsets: tuple[str, ...] = (), tools: tuple[str, ...] = ()
) -> tuple[str, set[str], set[str]]:
    """Gives all answers to those calls that can be made, the tools there are, and all of them."""
    robot = FakeRobot(two_rooms())
    robot.detections = (
        Detection(label="ladder", bearing_rad=0.0, range_m=None, confidence_ratio=0.9),
    )
    guard = make_guard(folder)
    async with connect(robot, folder, toolsets=ALL, guard=guard) as client:
        known = {tool.name for tool in (await client.list_tools()).tools}
        await client.call_tool("look_through_camera", {})
        sink = {"name": "a", "description": "", "functional_landmarks": ["sink"]}
        await client.call_tool("write_semantic_data", sink)
        closed = {"text": "wet floor", "place": "R1", "effect": "closed"}
        await client.call_tool("note_event", closed)
    robot.pose = Pose(2.0, 1.4)
    async with connect(robot, folder, toolsets=toolsets, tools=tools, guard=guard) as client:
        offered = {tool.name for tool in (await client.list_tools()).tools}
        answers = [await client.call_tool(name, asked) for name, asked in CALLS if name in offered]
    return "\n".join(map(_said, answers)), offered, known


def _said(answer: CallToolResult) -> str:
    """Gives the text of an answer; of a report that of its fields, each on a line."""
    report = answer.structured_content
    return text_of(answer) if report is None else "\n".join(_strings(report))


def _strings(value: object) -> Iterator[str]:
    match value:
        case str():
            yield value
        case dict():
            for each in value.values():
                yield from _strings(each)
        case list():
            for each in value:
                yield from _strings(each)


@pytest.mark.parametrize("toolset", [*ALL, "default"])
async def test_no_answer_and_no_hint_leads_to_a_tool_that_is_not_offered(
    tmp_path: Path, toolset: str
) -> None:
    toolsets = DEFAULT_TOOLSETS if toolset == "default" else (toolset,)
    said, offered, known = await everything_said(tmp_path, toolsets=toolsets)
    assert tools_in(said) & known <= offered


async def test_a_tool_that_is_offered_is_led_to(tmp_path: Path) -> None:
    said, _, _ = await everything_said(tmp_path, toolsets=ALL)
    assert tools_in(said) >= {"search_for", "recall_episodes", "write_semantic_data", "navigate_to"}


@pytest.mark.parametrize(
    ("template", "told"),
    [
        ("Say it anew. {search_for} looks for it.", "Say it anew."),
        ("Call {turn}. {stop_robot} or {search_for} ends it.", "Call turn."),
        ("It is {what}! Call {turn}.", "It is a {map}. Call {turn}! Call turn."),
        ("{search_for} finds it.", ""),
    ],
)
def test_a_sentence_that_leads_to_a_missing_tool_is_left_out(template: str, told: str) -> None:
    with offering({"turn", "stop_robot"}):
        assert lead(template, what="a {map}. Call {turn}") == told


def test_where_nobody_has_said_what_is_offered_every_sentence_is_told() -> None:
    assert lead("Call {turn}. {search_for} finds it.") == "Call turn. search_for finds it."
