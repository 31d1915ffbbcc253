"""A ROS 2 system over rclpy, as one of its nodes sees it."""

from collections.abc import AsyncGenerator, Callable, Coroutine, Mapping
from contextlib import asynccontextmanager, suppress
from typing import Any, Protocol

import anyio
from anyio.abc import TaskGroup
from anyio.from_thread import BlockingPortal

from mapspeak.errors import LinkError
from mapspeak.links.rclpy.calls import Goals, RclpyServices
from mapspeak.links.rclpy.graph import RclpyGraph
from mapspeak.links.rclpy.participant import RclpyParticipant, errors_of_ros, wait_until
from mapspeak.links.rclpy.topics import RclpyTopics
from mapspeak.ros.activity import ActionGoal
from mapspeak.ros.link import plain_errors
from mapspeak.ros.messages.fields import Message
from mapspeak.ros.port import LinkKind, LinkName, NodeLinks, RosGraph

ANSWER_S = 5.0
"""For a service's answer, where the caller says nothing else, and for a first node."""
FIRST_SIGN_S = 5.0
"""For the first node of others to be found before we begin without.

A call that is lost on a busy machine comes again after three seconds: so Fast DDS has it.
"""
QUIET_S = 0.3
"""Without anything new, after which all that is there counts as found."""
LONGEST_LOOK_S = 3.0
WATCH_S = 0.2
"""Between two looks at who reads and writes what."""
HINT = (
    "Check that the robot runs ROS 2, that its ROS_DOMAIN_ID and RMW_IMPLEMENTATION are those of "
    "mapspeak (--robot ros2:DOMAIN), and that `ros2 node list` on this machine shows it."
)


class Ros2Connection(RclpyGraph, RclpyTopics):
    """One ROS 2 system, as our node in it sees it.

    Args:
        distro: Such as "jazzy"; empty where that is unknown.
    """

    def __init__(self, participant: RclpyParticipant, tasks: TaskGroup, *, distro: str) -> None:
        super().__init__(participant)
        self._distro = distro
        self._tasks = tasks
        self._found_s: float | None = None
        self._services = RclpyServices(participant)
        self._goals = Goals(participant, self._services, start_soon=self.start_soon)

    @property
    def link(self) -> LinkName:
        """How we are connected."""
        return LinkName(LinkKind.RCLPY, self._participant.place)

    @property
    def is_open(self) -> bool:
        """True: who reads what we publish is another matter."""
        return True

    @property
    def connected_for_s(self) -> float | None:
        """Since when others have been found, in wall time; None before."""
        return None if self._found_s is None else anyio.current_time() - self._found_s

    def start_soon(self, work: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Run something in the background until the connection is closed."""
        self._tasks.start_soon(work)

    async def start(self) -> None:
        """Return when those who are there have been found; also when nobody is."""
        self._tasks.start_soon(self._watch)
        if await wait_until(self._sees_others, within_s=FIRST_SIGN_S):
            with anyio.move_on_after(LONGEST_LOOK_S):
                await wait_until_quiet(self)

    async def aclose(self) -> None:
        """Wait a moment until what was published last has arrived."""
        await self._flush()

    async def wait_until_connected(self) -> None:
        """Return at once, or when the first node of others is found."""
        if not await wait_until(self._sees_others, within_s=ANSWER_S):
            raise LinkError("No other node of ROS 2 has been found in our domain.", hint=HINT)

    # --- services and actions

    async def call_service(
        self,
        service: str,
        arguments: Mapping[str, Any] | None = None,
        *,
        type_name: str | None = None,
        timeout_s: float | None = None,
    ) -> dict[str, Any]:
        """Return what a service answers."""
        limit_s = ANSWER_S if timeout_s is None else timeout_s
        return await self._services.call(
            service, arguments or {}, type_name=type_name, timeout_s=limit_s
        )

    async def send_goal(self, action: str, arguments: Message, *, type_name: str) -> ActionGoal:
        """Send a goal to an action and return what becomes of it, as it becomes."""
        return await self._goals.send(action, arguments, type_name=type_name)

    def cancel_goal(self, goal: ActionGoal) -> None:
        """Ask for the end of a goal; its `end` tells whether that worked."""
        self._goals.cancel(goal)

    # --- who is there

    async def _watch(self) -> None:
        while True:
            # What ROS cannot tell now, it is asked again.
            with suppress(LinkError), errors_of_ros("ROS does not tell who is there"):
                self._refresh_topics()
                self._goals.refresh()
            await anyio.sleep(WATCH_S)

    def _sees_others(self) -> bool:
        """Return True once somebody has been there.

        Who goes later is found out by what stays silent.
        """
        if self._found_s is None and self.nodes():
            self._found_s = anyio.current_time()
        return self._found_s is not None


class RclpyContext(Protocol):
    """What can be asked of a system that is still being found."""

    def nodes(self) -> tuple[str, ...]:
        """Return the full names of all nodes that are known now."""
        ...

    async def fetch_node(self, node: str) -> NodeLinks:
        """Return what a node does."""
        ...

    async def fetch_graph(self) -> RosGraph:
        """Return the topics and actions there are."""
        ...


async def wait_until_quiet(system: RclpyContext) -> None:
    """Return when nothing new comes, and no node is a mere name: what it does comes later."""
    graph, before = await system.fetch_graph(), None
    while graph != before or not await _shows_all_nodes(system):
        await anyio.sleep(QUIET_S)
        graph, before = await system.fetch_graph(), graph


async def _shows_all_nodes(system: RclpyContext) -> bool:
    for node in system.nodes():
        try:
            links = await system.fetch_node(node)
        except LinkError:
            return False
        if not (links.publishes or links.serves):
            return False
    return True


@asynccontextmanager
async def open_connection(
    *, domain_id: int | None = None, distro: str = "", variables: Mapping[str, str]
) -> AsyncGenerator[Ros2Connection]:
    """Keep a node of ours in a domain while the context lasts; see `open_ros2_connection`."""
    with plain_errors():
        async with (
            BlockingPortal() as portal,
            _open_participant(domain_id, portal, variables) as participant,
            anyio.create_task_group() as tasks,
        ):
            connection = Ros2Connection(participant, tasks, distro=distro)
            try:
                await connection.start()
                yield connection
            finally:
                with anyio.CancelScope(shield=True):
                    await connection.aclose()
                tasks.cancel_scope.cancel()


@asynccontextmanager
async def _open_participant(
    domain_id: int | None, portal: BlockingPortal, variables: Mapping[str, str]
) -> AsyncGenerator[RclpyParticipant]:
    participant = RclpyParticipant(domain_id=domain_id, portal=portal, variables=variables)
    await participant.start()
    try:
        yield participant
    finally:
        with anyio.CancelScope(shield=True):
            await participant.aclose()
