"""A scripted robot behind a scripted rosbridge: what it offers and answers is set by each test."""

from collections.abc import AsyncGenerator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager
from typing import Any

import anyio

from mapspeak.geometry import Pose
from mapspeak.links.rosbridge import open_rosbridge_robot
from mapspeak.links.rosbridge.protocol.codec import to_cbor
from mapspeak.ros.discovery.overrides import RobotOverrides
from mapspeak.ros.link import Patience
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.messages.grids import write_grid
from mapspeak.ros.messages.poses import FrameTransform, write_transforms
from mapspeak.ros.robot import RosRobot
from mapspeak.spatial import OccupancyGrid
from rosbridge_script import PATIENCE_S, Operation, ScriptedServer, Visitor, running

STATUS_TOPIC = "/navigate_to_pose/_action/status"
CANCEL_SERVICE = "/navigate_to_pose/_action/cancel_goal"
TOPICS_OF_ROS2 = {
    "/map": "nav_msgs/msg/OccupancyGrid",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/cmd_vel": "geometry_msgs/msg/Twist",
}
TOPICS_OF_ROS1 = {
    "/map": "nav_msgs/OccupancyGrid",
    "/tf": "tf2_msgs/TFMessage",
    "/cmd_vel": "geometry_msgs/Twist",
    "/move_base/goal": "move_base_msgs/MoveBaseActionGoal",
}
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6

Service = Callable[[Operation], object]


class ScriptedRobot:
    """Topics with their latched messages, services, and goals that end when a test says so."""

    def __init__(self, *, ros: int = 2, actions: tuple[str, ...] = ("/navigate_to_pose",)) -> None:
        self.dialect = Dialect.ROS1 if ros == 1 else Dialect.ROS2
        self.topics = dict(TOPICS_OF_ROS1 if ros == 1 else TOPICS_OF_ROS2)
        self.latched: dict[str, Mapping[str, Any]] = {"/tf": self.transforms(Pose(1.0, 2.0, 0.5))}
        self.services: dict[str, Service] = {
            "/rosapi/topics": lambda _: {
                "topics": list(self.topics),
                "types": list(self.topics.values()),
            },
            "/rosapi/get_time": lambda _: {"time": {"sec": 100, "nanosec": 0}},
        }
        if ros == 2:
            self.services["/rosapi/get_ros_version"] = lambda _: {"version": 2, "distro": "jazzy"}
            self.services["/rosapi/action_servers"] = lambda _: {"action_servers": list(actions)}
            self.services[CANCEL_SERVICE] = lambda _: {"return_code": 0}
        self.n_silent: dict[str, int] = {}
        """How many subscriptions to a topic get nothing latched."""
        self.accepts_goals = True
        self.goals: list[tuple[Visitor, Operation]] = []
        self.statuses: dict[str, int] = {}
        self.server = ScriptedServer(
            {
                "call_service": self._answer,
                "subscribe": self._give_latched,
                "send_action_goal": self._take_goal,
            }
        )

    def transforms(self, map_from_base: Pose) -> dict[str, Any]:
        """A whole tree in one message: map, odom, base_footprint."""
        return write_transforms(
            [
                FrameTransform(
                    parent_from_child=Pose(0.0, 0.0), parent="map", child="odom", stamp_s=7.0
                ),
                FrameTransform(
                    parent_from_child=map_from_base,
                    parent="odom",
                    child="base_footprint",
                    stamp_s=8.0,
                ),
            ],
            dialect=self.dialect,
        )

    def map_message(self, grid: OccupancyGrid) -> dict[str, Any]:
        return write_grid(grid, dialect=self.dialect)

    async def publish(self, topic: str, message: Mapping[str, Any]) -> None:
        await self.server.publish(topic, message)

    async def feed_back(self, distance_left_m: float, *, goal: int = -1) -> None:
        visitor, operation = self.goals[goal]
        values = {"distance_remaining": distance_left_m, "number_of_recoveries": 1}
        await visitor.send(
            {
                "op": "action_feedback",
                "action": operation["action"],
                "id": operation["id"],
                "values": values,
            }
        )

    async def end_goal(
        self,
        status: int,
        *,
        goal: int = -1,
        error: str = "",
        is_result: bool = True,
        values: dict[str, Any] | None = None,
    ) -> None:
        visitor, operation = self.goals[goal]
        await visitor.send(
            {
                "op": "action_result",
                "action": operation["action"],
                "id": operation["id"],
                "status": status,
                "result": is_result,
                "values": values or {"error_code": 103 if error else 0, "error_msg": error},
            }
        )

    async def tell_status(self, ros_id: bytes, status: int) -> None:
        """Publishes how all goals stand, one of them changed; latched, as Nav2 does."""
        self.statuses[ros_id.hex()] = status
        self.latched[STATUS_TOPIC] = {
            "status_list": [
                {"goal_info": {"goal_id": {"uuid": list(bytes.fromhex(key))}}, "status": value}
                for key, value in self.statuses.items()
            ]
        }
        await self.publish(STATUS_TOPIC, self.latched[STATUS_TOPIC])

    async def until(self, is_true: Callable[[], object]) -> None:
        await self.server.until(is_true)

    async def _answer(self, visitor: Visitor, call: Operation) -> None:
        service = self.services.get(call["service"])
        if service is None:
            reason = f"Service {call['service']} does not exist"
            await visitor.answer(call, reason, is_success=False)
            return
        values = service(call)
        if values is not None:
            await visitor.answer(call, values)

    async def _give_latched(self, visitor: Visitor, operation: Operation) -> None:
        message = self.latched.get(operation["topic"])
        self.n_silent[operation["topic"]] = self.n_silent.get(operation["topic"], 0) - 1
        if message is None or self.n_silent[operation["topic"]] >= 0:
            return
        if operation.get("compression") == "cbor":
            published = {"op": "publish", "topic": operation["topic"], "msg": message}
            await visitor.send_binary(to_cbor(published))
        else:
            await visitor.publish(operation["topic"], message)

    async def _take_goal(self, visitor: Visitor, operation: Operation) -> None:
        self.goals.append((visitor, operation))
        self.server.tell()
        if self.accepts_goals:
            await self.feed_back(3.0)


@asynccontextmanager
async def connect_scripted(
    scripted: ScriptedRobot,
    *,
    patience: Patience,
    overrides: RobotOverrides | None = None,
) -> AsyncGenerator[RosRobot]:
    """Gives the robot that a scripted rosbridge plays; all of it has to be over in time."""
    with anyio.fail_after(PATIENCE_S):
        async with (
            running(scripted.server) as server,
            open_rosbridge_robot(
                server.url,
                overrides=overrides or RobotOverrides(),
                patience=patience,
            ) as robot,
        ):
            yield robot


async def eventually(look: Callable[[], Awaitable[object]]) -> None:
    """Asks again and again until the answer is yes."""
    with anyio.fail_after(PATIENCE_S):
        while not await look():
            await anyio.lowlevel.checkpoint()
