"""The ROS tools that change something: publishing, calling, setting; checked before it is sent."""

from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import anyio
import pytest

from bridging import SteppedRobot
from fakes import two_rooms
from guarding import make_guard
from mapspeak.links.rosbridge import RobotAddress, open_client
from mapspeak.ros.messages.fields import Dialect
from mapspeak.rosbridge_server import open_rosbridge_server
from mapspeak.safety import Policy
from rosbridge_robot import ScriptedRobot
from rosserved import Caller, at_time, on_our_server, on_script, served

pytestmark = pytest.mark.anyio
both = pytest.mark.parametrize("dialect", Dialect)
FORWARD = {"linear": {"x": 0.2}}
STAND = {"linear": {"x": 0.0}}


def listening(scripted: ScriptedRobot) -> ScriptedRobot:
    scripted.services["/rosapi/subscribers"] = lambda _: {"subscribers": ["/robot_base"]}
    return scripted


def published(scripted: ScriptedRobot, topic: str = "/cmd_vel") -> list[Any]:
    return [each["msg"] for each in scripted.server.asked("publish") if each["topic"] == topic]


# --- velocities


async def test_publishing_a_velocity_for_a_time_ends_when_it_says_with_a_stand(
    tmp_path: Path,
) -> None:
    scripted = listening(ScriptedRobot())
    async with on_script(scripted, tmp_path) as caller:
        text = await caller.ask(
            "ros_publish", topic="/cmd_vel", fields=FORWARD, duration_s=0.2, rate_hz=20
        )
        messages = published(scripted)
    assert "Published 4 times in 0.2" in text
    assert "then a stand" in text
    assert "Heard by: /robot_base" in text
    assert [each for each in messages if each == FORWARD] == [FORWARD] * 4
    assert messages[4:]
    assert all(each == STAND for each in messages[4:]), "nothing moves after the stand"


async def test_nothing_is_published_before_the_robot_knows_that_somebody_will(
    tmp_path: Path,
) -> None:
    scripted, before = listening(ScriptedRobot()), list[int]()

    def tell(_: object) -> dict[str, list[str]]:
        before.append(len(published(scripted)))
        return {"publishers": ["/rosbridge_websocket"] if len(before) > 2 else []}

    scripted.services["/rosapi/publishers"] = tell
    async with on_script(scripted, tmp_path) as caller:
        await caller.ask("ros_publish", topic="/cmd_vel", fields=STAND)
        await scripted.until(lambda: published(scripted))
    assert before == [0, 0, 0]


async def test_after_a_loss_a_topic_is_advertised_and_noticed_again_before_a_message(
    tmp_path: Path,
) -> None:
    scripted, known = listening(ScriptedRobot()), list[bool]()

    def tell(_: object) -> dict[str, list[str]]:
        is_known = any(each.asked("advertise") for each in scripted.server.present)
        known.append(is_known)
        return {"publishers": ["/rosbridge_websocket"] if is_known else []}

    scripted.services["/rosapi/publishers"] = tell
    async with at_time(scripted, tmp_path, 0.0) as (client, caller):
        await caller.ask("ros_publish", topic="/cmd_vel", fields=STAND)
        known.clear()
        await scripted.server.drop_all()
        while client.n_connections < 2:
            await anyio.lowlevel.checkpoint()
        await caller.ask("ros_publish", topic="/cmd_vel", fields=STAND)
        await scripted.until(lambda: len(published(scripted)) == 2)
        latest = next(each for each in scripted.server.present if each.asked("publish"))
    assert known[-1:] == [True]
    asked = [each["op"] for each in latest.operations if each.get("topic") == "/cmd_vel"]
    assert asked.index("advertise") < asked.index("publish")


async def test_a_velocity_without_an_end_is_refused(tmp_path: Path) -> None:
    scripted = listening(ScriptedRobot())
    async with on_script(scripted, tmp_path) as caller:
        text = await caller.refuse("ros_publish", topic="/cmd_vel", fields={"linear": {"x": 99}})
        await caller.ask("ros_publish", topic="/cmd_vel", fields=STAND)
        await scripted.until(lambda: published(scripted))
    assert "Give duration_s" in text
    assert published(scripted) == [STAND]


async def test_a_call_that_is_given_up_leaves_the_robot_standing(tmp_path: Path) -> None:
    scripted = listening(ScriptedRobot())
    async with on_script(scripted, tmp_path) as caller:
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(publish_long, caller)
            await scripted.until(lambda: FORWARD in published(scripted))
            tasks.cancel_scope.cancel()
        await scripted.until(lambda: published(scripted)[-1] == STAND)


async def test_stopping_the_robot_ends_what_is_being_published(tmp_path: Path) -> None:
    scripted = listening(ScriptedRobot())
    said: list[str] = []
    async with on_script(scripted, tmp_path) as caller, anyio.create_task_group() as tasks:

        async def publish() -> None:
            said.append(await publish_long(caller))

        tasks.start_soon(publish)
        await scripted.until(lambda: FORWARD in published(scripted))
        await caller.ask("stop_robot")
    assert "until the robot was stopped, then a stand" in said[0]
    assert published(scripted)[-1] == STAND


async def publish_long(caller: Caller) -> str:
    return await caller.ask(
        "ros_publish", topic="/cmd_vel", fields=FORWARD, duration_s=20, rate_hz=50
    )


@both
async def test_the_robot_hears_what_is_published(dialect: Dialect, tmp_path: Path) -> None:
    async with on_our_server(dialect, tmp_path) as (robot, caller):
        text = await caller.ask(
            "ros_publish", topic="cmd_vel", fields=FORWARD, duration_s=0.1, rate_hz=50
        )
    assert "Heard by: /robot_base" in text
    assert robot.n_stops >= 1, "the stand at the end is what our robot understands"


# --- what is checked


@both
@pytest.mark.parametrize(
    ("message", "said"),
    [
        ({"linear": {"x": "fast"}}, "linear.x wants a number (float64), not 'fast'"),
        ({"liner": {"x": 1.0}}, "no field 'liner'. Did you mean linear?"),
        ({"linear": {"forward": 1.0}}, "no field 'linear.forward'"),
        ({"linear": 1.0}, "linear wants an object of type geometry_msgs/Vector3, not 1.0"),
        ({"angular": {"z": True}}, "angular.z wants a number (float64), not True"),
    ],
)
async def test_a_message_that_does_not_fit_is_refused_with_its_path(
    dialect: Dialect, tmp_path: Path, message: dict[str, Any], said: str
) -> None:
    async with on_our_server(dialect, tmp_path) as (_, caller):
        text = await caller.refuse("ros_publish", topic="/cmd_vel", fields=message, duration_s=1)
    assert said in text


async def test_numbers_that_are_none_are_refused(tmp_path: Path) -> None:
    scripted = listening(ScriptedRobot())
    async with on_script(scripted, tmp_path) as caller:
        for odd in (float("nan"), float("inf")):
            message = {"linear": {"x": odd}}
            text = await caller.refuse(
                "ros_publish", topic="/cmd_vel", fields=message, duration_s=1
            )
            assert "linear.x wants a" in text
    assert published(scripted) == []


@both
async def test_a_topic_has_one_type(dialect: Dialect, tmp_path: Path) -> None:
    async with on_our_server(dialect, tmp_path) as (_, caller):
        text = await caller.refuse(
            "ros_publish", topic="/cmd_vel", fields={"data": "x"}, type="std_msgs/msg/String"
        )
        unknown = await caller.refuse("ros_publish", topic="/cmd_val", fields=FORWARD)
        new = await caller.ask(
            "ros_publish", topic="/chat", fields={"data": "x"}, type="std_msgs/msg/String"
        )
    assert f"/cmd_vel is a {dialect.type_name('geometry_msgs/Twist')}, not a std_msgs" in text
    assert "/cmd_vel" in unknown
    assert "Published once on /chat. Heard by: nobody." in new


# --- services and parameters


async def test_a_service_that_fails_is_an_error_with_its_words(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    scripted.services["/rosapi/service_type"] = lambda _: {"type": "std_srvs/srv/SetBool"}
    async with on_script(scripted, tmp_path) as caller:
        gone = await caller.refuse(
            "ros_call", service="/lamp", fields={"data": True}, timeout_s=0.1
        )
        wrong = await caller.refuse("ros_call", service="/lamp", fields={"data": 1})
        scripted.services["/lamp"] = lambda _: {"success": True, "message": "on"}
        answer = await caller.ask("ros_call", service="/lamp", fields={"data": True})
    assert "/lamp does not exist" in gone
    assert "data wants true or false (bool), not 1" in wrong
    assert 'success: true\nmessage: "on"' in answer


@both
async def test_the_services_of_rosapi_itself_are_called(dialect: Dialect, tmp_path: Path) -> None:
    async with on_our_server(dialect, tmp_path) as (_, caller):
        answer = await caller.ask(
            "ros_call", service="/rosapi/topic_type", fields={"topic": "/map"}
        )
        details = await caller.ask("ros_service", service="/rosapi/message_details")
        parameter = await caller.ask("ros_service", service="/rosapi/get_param")
    assert dialect.type_name("nav_msgs/OccupancyGrid") in answer
    assert "fieldnames: string[]" in details
    assert ("  default: string" in parameter) is (dialect is Dialect.ROS1)


async def test_a_service_that_rosbridge_finds_later_than_rosapi_is_called_all_the_same(
    tmp_path: Path,
) -> None:
    scripted = ScriptedRobot()
    looks = list[object]()

    def tell(call: object) -> dict[str, str]:
        looks.append(call)
        if len(looks) == 3:
            scripted.services["/lamp"] = lambda _: {"success": True, "message": "on"}
        return {"type": "std_srvs/srv/SetBool"}

    scripted.services["/rosapi/service_type"] = tell
    async with on_script(scripted, tmp_path) as caller:
        answer = await caller.ask("ros_call", service="/lamp", fields={"data": True})
    assert "success: true" in answer


async def test_a_service_that_never_answers_holds_up_nobody(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    scripted.services["/rosapi/service_type"] = lambda _: {"type": "std_srvs/srv/Trigger"}
    scripted.services["/hang"] = lambda _: None
    async with on_script(scripted, tmp_path) as caller:
        text = await caller.refuse("ros_call", service="/hang", timeout_s=0.2)
        assert "/hang" in text
        await caller.ask("ros_topics")


@both
async def test_parameters_are_listed_set_and_deleted(dialect: Dialect, tmp_path: Path) -> None:
    async with on_our_server(dialect, tmp_path) as (_, caller):
        listed = await caller.ask("ros_parameters", node="/robot_base")
        changed = await caller.ask(
            "ros_set_parameter", node="/robot_base", parameter="robot_radius", value=0.3
        )
        after = await caller.ask("ros_parameters", node="/robot_base", filter="robot_radius")
        none = await caller.ask("ros_parameters", node="/robot_base", filter="colour")
        missing = await caller.refuse(
            "ros_set_parameter", node="/robot_base", parameter="colour", value=None
        )
    assert "robot_radius: 0.2" in listed
    assert "was 0.2, is 0.3 now" in changed
    assert "robot_radius: 0.3" in after
    assert none.startswith("parameters of /robot_base: 0 of ")
    assert "has no parameter 'colour'" in missing


@both
async def test_a_misspelt_node_is_not_made_up(dialect: Dialect, tmp_path: Path) -> None:
    async with on_our_server(dialect, tmp_path) as (_, caller):
        await caller.refuse(
            "ros_set_parameter", node="/robot_bas", parameter="robot_radius", value=0.3
        )


async def test_ros_2_makes_up_no_parameter(tmp_path: Path) -> None:
    async with on_our_server(Dialect.ROS2, tmp_path) as (_, caller):
        text = await caller.refuse(
            "ros_set_parameter", node="/robot_base", parameter="robot_radios", value=0.3
        )
    assert "such as robot_radius" in text


async def test_ros_1_makes_a_parameter_and_says_that_it_is_new(tmp_path: Path) -> None:
    async with on_our_server(Dialect.ROS1, tmp_path) as (_, caller):
        text = await caller.ask(
            "ros_set_parameter", node="/robot_base", parameter="robot_radios", value=0.3
        )
        assert "robot_radios: 0.3" in await caller.ask("ros_parameters", node="/robot_base")
    assert "It is new: the nearest that it had is robot_radius." in text
    assert "started again" in text


async def test_ros_1_keeps_the_kind_of_a_parameter(tmp_path: Path) -> None:
    asked = {"node": "/robot_base", "parameter": "robot_radius"}
    async with on_our_server(Dialect.ROS1, tmp_path) as (_, caller):
        text = await caller.refuse("ros_set_parameter", **asked, value="wide")
        whole = await caller.ask("ros_set_parameter", **asked, value=1)
    assert "is a number (0.2), not a text" in text
    assert "is 1 now" in whole


async def test_ros_2_describes_its_parameters(tmp_path: Path) -> None:
    async with on_our_server(Dialect.ROS2, tmp_path) as (_, caller):
        text = await caller.ask("ros_parameters", node="/robot_base", filter="robot_radius")
    assert "robot_radius: 0.2 (double" in text


async def test_ros_1_forgets_a_parameter(tmp_path: Path) -> None:
    async with on_our_server(Dialect.ROS1, tmp_path) as (_, caller):
        await caller.ask("ros_set_parameter", node="/", parameter="speed", value=1.5)
        assert "speed: 1.5" in await caller.ask("ros_parameters", node="/")
        await caller.ask("ros_set_parameter", node="/", parameter="speed", value=None)
        assert "speed" not in await caller.ask("ros_parameters", node="/")


# --- what the operator allows


async def test_a_speed_above_the_operators_limit_is_refused_and_the_robot_left_standing(
    tmp_path: Path,
) -> None:
    scripted = listening(ScriptedRobot())
    guard = make_guard(tmp_path)
    async with on_script(scripted, tmp_path, guard=guard) as caller:
        message = {"linear": {"x": 99.0}}
        text = await caller.refuse("ros_publish", topic="/cmd_vel", fields=message, duration_s=1)
        await caller.ask("ros_publish", topic="/cmd_vel", fields=STAND)
    assert "99 m/s" in text
    assert all(each == STAND for each in published(scripted))


@both
@pytest.mark.parametrize(
    ("node", "parameter", "value"),
    [
        ("/slam_toolbox", "base_frame", "base_lnk"),
        ("/robot_base", "use_sim_time", False),
        ("/slam_toolbox", "scan_topic", "/nothing"),
        ("/robot_base", "robot_radius", 0.1),
    ],
)
async def test_parameters_with_which_a_robot_loses_itself_are_denied(
    dialect: Dialect, tmp_path: Path, node: str, parameter: str, value: object
) -> None:
    async with guarded_server(dialect, tmp_path, Policy()) as caller:
        text = await caller.refuse("ros_set_parameter", node=node, parameter=parameter, value=value)
    assert "The policy denies this: set " in text
    assert "(set_parameter.usual_denials: *" in text


async def test_what_may_be_set_may_be_deleted(tmp_path: Path) -> None:
    async with guarded_server(Dialect.ROS1, tmp_path, Policy()) as caller:
        await caller.ask("ros_set_parameter", node="/", parameter="colour", value="red")
        text = await caller.ask("ros_set_parameter", node="/", parameter="colour", value=None)
        await caller.ask("ros_set_parameter", node="/", parameter="lamp", value="red")
        denied = await caller.refuse(
            "ros_set_parameter", node="/", parameter="use_sim_time", value=None
        )
    assert text == "colour of / is deleted."
    assert "delete /:use_sim_time (set_parameter.usual_denials: *use_sim_time)" in denied


async def test_what_is_denied_is_said_before_anything_else_is_wrong_with_it(
    tmp_path: Path,
) -> None:
    scripted = ScriptedRobot()
    scripted.services["/rosapi/service_type"] = lambda _: {"type": "odd_msgs/srv/Odd"}
    async with on_script(scripted, tmp_path, guard=make_guard(tmp_path)) as caller:
        called = await caller.refuse("ros_call", service="/base/shutdown")
        published = await caller.refuse("ros_publish", topic="/map", fields={"odd": 1})
        sent = await caller.refuse("ros_send_goal", action="/navigate_to_pose", fields={"x": 1})
        nowhere = await caller.refuse("ros_publish", topic="/initialpose", fields={})
        gone = await caller.refuse("ros_call", service="/reinitialize_global_localization")
    assert "(call.usual_denials: *shutdown*)" in called
    assert "(publish.usual_denials: */map)" in published
    assert "(act.usual_denials: *navigate*)" in sent
    assert "publish anything on /initialpose (publish.usual_denials: */initialpose)" in nowhere
    assert "(call.usual_denials: *global_localization*)" in gone
    assert "()" not in called + published + sent + nowhere + gone


async def test_parameters_are_read_under_a_policy_that_lets_nothing_be_called(
    tmp_path: Path,
) -> None:
    async with guarded_server(Dialect.ROS2, tmp_path, Policy(is_read_only=True)) as caller:
        text = await caller.ask("ros_parameters", node="/robot_base")
    assert "robot_radius: 0.2" in text


@asynccontextmanager
async def guarded_server(dialect: Dialect, folder: Path, policy: Policy) -> AsyncGenerator[Caller]:
    """Gives what calls the tools of a robot behind our own server, under a policy."""
    guard = make_guard(folder, policy)
    async with (
        open_rosbridge_server(SteppedRobot(two_rooms()), dialect=dialect) as server,
        open_client(RobotAddress(url=server.url)) as client,
        served(SteppedRobot(two_rooms()), client, folder, guard=guard) as caller,
    ):
        yield caller
