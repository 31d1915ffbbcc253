"""What is asked of a robot's ROS, in both dialects, over our own rosbridge server."""

from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from pathlib import Path

from bridging import SteppedRobot
from fakes import two_rooms
from goldens.transcript import Transcript, playing
from mapspeak.links.rosbridge import RobotAddress, open_client
from mapspeak.ros.messages.fields import Dialect
from mapspeak.rosbridge_server import open_rosbridge_server
from rosserved import QUICK

TOPICS = ("/map", "/tf", "/odom", "/scan", "/cmd_vel", "/camera/image_raw/compressed", "/nosuch")
TYPES = (
    "nav_msgs/Odometry",
    "geometry_msgs/Twist",
    "sensor_msgs/LaserScan",
    "std_srvs/Trigger",
    "nav2_msgs/action/NavigateToPose",
    "move_base_msgs/MoveBaseAction",
    "no_msgs/Nothing",
)


@asynccontextmanager
async def ros_robot(dialect: Dialect, folder: Path) -> AsyncGenerator[Transcript]:
    """Offer the transcript of a robot that stands still, with the tools of its ROS."""
    robot = SteppedRobot(two_rooms())
    async with (
        open_rosbridge_server(robot, dialect=dialect) as server,
        open_client(RobotAddress(url=server.url), patience=QUICK) as client,
        playing(robot, folder, toolsets=("drive", "ros"), ros=client, is_paced=True) as play,
    ):
        yield play


async def inspect(play: Transcript) -> None:
    """Ask for everything that the ROS has, and tell it a few things, right and wrong."""
    await play.call("ros_overview")
    for tool in ("ros_topics", "ros_services", "ros_actions", "ros_nodes"):
        await play.call(tool)
        await play.call(tool, filter="map")
        await play.call(tool, page=9)
    await play.call("ros_topics", ends=True)
    for topic in TOPICS:
        await play.call("ros_topic", topic=topic)
    for name in TYPES:
        await play.call("ros_type", type=name)
    for topic in ("/map", "/nosuch"):
        await play.call("ros_read", topic=topic, wait_s=2.0)
    for node in ("/rosapi", "/move_base", "/bt_navigator", "/nosuch"):
        await play.call("ros_node", node=node)
        await play.call("ros_parameters", node=node)
    for service in ("/rosapi/topics", "/nosuch"):
        await play.call("ros_service", service=service)
    for action in ("/navigate_to_pose", "/move_base", "/nosuch"):
        await play.call("ros_action", action=action)
    await play.call("ros_set_parameter", node="/nosuch", parameter="a", value=1)
    await command(play)
    await play.call("stop_robot")


async def command(play: Transcript) -> None:
    """Publish, call and send goals: what is allowed, what is denied, what fits no type."""
    half = {"linear": {"x": 0.1}}
    await play.call("ros_publish", topic="/cmd_vel", message=half)
    await play.call("ros_publish", topic="/cmd_vel", message={"linear": {"x": 99.0}}, duration_s=1)
    await play.call("ros_publish", topic="/cmd_vel", message={"linear": 1.0}, duration_s=1)
    await play.call("ros_publish", topic="/initialpose", message={})
    await play.call("ros_publish", topic="/news", message={"data": "x"}, type="std_msgs/String")
    await play.call("ros_call", service="/slam_toolbox/dynamic_map", arguments={"odd": 1})
    await play.call("ros_call", service="/rosapi/get_time")
    await play.call("ros_send_goal", action="/navigate_to_pose", goal={})
    await play.call("ros_send_goal", action="/spin", goal={})
    await play.call("ros_goal_status")
    await play.call("ros_cancel_goal")
