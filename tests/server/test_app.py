import json
from pathlib import Path

import pytest
from mcp.shared.exceptions import MCPError
from mcp_types import INVALID_PARAMS

from fakes import FakeRobot, two_rooms
from mapspeak.errors import ConfigError
from served import MODES, connect, text_of

pytestmark = pytest.mark.anyio

PAPER_TOOLS = {
    "subscribe_map_as_image",
    "draw_map_axis",
    "draw_robot_pose",
    "write_semantic_data",
    "get_semantic_data",
}
MOST_BYTES, MOST_BYTES_OF_ALL = 12_000, 40_000
EVERYTHING = ("look", "places", "drive", "paper", "explore", "routes", "memory", "ros")


@pytest.mark.parametrize("mode", MODES)
async def test_the_papers_tools_are_there_by_default(tmp_path: Path, mode: str) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, mode=mode) as client:
        names = {tool.name for tool in (await client.list_tools()).tools}
        instructions = client.instructions or ""
    assert names >= PAPER_TOOLS
    assert "robot" in instructions


async def test_the_papers_prompts_run_by_its_own_toolset(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=("paper",)) as client:
        names = {tool.name for tool in (await client.list_tools()).tools}
    drives = {"navigate_to", "wait_for_goal", "look_through_camera", "stop_robot"}
    assert names == PAPER_TOOLS | drives


async def test_the_memorys_toolset_can_write_it(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=("memory",)) as client:
        names = {tool.name for tool in (await client.list_tools()).tools}
    assert names >= {"write_semantic_data", "get_semantic_data", "find_place", "recall_episodes"}


async def test_a_tool_that_is_not_offered_tells_which_toolset_has_it(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=("look",)) as client:
        explore = await client.call_tool("explore", {})
        stranger = await client.call_tool("fly", {})
    assert explore.is_error
    assert "--toolsets +explore" in text_of(explore)
    assert stranger.is_error
    assert "toolset" not in text_of(stranger)


async def test_a_server_that_moves_nothing_promises_no_drives(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, is_read_only=True) as client:
        assert "drives" not in (client.instructions or "")


async def test_every_argument_is_described_and_no_title_is_sent(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        tools = (await client.list_tools()).tools
    for tool in tools:
        for name, schema in tool.input_schema.get("properties", {}).items():
            assert schema.get("description"), f"{tool.name}: {name}"
        assert '"title"' not in json.dumps(tool.input_schema)
        assert tool.annotations is not None


async def test_the_tool_list_is_short(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        listed = await client.list_tools()
    sent = listed.model_dump_json(by_alias=True, exclude_none=True)
    assert len(sent) <= MOST_BYTES


async def test_the_list_of_all_tools_is_short_too(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=EVERYTHING) as client:
        listed = await client.list_tools()
    sent = listed.model_dump_json(by_alias=True, exclude_none=True)
    assert len(sent) <= MOST_BYTES_OF_ALL


async def test_whoever_looks_for_a_thing_reads_first_which_tool_to_take(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=EVERYTHING) as client:
        tools = (await client.list_tools()).tools
    first = {tool.name: (tool.description or "").splitlines()[0] for tool in tools}
    for name in ("search_for", "get_semantic_data", "recall_episodes"):
        assert "find_place" in first[name]
    assert "Take this first" in first["find_place"]


async def test_turning_and_looking_around_are_there_by_default(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        names = {tool.name for tool in (await client.list_tools()).tools}
        first, *_ = (client.instructions or "").splitlines()
    assert names >= {"turn", "look_around", "stop_robot", "what_is_blocked"}
    told = [first.index(word) for word in ("map", "camera", "rooms", "drives")]
    assert told == sorted(told)


async def test_read_only_leaves_out_what_moves_or_remembers_but_stopping_stays(
    tmp_path: Path,
) -> None:
    async with connect(
        FakeRobot(two_rooms()), tmp_path, tools=("navigate_to",), is_read_only=True
    ) as client:
        names = {tool.name for tool in (await client.list_tools()).tools}
        result = await client.call_tool("navigate_to", {"place": "R2"})
    assert not names & {"navigate_to", "write_semantic_data"}
    assert names >= {"stop_robot", "cancel_goal", "look_at_map"}
    assert result.is_error


async def test_single_tools_can_be_chosen(tmp_path: Path) -> None:
    async with connect(
        FakeRobot(two_rooms()), tmp_path, toolsets=(), tools=("look_at_map",)
    ) as client:
        names = [tool.name for tool in (await client.list_tools()).tools]
    assert names == ["look_at_map"]


async def test_a_toolset_that_does_not_exist_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"'look2'.*look"):
        async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=("look2",)):
            pass


async def test_wrong_arguments_are_explained_without_a_link_to_a_library(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        result = await client.call_tool("navigate_to", {"place": "R1", "wait_s": -1})
    assert result.is_error
    assert "wait_s" in text_of(result)
    assert "pydantic" not in text_of(result)


async def test_text_that_is_not_unicode_is_refused(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        result = await client.call_tool("navigate_to", {"place": "\ud800"})

    assert result.is_error
    assert "navigate_to" in text_of(result)
    assert "not valid Unicode" in text_of(result)


async def test_wrong_arguments_are_named_as_the_caller_named_them(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        result = await client.call_tool(
            "write_semantic_data",
            {"name": "closet", "description": "small", "safety_landmarks": [7, {"label": ""}]},
        )
    text = text_of(result)
    assert "safety_landmarks.0: input should be a valid string; safety_landmarks.0" in text
    assert "safety_landmarks.1.label: " in text
    assert "constrained" not in text
    assert "Landmark" not in text


async def test_the_papers_prompts_are_offered(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        prompt = await client.get_prompt("exploration")
    text = prompt.messages[0].content.model_dump()["text"]
    assert "Select ONE waypoint >= 5 m away toward the largest unexplored area." in text
    assert "safety landmarks" in text


@pytest.mark.parametrize("mode", MODES)
async def test_an_unknown_prompt_is_answered_with_those_there_are(
    tmp_path: Path, mode: str
) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, mode=mode) as client:
        with pytest.raises(MCPError, match="there are: exploration, semantic_policy") as raised:
            await client.get_prompt("explore")
    assert raised.value.error.code == INVALID_PARAMS


@pytest.mark.parametrize("given", ["R1", '["R1"]', ["R1"]])
async def test_a_list_is_also_taken_as_its_only_element_or_as_json(
    tmp_path: Path, given: str | list[str]
) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        answer = await client.call_tool("measure", {"places": given})
    assert "R1 |" in text_of(answer)
    assert "R2 |" not in text_of(answer)


async def test_schemas_are_flat_and_say_null_as_an_alternative(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=EVERYTHING) as client:
        tools = (await client.list_tools()).tools
    schemas = [schema for tool in tools for schema in (tool.input_schema, tool.output_schema)]
    told = json.dumps(schemas)
    assert "$ref" not in told
    assert "$defs" not in told
    assert '"type": [' not in told


async def test_without_a_tool_that_writes_memory_neither_prompts_nor_instructions_speak_of_it(
    tmp_path: Path,
) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=("drive", "places")) as client:
        prompts = (await client.list_prompts()).prompts
        instructions = client.instructions or ""
    assert not prompts
    assert "write_semantic_data" not in instructions
    assert "memory" not in instructions
