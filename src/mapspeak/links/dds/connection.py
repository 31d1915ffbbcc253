"""A ROS 2 domain over DDS as a connection, and the robot behind it opened."""

from collections.abc import AsyncGenerator, Callable, Coroutine, Mapping
from contextlib import asynccontextmanager
from typing import Any

import anyio
from anyio.abc import TaskGroup

from mapspeak.errors import LinkError
from mapspeak.links.dds.calls import Calls
from mapspeak.links.dds.discovery import Discovery, FramingOf, framing_by_vendor
from mapspeak.links.dds.endpoints import DISCOVERY_TOPIC, DISCOVERY_TYPE, Quality, Sample
from mapspeak.links.dds.graph import DdsGraph
from mapspeak.links.dds.network import DdsNetwork, DdsTiming
from mapspeak.links.dds.participant import DdsParticipant
from mapspeak.links.dds.types import Types
from mapspeak.ros.activity import ActionGoal
from mapspeak.ros.discovery.overrides import RobotOverrides
from mapspeak.ros.link import plain_errors
from mapspeak.ros.messages.fields import Message
from mapspeak.ros.port import LinkKind, LinkName
from mapspeak.ros.robot import NOTHING_SAID, USUAL_PATIENCE, RosRobot, build_ros_robot
from mapspeak.ros.robot.driving import DrivingPatience

NODES_QUALITY = Quality(is_reliable=True, is_latched=True, depth=1000)
LONG_NODES_TYPE = "rmw_dds_common/LongParticipantEntitiesInfo"
USUAL_TIMING = DdsTiming()
HINT = (
    "Check that the robot runs ROS 2 on Fast DDS or Cyclone DDS, that its ROS_DOMAIN_ID is this "
    "one (--robot dds:DOMAIN), and that the network lets multicast pass; else name the robot's "
    "address in ROS_STATIC_PEERS."
)


class DdsConnection(DdsGraph):
    """One ROS 2 system, as a member of its DDS domain sees it.

    Args:
        framing_of: Tells how a node frames services, by the id of its writer.

    Raises:
        LinkError: DDS cannot be started.
    """

    def __init__(
        self,
        network: DdsNetwork,
        *,
        timing: DdsTiming = USUAL_TIMING,
        framing_of: FramingOf = framing_by_vendor,
    ) -> None:
        self.network = network
        self.timing = timing
        participant = DdsParticipant(network)
        discovery = Discovery(participant.key, on_change=self._note_change, framing_of=framing_of)
        super().__init__(participant, discovery, Types())
        self._tasks: TaskGroup | None = None
        self._found_s: float | None = None
        self._calls = Calls(self, participant)

    @property
    def link(self) -> LinkName:
        """How we are connected."""
        reach = ", on this machine only" if self.network.is_local else ""
        return LinkName(LinkKind.DDS, f"ROS domain {self.network.domain_id}{reach}")

    @property
    def is_open(self) -> bool:
        """True while a node of ROS is there."""
        return not self.discovery.is_empty

    @property
    def connected_for_s(self) -> float | None:
        """Since when nodes have been there, in wall time; None while none is."""
        return None if self._found_s is None else anyio.current_time() - self._found_s

    def start_soon(self, work: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Run something in the background until the connection is closed."""
        if self._tasks is not None:
            self._tasks.start_soon(work)

    async def start(self, tasks: TaskGroup) -> None:
        """Enter the domain, and return when those who are there have been found.

        Raises:
            LinkError: Nobody is there.
        """
        self._tasks = tasks
        self._participant.watch_endpoints(self.discovery.take_writer, self.discovery.take_reader)
        tasks.start_soon(self._participant.run)
        await self._wait_for_node(self.timing.first_sign_s)
        # Fast DDS sends what is latched at once to a reader that knows the writer already, and
        # otherwise within three seconds. So no topic is read before somebody is there.
        self._participant.read(
            DISCOVERY_TOPIC,
            DISCOVERY_TYPE,
            quality=NODES_QUALITY,
            decode=self._decode_nodes,
            take=self._take_nodes,
        )
        with anyio.move_on_after(self.timing.longest_look_s):
            is_news = True
            while is_news:
                with anyio.move_on_after(self.timing.quiet_s) as quiet:
                    await self.discovery.wait_for_news()
                is_news = not quiet.cancelled_caught

    async def aclose(self) -> None:
        """Leave the domain, once what was published last has arrived."""
        if self._advertised:
            await self._participant.flush(timeout_s=self.timing.arrival_s)
        self._participant.close()

    async def wait_until_connected(self) -> None:
        """Return at once, or when a node is there again."""
        await self._wait_for_node(self.timing.answer_s)

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
        limit_s = self.timing.answer_s if timeout_s is None else timeout_s
        answer = await self._calls.call(
            service, arguments or {}, type_name=type_name, timeout_s=limit_s
        )
        content: dict[str, Any] = answer.content
        return content

    async def ask(self, service: str, arguments: Mapping[str, Any], *, timeout_s: float) -> Sample:
        """Return what a service answers, and when it did."""
        return await self._calls.call(service, arguments, type_name=None, timeout_s=timeout_s)

    async def send_goal(self, action: str, arguments: Message, *, type_name: str) -> ActionGoal:
        """Send a goal to an action and return what becomes of it, as it becomes."""
        return await self._calls.send_goal(
            action, arguments, type_name=type_name, timeout_s=self.timing.answer_s
        )

    def cancel_goal(self, goal: ActionGoal) -> None:
        """Ask for the end of a goal; its `end` tells whether that worked."""
        self._calls.cancel_goal(goal)

    # --- who is there

    async def _wait_for_node(self, limit_s: float) -> None:
        with anyio.move_on_after(limit_s):
            while self.discovery.is_empty:
                await self.discovery.wait_for_news()
        if self.discovery.is_empty:
            raise LinkError(
                f"No node of ROS 2 was found in DDS domain {self.network.domain_id} within "
                f"{limit_s:g} s.",
                hint=HINT,
            )

    def _note_change(self, dds_name: str) -> None:
        if self.discovery.is_empty:
            self._found_s = None
        elif self._found_s is None:
            self._found_s = anyio.current_time()
        for each in self.discovery.ends_of(dds_name):
            self.types.take_hash(each.type_name, each.type_hash)
        self._note_topic(dds_name)
        self._calls.note_change(dds_name)

    def _decode_nodes(self, data: bytes) -> dict[str, Any]:
        try:
            return self.types.decode(DISCOVERY_TYPE, data)
        except LinkError:
            return self.types.decode(LONG_NODES_TYPE, data)

    def _take_nodes(self, sample: Sample) -> None:
        if sample.refusal is not None:
            return
        self.discovery.take_nodes(sample)
        if self.discovery.has_long_ids:
            self.types.take_humble()


@asynccontextmanager
async def open_dds_connection(
    network: DdsNetwork,
    *,
    timing: DdsTiming = USUAL_TIMING,
    framing_of: FramingOf = framing_by_vendor,
) -> AsyncGenerator[DdsConnection]:
    """Keep us in a domain while the context lasts; see `DdsConnection`.

    Raises:
        LinkError: DDS cannot be started, or nobody is there.
    """
    with plain_errors():
        async with anyio.create_task_group() as tasks:
            connection = DdsConnection(network, timing=timing, framing_of=framing_of)
            try:
                await connection.start(tasks)
                yield connection
            finally:
                with anyio.CancelScope(shield=True):
                    await connection.aclose()
                tasks.cancel_scope.cancel()


@asynccontextmanager
async def open_dds_robot(
    network: DdsNetwork,
    *,
    overrides: RobotOverrides = NOTHING_SAID,
    timing: DdsTiming = USUAL_TIMING,
    patience: DrivingPatience = USUAL_PATIENCE,
) -> AsyncGenerator[RosRobot]:
    """Offer the ROS 2 robot in a DDS domain while the context lasts.

    Leaving the context does not stop the robot: call `stop` before, where that is wanted.

    Raises:
        LinkError: No robot is found there, or it does not say what it offers.
    """
    async with open_dds_connection(network, timing=timing) as connection:
        yield await build_ros_robot(connection, overrides=overrides, patience=patience)
