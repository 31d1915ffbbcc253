"""rosapi and the other services of the rosbridge server."""

from typing import Any

import pytest

from bridging import bridge
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.messages.grids import read_grid

pytestmark = pytest.mark.anyio
both = pytest.mark.parametrize("dialect", Dialect)


@both
async def test_topics_and_types_are_told_in_the_words_of_each_ros(dialect: Dialect) -> None:
    async with bridge(dialect) as (_, connect), connect() as client:
        told = await client.ask("topics")
        types = dict(zip(told["topics"], told["types"], strict=True))
        grid = dialect.type_name("nav_msgs/OccupancyGrid")
        assert types["/map"] == grid
        assert (await client.ask("topic_type", topic="/map"))["type"] == grid
        assert (await client.ask("topics_for_type", type=grid))["topics"] == ["/map"]
        assert (await client.ask("topic_type", topic="/nowhere"))["type"] == ""


@both
async def test_nodes_are_told_with_what_they_do(dialect: Dialect) -> None:
    async with bridge(dialect) as (_, connect), connect() as client:
        slam = (await client.ask("publishers", topic="/map"))["publishers"][0]
        assert slam in (await client.ask("nodes"))["nodes"]
        details = await client.ask("node_details", node=slam)
        driver = (await client.ask("subscribers", topic="/cmd_vel"))["subscribers"][0]
    assert "/map" in details["publishing"]
    assert any("dynamic_map" in service for service in details["services"])
    assert driver == "/robot_base"


@both
async def test_services_are_told_with_their_types(dialect: Dialect) -> None:
    async with bridge(dialect) as (_, connect), connect() as client:
        services = (await client.ask("services"))["services"]
        types = [(await client.ask("service_type", service=each))["type"] for each in services]
        kind = types[services.index("/rosapi/topics")]
        assert (await client.ask("services_for_type", type=kind))["services"] == ["/rosapi/topics"]
        assert (await client.ask("service_node", service="/rosapi/topics"))["node"] == "/rosapi"
    assert all(types)
    assert kind == ("rosapi/Topics" if dialect is Dialect.ROS1 else "rosapi_msgs/srv/Topics")


@pytest.mark.parametrize(
    ("dialect", "actions"), [(Dialect.ROS1, []), (Dialect.ROS2, ["/navigate_to_pose"])]
)
async def test_actions_are_found_on_ros_2_alone(dialect: Dialect, actions: list[str]) -> None:
    async with bridge(dialect) as (_, connect), connect() as client:
        assert (await client.ask("action_servers"))["action_servers"] == actions
        topics = (await client.ask("topics"))["topics"]
    assert not [topic for topic in topics if "/_action/" in topic]


async def test_ros_2_describes_an_action_by_its_parts() -> None:
    async with bridge(Dialect.ROS2) as (_, connect), connect() as client:
        kind = (await client.ask("action_type", action="/navigate_to_pose"))["type"]
        interfaces = (await client.ask("interfaces"))["interfaces"]
        goal = (await client.ask("action_goal_details", type=kind))["typedefs"][0]
        result = (await client.ask("action_result_details", type=kind))["typedefs"][0]
        feedback = "/navigate_to_pose/_action/feedback"
        feedback_type = (await client.ask("topic_type", topic=feedback))["type"]
    assert kind == "nav2_msgs/action/NavigateToPose"
    assert {kind, "nav_msgs/srv/GetMap", "nav_msgs/msg/Odometry"} <= set(interfaces)
    assert goal["fieldtypes"] == ["geometry_msgs/msg/PoseStamped", "string"]
    assert result["fieldnames"] == ["error_code", "error_msg"]
    assert feedback_type == f"{kind}_FeedbackMessage"


async def test_a_service_that_ros_1_lacks_tells_which_ros_it_is() -> None:
    async with bridge(Dialect.ROS1) as (_, connect), connect() as client:
        answer = await client.call("/rosapi/get_ros_version")
    assert (answer["result"], answer["values"]) == (
        False,
        "Service /rosapi/get_ros_version does not exist",
    )
    async with bridge(Dialect.ROS2) as (_, connect), connect() as client:
        assert (await client.ask("get_ros_version"))["version"] == 2


@both
async def test_the_time_is_the_robots(dialect: Dialect) -> None:
    async with bridge(dialect) as (robot, connect), connect() as client:
        await robot.let_pass(1.5)
        time = (await client.ask("get_time"))["time"]
    assert list(time.values()) == [1, pytest.approx(500_000_000, abs=1000)]


@both
async def test_parameters_are_kept_as_json(dialect: Dialect) -> None:
    async with bridge(dialect) as (_, connect), connect() as client:
        assert (await client.ask("has_param", name="/speed"))["exists"] is False
        assert (await client.ask("get_param", name="/speed", default="1"))["value"] == "1"
        await client.ask("set_param", name="/speed", value="0.5")
        await client.ask("set_param", name="/label", value="plain text")
        assert (await client.ask("get_param", name="/speed"))["value"] == "0.5"
        assert (await client.ask("get_param", name="/label"))["value"] == '"plain text"'
        await client.ask("delete_param", name="/speed")
        assert (await client.ask("has_param", name="/speed"))["exists"] is False


async def test_a_node_of_ros_2_tells_its_parameters_and_lets_them_be_set() -> None:
    async with bridge(Dialect.ROS2) as (_, connect), connect() as client:

        async def ask_node(question: str, **args: object) -> dict[str, Any]:
            values: dict[str, Any] = (await client.call(f"/robot_base/{question}", **args))[
                "values"
            ]
            return values

        names = (await ask_node("list_parameters"))["result"]["names"]
        radius, missing = (await ask_node("get_parameters", names=["robot_radius", "none"]))[
            "values"
        ]
        described = (await ask_node("describe_parameters", names=names))["descriptors"]
        wide = {"name": "robot_radius", "value": {"type": 3, "double_value": 0.3}}
        odd = {"name": "robot_radius", "value": {"type": 4, "string_value": "wide"}}
        unknown = {"name": "none", "value": {"type": 1}}
        results = (await ask_node("set_parameters", parameters=[wide, odd, unknown]))["results"]
        by_rosapi = await client.ask("get_param", name="/robot_base:robot_radius")
    assert names == ["robot_radius", "use_sim_time"]
    assert (radius["type"], radius["double_value"], missing["type"]) == (3, 0.2, 0)
    assert [each["type"] for each in described] == [3, 1]
    assert [each["successful"] for each in results] == [True, False, False]
    assert by_rosapi["value"] == "0.3"


async def test_ros_1_describes_a_type_and_all_within() -> None:
    async with bridge(Dialect.ROS1) as (_, connect), connect() as client:
        typedefs = (await client.ask("message_details", type="nav_msgs/OccupancyGrid"))["typedefs"]
        unknown = await client.call("/rosapi/message_details", type="odd_msgs/Odd")
        names = (await client.ask("get_param_names"))["names"]
        request = await client.ask("service_response_details", type="nav_msgs/GetMap")
    grid, *others = typedefs
    assert grid["fieldnames"] == ["header", "info", "data"]
    assert grid["fieldtypes"] == ["std_msgs/Header", "nav_msgs/MapMetaData", "int8"]
    assert grid["fieldarraylen"] == [-1, -1, 0]
    assert {"std_msgs/Header", "geometry_msgs/Quaternion"} <= {each["type"] for each in others}
    header = next(each for each in others if each["type"] == "std_msgs/Header")
    assert header["fieldtypes"] == ["uint32", "time", "string"]
    assert unknown["result"] is False
    assert "/use_sim_time" in names
    assert request["typedefs"][0]["fieldnames"] == ["map"]


@pytest.mark.parametrize("service", ["/rosapi/message_details", "/rosapi/get_param_names"])
async def test_what_kills_rosapi_on_ros_2_is_never_answered(service: str) -> None:
    async with bridge(Dialect.ROS2) as (robot, connect), connect() as client:
        await client.send(
            op="call_service", id="1", service=service, args={"type": "std_msgs/Bool"}
        )
        await robot.let_pass(0.5)
        assert await client.all_before() == []


@both
async def test_every_topics_definition_is_told_in_full(dialect: Dialect) -> None:
    async with bridge(dialect) as (_, connect), connect() as client:
        told = await client.ask("topics_and_raw_types")
    texts = dict(zip(told["topics"], told["typedefs_full_text"], strict=True))
    assert all(texts.values())
    assert "MSG: geometry_msgs/Quaternion" in texts["/map"]
    is_ros1 = dialect is Dialect.ROS1
    assert ("float64[9] K" if is_ros1 else "float64[9] k") in texts["/camera/camera_info"]
    assert ("time stamp" if is_ros1 else "builtin_interfaces/Time stamp") in texts["/map"]


@pytest.mark.parametrize(
    ("dialect", "service"),
    [(Dialect.ROS1, "dynamic_map"), (Dialect.ROS2, "/slam_toolbox/dynamic_map")],
)
async def test_the_map_can_be_asked_for(dialect: Dialect, service: str) -> None:
    async with bridge(dialect) as (_, connect), connect() as client:
        answer = await client.call(service)
    assert read_grid(answer["values"]["map"]).resolution_m == 0.25


@both
@pytest.mark.parametrize(
    ("service", "args"),
    [
        ("/nowhere", {}),
        ("/rosapi/topic_type", {"topic": 7}),
        ("/rosapi/topic_type", [1, 2]),
        ("/rosapi/topic_type", "text"),
    ],
)
async def test_a_call_that_fails_says_why(dialect: Dialect, service: str, args: object) -> None:
    async with bridge(dialect) as (_, connect), connect() as client:
        await client.send(op="call_service", id="1", service=service, args=args)
        answer = await client.receive()
    assert (answer["id"], answer["result"]) == ("1", False)
    assert isinstance(answer["values"], str)
