"""One robot as a ROS of its own: its topics, services and actions, kept going by its clock."""

from collections.abc import Callable, Coroutine
from typing import Any

import anyio
import anyio.lowlevel
from anyio.abc import TaskGroup

from mapspeak.errors import MapspeakError
from mapspeak.robot import Robot
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.messages.grids import write_grid
from mapspeak.ros.messages.poses import read_twist
from mapspeak.rosbridge_server.drives import Drives
from mapspeak.rosbridge_server.graph import SLAM_NODES, Service, navigator_of, topics_of
from mapspeak.rosbridge_server.hub import Hub, Publication
from mapspeak.rosbridge_server.interfaces import Interfaces, RosSystem
from mapspeak.rosbridge_server.movebase import MoveBase
from mapspeak.rosbridge_server.nav2 import ACTION, Nav2
from mapspeak.rosbridge_server.parameters import Parameters, add_parameter_services
from mapspeak.rosbridge_server.rosapi import add_rosapi
from mapspeak.rosbridge_server.sources import TICK_S, Sources

STATUS_PERIOD_S = 0.2
FEEDBACK_PERIOD_S = 0.1


class RosStack(RosSystem):
    """What a robot and its ROS would be.

    Attributes:
        drives: The goals it was given.

    Args:
        robot: Any robot; its `sleep` must give way to other tasks.
        dialect: Which ROS to be.
        tasks: Where what takes long is done.
        hub: Carries the robot's topics; one is made of `topics_of` where none is given.
        drives: Takes the goals; likewise.
    """

    def __init__(
        self,
        robot: Robot,
        *,
        dialect: Dialect,
        tasks: TaskGroup,
        hub: Hub | None = None,
        drives: Drives | None = None,
    ) -> None:
        hub = hub or Hub(topics_of(dialect, robot.description))
        super().__init__(hub, Interfaces(dialect), dialect=dialect)
        self.drives = drives or Drives(robot)
        self._robot = robot
        self._tasks = tasks
        self._sources = Sources(robot, self.hub, dialect=dialect)
        self._move_base: MoveBase | None = None
        self._feedback_due_s = self._status_due_s = 0.0
        self._take("/cmd_vel", self._take_velocity)
        if dialect is Dialect.ROS2:
            self._add_nav2()
        else:
            self._add_move_base()
        self._add_map_service()
        parameters = Parameters.of_robot(dialect, radius_m=robot.description.radius_m)
        if dialect is Dialect.ROS2:
            add_parameter_services(self.services, parameters, self.interfaces)
        add_rosapi(self, parameters, lambda: robot.now_s)

    async def keep_going(self, *, task_status: anyio.abc.TaskStatus[None]) -> None:
        """Publish and watch the drives as robot time passes, until cancelled."""
        await self._sources.start()
        task_status.started()
        while True:
            await self._robot.sleep(TICK_S)
            # A robot whose time does not pass by itself must not keep others from their turn.
            await anyio.lowlevel.checkpoint()
            await self._sources.publish_due(self._tasks)
            await self._watch_drives()

    async def _watch_drives(self) -> None:
        now_s = self._robot.now_s
        if self._move_base is not None and now_s >= self._status_due_s:
            self._status_due_s = now_s + STATUS_PERIOD_S
            self._move_base.publish_status()
        is_idle = all(drive.is_over.is_set() for drive in self.drives.all)
        if is_idle or now_s < self._feedback_due_s:
            return
        self._feedback_due_s = now_s + FEEDBACK_PERIOD_S
        navigation = self.nav2 or self._move_base
        try:
            await self.drives.look()
            here = await self._robot.fetch_pose()
        except MapspeakError:
            return
        if navigation is not None:
            navigation.publish_feedback(here.pose)

    def _take(self, topic: str, handle: Callable[[Publication], Coroutine[Any, Any, None]]) -> None:
        """Let the robot act on a topic; whoever published does not wait for it."""

        def act(publication: Publication) -> None:
            self._tasks.start_soon(handle, publication)

        self.hub.take(topic, act)

    async def _take_velocity(self, publication: Publication) -> None:
        """Stop on zero; the port knows no other velocity, and what it cannot do it leaves."""
        try:
            if read_twist(publication.message).is_standing:
                await self._robot.stop()
                await self.drives.look()
        except MapspeakError:
            return

    def _add_nav2(self) -> None:
        self.nav2 = Nav2(self._robot, self.hub, self.drives)
        self._take("/goal_pose", self.nav2.take_goal_pose)
        self.services.add(
            Service(
                name=f"{ACTION}/_action/cancel_goal",
                type="action_msgs/CancelGoal",
                node=navigator_of(Dialect.ROS2),
                answer=self.interfaces.filled(
                    "action_msgs/CancelGoal_Request", self.nav2.cancel_goals
                ),
            )
        )

    def _add_move_base(self) -> None:
        self._move_base = MoveBase(self._robot, self.hub, self.drives)
        self._take("/move_base/goal", self._move_base.take_goal)
        self._take("/move_base/cancel", self._move_base.take_cancel)
        self._take("/move_base_simple/goal", self._move_base.take_simple_goal)

    def _add_map_service(self) -> None:
        async def give_map(_request: dict[str, Any]) -> dict[str, Any]:
            return {"map": write_grid(await self._robot.fetch_map(), dialect=self.dialect)}

        is_ros1 = self.dialect is Dialect.ROS1
        self.services.add(
            Service(
                name="/dynamic_map" if is_ros1 else "/slam_toolbox/dynamic_map",
                type="nav_msgs/GetMap",
                node=SLAM_NODES[self.dialect],
                answer=self.interfaces.filled("nav_msgs/GetMap_Request", give_map),
            )
        )
