"""A faulty robot behind a rosbridge that dies and comes back while the robot lives."""

from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager

import anyio
from anyio.abc import TaskGroup

from fakes import two_rooms
from faulty import Faults, FaultyRobot, Velocity
from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.ros.messages.fields import Dialect, Message
from mapspeak.ros.messages.poses import Twist, read_twist, write_twist
from mapspeak.rosbridge_server.hub import Hub, Publication, Topic
from mapspeak.rosbridge_server.navigation import Drives, ServedDrive
from mapspeak.rosbridge_server.serving import listen
from mapspeak.rosbridge_server.stack import NAVIGATORS, SLAM_NODES, RosStack, topics_of
from mapspeak.spatial import OccupancyGrid

START = Pose(1.5, 1.4)
NEXT_ROOM = Pose(6.0, 1.4)


class FaultyHub(Hub):
    """Topics of nodes that die: a name stays while anyone publishes or hears it, as in ROS.

    Attributes:
        dead: The nodes that do not run now.
    """

    def __init__(self, topics: list[Topic], faults: Faults, *, slam: str) -> None:
        super().__init__(topics)
        self.dead: set[str] = set()
        self._faults = faults
        self._slam = slam

    @property
    def topics(self) -> list[Topic]:
        return [
            topic
            for topic in super().topics
            if self.publishers_of(topic) or self.subscribers_of(topic)
        ]

    def publish(self, name: str, message: Message) -> None:
        topic = self.find(name)
        nodes = topic.publishers if topic is not None else ()
        if name in self._faults.silent or not self._runs_any(nodes):
            return
        if name == "/tf" and self._slam in self.dead and _parent_of(message) == "map":
            return
        super().publish(name, message)

    def take(self, name: str, taker: Callable[[Publication], None]) -> None:
        topic = self.find(name)
        nodes = topic.subscribers if topic is not None else ()

        def take_if_alive(publication: Publication) -> None:
            if self._runs_any(nodes):
                taker(publication)

        super().take(name, take_if_alive)

    def publishers_of(self, topic: Topic) -> list[str]:
        return [node for node in super().publishers_of(topic) if node not in self.dead]

    def subscribers_of(self, topic: Topic) -> list[str]:
        return [node for node in super().subscribers_of(topic) if node not in self.dead]

    def _runs_any(self, nodes: tuple[str, ...]) -> bool:
        """Tell whether one of them runs; what no node owns is clients' alone."""
        return not nodes or not self.dead.issuperset(nodes)


def _parent_of(message: Message) -> str:
    return str(message["transforms"][0]["header"]["frame_id"])


class FaultyDrives(Drives):
    """Goals that are accepted as late as the robot's navigation accepts them."""

    def __init__(self, robot: FaultyRobot) -> None:
        super().__init__(robot)
        self._faulty = robot

    async def start(self, goal: Pose, *, goal_id: str | None = None) -> ServedDrive:
        await self._faulty.accept()
        return await super().start(goal, goal_id=goal_id)

    async def cancel(self, drive: ServedDrive) -> None:
        if not self._faulty.faults.ignores_cancels:
            await super().cancel(drive)

    def forget(self) -> None:
        self._drives.clear()


class FaultyStack(RosStack):
    """The robot's ROS, whose nodes can die and come back."""

    def __init__(self, robot: FaultyRobot, *, dialect: Dialect) -> None:
        self._faulty = robot
        self._nodes = FaultyHub(
            topics_of(dialect, robot.description), robot.faults, slam=SLAM_NODES[dialect]
        )
        self._goals = FaultyDrives(robot)
        super().__init__(robot, dialect=dialect, hub=self._nodes, drives=self._goals)
        self._offered = self.services
        robot.publish_velocity = self._publish_velocity

    @property
    def navigator(self) -> str:
        return NAVIGATORS[self.dialect]

    @property
    def slam(self) -> str:
        return SLAM_NODES[self.dialect]

    def kill(self, node: str) -> None:
        """End a node: its topics and services are gone, and what it was about to say too."""
        self._nodes.dead.add(node)
        for service in self._offered:
            if service.node == node:
                self._services.pop(service.name, None)
        if node == self.navigator:
            self._faulty.kill_navigation()

    def start(self, node: str) -> None:
        """Start a node again; navigation knows none of its goals any more."""
        self._nodes.dead.discard(node)
        for service in self._offered:
            if service.node == node:
                self._services[service.name] = service
        if node == self.navigator:
            self._goals.forget()
            self._faulty.restart_navigation()

    def jump_to(self, now_s: float) -> None:
        """Set the clock."""
        self._faulty.jump_to(now_s)

    async def _watch_drives(self) -> None:
        if not self._faulty.faults.feeds_back:
            self._feedback.is_due(self._faulty.now_s)
        if self._faulty.is_navigation_alive:
            await super()._watch_drives()

    async def _take_velocity(self, publication: Publication) -> None:
        try:
            twist = read_twist(publication.message)
        except LinkError:
            return
        self._faulty.hear_velocity((twist.forward_mps, twist.turn_radps))

    def _publish_velocity(self, velocity: Velocity) -> None:
        forward_mps, turn_radps = velocity
        twist = Twist(forward_mps=forward_mps, left_mps=0.0, turn_radps=turn_radps)
        self.hub.publish("/cmd_vel", write_twist(twist))


class FaultyBridge:
    """A robot with its ROS, and a rosbridge that can be ended and started at the same address.

    Attributes:
        robot: Its base knows the truth, its faults can be changed.
        ros: Its nodes can be killed and started.
        port: Where the rosbridge listens, whenever it runs.
    """

    def __init__(self, robot: FaultyRobot, ros: FaultyStack, tasks: TaskGroup) -> None:
        self.robot = robot
        self.ros = ros
        self.port = 0
        self._tasks = tasks
        self._running: anyio.CancelScope | None = None
        self._has_ended = anyio.Event()

    @property
    def url(self) -> str:
        return f"ws://127.0.0.1:{self.port}"

    async def open(self) -> None:
        """Start the rosbridge; return when clients may come."""
        await self._tasks.start(self._serve)

    async def close(self) -> None:
        """Kill the rosbridge, as `kill -9` does; the robot does not notice."""
        if self._running is not None:
            self._running.cancel()
            await self._has_ended.wait()

    async def _serve(self, *, task_status: anyio.abc.TaskStatus[None]) -> None:
        self._has_ended = anyio.Event()
        try:
            with anyio.CancelScope() as self._running:
                async with listen(self.ros, port=self.port, goals_in_new_thread=False) as server:
                    self.port = server.port
                    task_status.started()
                    await anyio.sleep_forever()
        finally:
            self._has_ended.set()


@asynccontextmanager
async def open_faulty_bridge(
    dialect: Dialect,
    *,
    grid: OccupancyGrid | None = None,
    pose: Pose = START,
    speed_mps: float = 0.5,
    rate: float = 1.0,
    faults: Faults | None = None,
) -> AsyncGenerator[FaultyBridge]:
    """Run a faulty robot behind a rosbridge while the context lasts.

    Args:
        dialect: Which ROS to be; on ROS 2 its rosbridge is as 2.1, which tells no rejection.
        grid: The map; two rooms where none is given.
        pose: Where the robot starts.
        speed_mps: How fast it drives to goals.
        rate: How much faster than the wall clock its time passes.
        faults: What is wrong from the start; it can be changed later by `robot.faults`.
    """
    robot = FaultyRobot(
        grid or two_rooms(), pose=pose, speed_mps=speed_mps, rate=rate, faults=faults
    )
    async with anyio.create_task_group() as tasks:
        ros = FaultyStack(robot, dialect=dialect)
        await tasks.start(ros.keep_going)
        tasks.start_soon(robot.run)
        bridge = FaultyBridge(robot, ros, tasks)
        await bridge.open()
        yield bridge
        tasks.cancel_scope.cancel()
