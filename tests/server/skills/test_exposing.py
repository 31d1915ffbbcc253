"""Topics, services and actions of a robot as tools: found, typed, checked, called, withdrawn."""

from pathlib import Path
from typing import Any

import anyio
import pytest
from mcp_types import ToolListChangedNotification

from bridging import SteppedRobot
from exposing import NODE, exposed, tool_system, watched
from fakes import FakeRobot, two_rooms
from guarding import make_guard
from mapspeak.errors import LinkError
from mapspeak.links.rosbridge import RobotAddress, open_client
from mapspeak.memory import SemanticMapStore
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.port import RosConnection
from mapspeak.rosbridge_server import open_rosbridge_server
from mapspeak.rosbridge_server.hub import Topic
from mapspeak.safety import CommandKind, Patterns, Policy
from mapspeak.server.tools.ros.goals import RosAccess
from mapspeak.server.tools.ros.inquiry import RosInquiry
from mapspeak.server.tools.skills.book import SkillBook
from mapspeak.server.tools.skills.exposing import Exposure
from mapspeak.session import Session
from rosserved import QUICK, time_passing

pytestmark = pytest.mark.anyio
both = pytest.mark.parametrize("dialect", Dialect)

ARM = {
    "arm_msgs/Reach": "uint8 OPEN=0\nuint8 CLOSE=1\nuint8 mode\ngeometry_msgs/Point[<=3] via",
    "arm_msgs/Grip": "Reach reach\nfloat64 force",
}
FORM = {"reach_mode", "reach_via", "force"}


def listened() -> tuple[list[Any], Topic]:
    """Gives what is heard on a topic of an arm, and the topic."""
    messages: list[Any] = []
    topic = Topic(name="/tool/grip", type="arm_msgs/Grip", subscribers=(NODE,))
    topic.takers.append(lambda publication: messages.append(publication.message))
    return messages, topic


def offer_switch(system: Any, name: str = "/tool/light") -> list[Any]:  # noqa: ANN401
    asked: list[Any] = []

    def answer(values: dict[str, Any]) -> dict[str, Any]:
        asked.append(values)
        return {"success": values["data"], "message": "as you say"}

    system.offer_typed(name, "std_srvs/SetBool", node=NODE, answer=answer)
    return asked


@both
async def test_a_service_is_a_tool_with_its_own_typed_arguments(
    dialect: Dialect, tmp_path: Path
) -> None:
    system = tool_system(dialect)
    asked = offer_switch(system)
    async with exposed(system, tmp_path) as caller:
        tools = await caller.until(lambda tools: "tool_light" in tools)
        answer = await caller.ask("tool_light", data=True)
        refused = await caller.refuse("tool_light", data="yes")
        stranger = await caller.refuse("tool_light", date=True)
        failed = await caller.ask("tool_light", data=False)
    assert tools["tool_light"].input_schema == {
        "type": "object",
        "properties": {"data": {"type": "boolean"}},
    }
    assert "/tool/light" in (tools["tool_light"].description or "")
    assert "succeeded" in answer
    assert "data cannot be 'yes'. Give true or false" in refused
    assert "Did you mean data?" in stranger
    assert "failed" in failed
    assert 'The robot says: "as you say"' in failed
    assert asked == [{"data": True}, {"data": False}], "only what fits was sent"


@both
async def test_a_topic_of_a_nested_type_of_its_own_is_a_tool_that_publishes(
    dialect: Dialect, tmp_path: Path
) -> None:
    messages, topic = listened()
    system = tool_system(dialect, topic, more=ARM)
    async with exposed(system, tmp_path) as caller:
        tools = await caller.until(lambda tools: "publish_tool_grip" in tools)
        sent = {"reach_mode": 1, "reach_via": [{"x": 0.5}], "force": 2}
        assert "It was published; what the robot makes of it" in await caller.ask(
            "publish_tool_grip", **sent
        )
        too_many = await caller.refuse("publish_tool_grip", reach_via=[{}, {}, {}, {}])
        no_number = await caller.refuse("publish_tool_grip", force="strong")
        while not messages:
            await anyio.lowlevel.checkpoint()
    properties = tools["publish_tool_grip"].input_schema["properties"]
    assert set(properties) == FORM
    assert properties["reach_via"]["maxItems"] == 3
    assert properties["reach_via"]["items"]["properties"]["x"]["description"] == "m"
    assert "at most 3 values" in too_many
    assert "force cannot be 'strong'. Give a number." in no_number
    assert [(each["reach"]["mode"], each["force"]) for each in messages] == [(1, 2.0)]
    assert messages[0]["reach"]["via"][0]["x"] == 0.5


@both
async def test_a_topic_that_is_published_is_a_tool_that_reads(
    dialect: Dialect, tmp_path: Path
) -> None:
    topic = Topic(name="/tool/state", type="arm_msgs/Grip", publishers=(NODE,), is_latched=True)
    system = tool_system(dialect, topic, more=ARM)
    system.hub.publish("/tool/state", system.interfaces.fill("arm_msgs/Grip", {"force": 3.5}))
    async with exposed(system, tmp_path, is_read_only=True) as caller:
        tools = await caller.until(lambda tools: "read_tool_state" in tools)
        answer = await caller.ask("read_tool_state")
    annotations = tools["read_tool_state"].annotations
    assert annotations is not None
    assert annotations.read_only_hint
    assert "force: 3.5" in answer


async def test_tools_come_and_go_with_what_the_robot_offers(tmp_path: Path) -> None:
    system = tool_system(Dialect.ROS2)
    heard: list[str] = []

    async with exposed(system, tmp_path) as caller:
        assert "tool_light" not in await caller.tools()
        async with caller.client.listen(tools_list_changed=True) as changes:
            offer_switch(system)
            await caller.until(lambda tools: "tool_light" in tools)
            async for _ in changes:
                heard.append("there")
                break
            system.withdraw("/tool/light")
            await caller.until(lambda tools: "tool_light" not in tools)
            async for _ in changes:
                heard.append("gone")
                break
        gone = await caller.client.call_tool("tool_light", {"data": True})
    assert heard == ["there", "gone"]
    assert gone.is_error


async def test_a_skill_that_the_robot_withdraws_mid_mission_fails_its_step(
    tmp_path: Path,
) -> None:
    system = tool_system(Dialect.ROS2)
    asked = offer_switch(system)
    tree = """
- tool_light: true
- ask: Ready?
- fallback:
  - tool_light: true
  - note: no light
"""
    async with exposed(system, tmp_path) as caller:
        await caller.until(lambda tools: "tool_light" in tools)
        await caller.ask("run_mission", tree=tree)
        system.withdraw("/tool/light")
        await caller.until(lambda tools: "tool_light" not in tools)
        await caller.ask("answer_mission", answer="yes")
        while ": running after" in (told := await caller.ask("skill_status", wait_s=0.05)):
            pass
    assert asked == [{"data": True}]
    assert "tool_light: failed (rejected)" in told
    assert "note: succeeded" in told


async def test_a_client_of_the_older_protocol_is_told_of_new_tools_too(tmp_path: Path) -> None:
    system, told = tool_system(Dialect.ROS2), anyio.Event()

    async def hear(message: object) -> None:
        if isinstance(message, ToolListChangedNotification):
            told.set()

    async with exposed(system, tmp_path, mode="legacy", on_message=hear) as caller:
        capabilities = caller.client.server_capabilities
        await caller.tools()
        offer_switch(system)
        await caller.until(lambda tools: "tool_light" in tools)
        await told.wait()
    assert capabilities is not None
    assert capabilities.tools is not None
    assert capabilities.tools.list_changed


async def test_what_the_policy_denies_is_no_tool(tmp_path: Path) -> None:
    system = tool_system(Dialect.ROS2)
    offer_switch(system)
    offer_switch(system, "/tool/laser")
    patterns = {CommandKind.CALL: Patterns(allow=("*",), deny=("*laser*",))}
    guard = make_guard(tmp_path, Policy(patterns=patterns))
    async with exposed(system, tmp_path, guard=guard) as caller:
        tools = await caller.until(lambda tools: "tool_light" in tools)
    assert "tool_laser" not in tools


async def test_a_type_that_cannot_be_described_is_left_out_and_the_others_are_not(
    tmp_path: Path,
) -> None:
    circle = {"bad_msgs/Circle": "Circle[] more"}
    topic = Topic(name="/tool/circle", type="bad_msgs/Circle", subscribers=(NODE,))
    system = tool_system(Dialect.ROS2, topic, more=circle)
    offer_switch(system)
    async with exposed(system, tmp_path) as caller:
        tools = await caller.until(lambda tools: "tool_light" in tools)
    assert not [name for name in tools if "circle" in name]


async def test_a_type_that_was_not_found_is_tried_again_and_told_of_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    _, topic = listened()
    system = tool_system(Dialect.ROS2, topic, more=ARM)
    describes = system.find_service("/rosapi/topics_and_raw_types")
    assert describes is not None
    system.withdraw(describes.name)
    async with exposed(system, tmp_path) as caller:
        exposure = caller.server.exposure
        assert exposure is not None
        exposure.kept_s = 0.0
        for _ in range(3):
            await exposure.look()
        before = await caller.tools()
        system.offer(describes.name, describes.type, node=describes.node, answer=describes.answer)
        await exposure.look()
        after = await caller.tools()
    told = [each for each in caplog.messages if "is not exposed" in each]
    assert "publish_tool_grip" not in before
    assert "publish_tool_grip" in after
    assert len(told) == 1


async def test_a_file_of_a_mission_that_is_called_as_an_exposed_tool_takes_not_its_place(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    system = tool_system(Dialect.ROS2)
    asked = offer_switch(system)
    async with exposed(system, tmp_path) as caller:
        await caller.until(lambda tools: "tool_light" in tools)
        await caller.ask("save_mission", name="visit", tree="- wait: 1\n")
        path = tmp_path / "semantic_map.memory" / "missions" / "visit.yaml"
        path.write_text(path.read_text().replace("visit", "tool_light"))
        told = await caller.ask("show_missions")
        tools = await caller.tools()
        await caller.ask("tool_light", data=True)
        await caller.ask("run_mission", tree="- tool_light: true\n")
        no_mission = await caller.refuse("run_mission", name="tool_light")
    assert asked == [{"data": True}, {"data": True}]
    assert tools["tool_light"].input_schema["properties"].keys() == {"data"}
    assert "visit" not in tools
    assert "calls /tool/light" in told
    assert "No mission is called" in no_mission
    assert f"{path}: 'tool_light' is taken." in caplog.text


async def test_a_tool_of_ours_keeps_its_name(tmp_path: Path) -> None:
    system = tool_system(Dialect.ROS2)
    offer_switch(system, "/stop_robot")
    async with exposed(system, tmp_path, expose=("/*robot",)) as caller:
        tools = await caller.until(lambda tools: "robot_stop_robot" in tools)
    assert "stop_robot" in tools


@both
async def test_an_action_is_a_tool_that_is_followed_awaited_and_cancelled(
    dialect: Dialect, tmp_path: Path
) -> None:
    action, field = (
        ("navigate_to_pose", "pose") if dialect is Dialect.ROS2 else ("move_base", "target_pose")
    )
    goal = {
        f"{field}_header_frame_id": "map",
        f"{field}_pose_position_x": 6.0,
        f"{field}_pose_position_y": 1.4,
        f"{field}_pose_orientation_w": 1.0,
    }
    robot = SteppedRobot(two_rooms())
    async with (
        open_rosbridge_server(robot, dialect=dialect) as server,
        open_client(RobotAddress(url=server.url), patience=QUICK) as client,
        watched(robot, client, tmp_path, expose=(f"/{action}",)) as caller,
    ):
        await caller.until(lambda tools: action in tools)
        begun = await caller.ask(action, **goal, wait_s=0)
        async with time_passing(robot):
            ended = await caller.ask("skill_status", wait_s=20)
        again = await caller.ask(action, **goal | {f"{field}_pose_position_x": 2.0}, wait_s=0)
        async with time_passing(robot):
            cancelled = await caller.ask("cancel_skill", run="S2")
            over = await caller.ask("cancel_skill", run="S2")
    assert "S1" in begun
    assert "skill_status waits for it" in begun
    assert "succeeded" in ended
    assert "S2" in again
    assert "cancelled" in cancelled
    assert "over already" in over
    assert robot.pose.x > 2.5


async def test_a_robot_that_is_not_there_yet_is_waited_for(tmp_path: Path) -> None:
    n_asked = 0

    class Absent(RosInquiry):
        @property
        def connection(self) -> RosConnection:
            nonlocal n_asked
            n_asked += 1
            raise LinkError("The robot is not there yet.", hint="Wait for it.")

    session = Session(FakeRobot(), SemanticMapStore(tmp_path / "m.yaml"), lease_s=60.0)
    ros = RosAccess(session, Absent(session))
    book = SkillBook(session, ros)

    async def tell() -> None:
        raise AssertionError("nothing has changed")

    exposure = Exposure(ros, book, ("/tool/*",), tell=tell, every_s=0.0)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(exposure.keep_looking)
        while n_asked < 3:
            await anyio.lowlevel.checkpoint()
        tasks.cancel_scope.cancel()
    assert not book.exposed
