"""The client of one robot: its subscriptions, publications, calls and goals."""

import logging
from collections.abc import AsyncGenerator, Callable, Mapping
from contextlib import asynccontextmanager
from functools import partial
from typing import Any

import anyio
from anyio.abc import TaskGroup

from mapspeak.errors import LinkError
from mapspeak.links.rosbridge.address import RobotAddress
from mapspeak.links.rosbridge.channel import Channel
from mapspeak.links.rosbridge.protocol.codec import require_cbor
from mapspeak.links.rosbridge.protocol.conversation import (
    Encoding,
    Event,
    EventKind,
    FrameRefused,
    write_operation,
)
from mapspeak.links.rosbridge.rosapi import Rosapi
from mapspeak.ros.activity import ActionEnd, ActionGoal, Subscription
from mapspeak.ros.discovery.overrides import RobotOverrides
from mapspeak.ros.link import NOTICE_S, USUAL_PATIENCE, Patience
from mapspeak.ros.messages.fields import BULKY, Message, bare_type
from mapspeak.ros.port import LinkName, OwnEnds, keep_open, new_id
from mapspeak.ros.robot import NOTHING_SAID, RosRobot, build_ros_robot

logger = logging.getLogger(__name__)

NODE = "rosbridge_websocket"
"""The name of rosbridge's node, without its namespace."""
ROSAPI = "/rosapi/"
UNKNOWN = "does not exist"
"""In rosbridge's words; such a call has not reached the service, so it may be repeated."""
LOOK_AGAIN_S = 0.1
ENCODINGS = (Encoding.CBOR, Encoding.CBOR, Encoding.JSON)
"""Of bulky messages: asked for so first, and again, and again.

Where CBOR is beyond the server's size limit it is dropped in silence, while JSON comes in pieces.
"""


class RosbridgeClient(Rosapi):
    """One robot over two sockets: topics and goals on one, calls and urgent messages on the other.

    Some versions of rosbridge handle the operations of one socket one after another, so that a stop
    sent behind a goal would act when the goal has ended. Hence a goal takes the socket that carries
    no goal, and urgent messages take the other; a goal that replaces another frees that one's
    socket.
    """

    def __init__(self, address: RobotAddress, *, patience: Patience = USUAL_PATIENCE) -> None:
        super().__init__(patience)
        self.address = address
        self._control = self._channel()
        self._urgent = self._channel()
        self._goals: dict[str, tuple[ActionGoal, Channel | None]] = {}
        self._published_s = float("-inf")
        self.n_frames_refused = 0
        """Frames that could not be understood and were left away."""

    @property
    def link(self) -> LinkName:
        """How we are connected."""
        return self.address.link

    @property
    def is_open(self) -> bool:
        """True when something can be sent at once."""
        return self._control.is_up or self._urgent.is_up

    @property
    def n_connections(self) -> int:
        """How often the socket that carries topics and goals was connected."""
        return self._control.n_connections

    @property
    def connected_for_s(self) -> float | None:
        """Since when the socket that carries topics and goals has been open; None while it is not.

        In wall time.
        """
        return self._control.up_for_s

    @property
    def lost_for_s(self) -> float | None:
        """Since when the socket that carries topics and goals has been gone; None while it is not.

        In wall time.
        """
        return self._control.lost_for_s

    @property
    def own_ends(self) -> OwnEnds:
        """The topics that rosbridge's node handles for us, and perhaps for other clients."""
        return OwnEnds(
            node=NODE, publishes=frozenset(self._told), subscribes=frozenset(self._subscriptions)
        )

    async def wait_until_connected(self) -> None:
        """Return at once, or when both sockets are open again."""
        await self._control.wait_until_up(self.patience.answer_s)
        await self._urgent.wait_until_up(self.patience.answer_s)

    async def _start(self, tasks: TaskGroup) -> None:
        await super()._start(tasks)
        await self._control.start(tasks)
        await self._urgent.start(tasks)

    async def _leave(self) -> None:
        # rosbridge forgets a message when the socket that brought it closes at once.
        await anyio.sleep_until(self._published_s + self.patience.linger_s)
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(self._control.say_goodbye)
            tasks.start_soon(self._urgent.say_goodbye)

    def _check(self, topic: str, type_name: str | None) -> None:
        known, _ = self._noted.get(topic, (type_name, False))
        if known and type_name and bare_type(known) != bare_type(type_name):
            raise LinkError(
                f"{topic} was advertised as {known}, not as {type_name}.",
                hint="A topic has one type: look it up on the robot.",
            )

    async def publish(self, topic: str, message: Message) -> None:
        """Publish on an advertised topic."""
        text = write_operation("publish", topic=topic, msg=message)
        if self._tell_first(topic):
            await anyio.sleep(NOTICE_S)
        await self._free_for_topics().send(text, timeout_s=self.patience.answer_s)
        self._published_s = anyio.current_time()

    def _prepare(self, topic: str, message: Message) -> Callable[[], int]:
        text = write_operation("publish", topic=topic, msg=message)

        def send() -> int:
            self._published_s = anyio.current_time()
            return sum([each.send_if_up(text) for each in (self._urgent, self._control)])

        return send

    async def call_service(
        self,
        service: str,
        arguments: Mapping[str, Any] | None = None,
        *,
        type_name: str | None = None,
        timeout_s: float | None = None,
    ) -> dict[str, Any]:
        """Return what a service answers. A timeout leaves the connection open.

        rosbridge and rosapi are two nodes: one may discover a moment later what the other knows.
        """
        left_s = self.patience.answer_s if timeout_s is None else timeout_s
        until_s = anyio.current_time() + left_s
        while True:
            try:
                return await self._call_once(service, arguments or {}, type_name, left_s)
            except LinkError as error:
                is_unknown = UNKNOWN in error.message and not service.startswith(ROSAPI)
                if not is_unknown or not await self._is_known_to_rosapi(service, until_s):
                    raise
            left_s = until_s - anyio.current_time() - LOOK_AGAIN_S
            await anyio.sleep(LOOK_AGAIN_S)

    async def _is_known_to_rosapi(self, service: str, until_s: float) -> bool:
        """Return False also when there is no time to ask."""
        left_s = until_s - anyio.current_time() - LOOK_AGAIN_S
        if left_s <= 0.0:
            return False
        asked = {"service": service}
        try:
            answer = await self._call_once(f"{ROSAPI}service_type", asked, None, left_s)
        except LinkError:
            return False
        return bool(answer.get("type")) and until_s - anyio.current_time() > 2 * LOOK_AGAIN_S

    async def _call_once(
        self, service: str, arguments: Mapping[str, Any], type_name: str | None, timeout_s: float
    ) -> dict[str, Any]:
        call_id = new_id()
        text = write_operation(
            "call_service", id=call_id, service=service, args=arguments, type=type_name
        )
        channel = self._free_for_calls()
        values = await channel.call(text, call_id=call_id, what=service, timeout_s=timeout_s)
        return values if isinstance(values, dict) else {}

    async def send_goal(self, action: str, arguments: Message, *, type_name: str) -> ActionGoal:
        """Send a goal to an action of ROS 2 and return the goal, updated as its state changes."""
        goal = ActionGoal(goal_id=new_id(), action=action)
        text = write_operation(
            "send_action_goal",
            id=goal.id,
            action=action,
            action_type=type_name,
            args=arguments,
            feedback=True,
        )
        channel = self._free_for_topics()
        connection = await channel.wait_until_up(self.patience.answer_s)
        connection.send(text)
        self._goals[goal.id] = (goal, channel)
        return goal

    def cancel_goal(self, goal: ActionGoal) -> None:
        """Cancel a goal over the socket it does not block; its end tells whether that worked."""
        text = write_operation("cancel_action_goal", id=goal.id, action=goal.action)
        self.start_soon(partial(self._free_for_calls().send_when_up, text))
        _, channel = self._goals.get(goal.id, (goal, None))
        if goal.is_withdrawn and channel is not None:
            # Without a sign of life it may block its socket.
            self._goals[goal.id] = (goal, None)
            channel.replace()

    def clear_the_way(self) -> None:
        """Make a socket anew where goals or calls are under way on both: for a stop."""
        if self._carries_goal(self._free_for_calls()) or self._free_for_calls().is_waiting:
            self._free_for_calls().replace()

    def _announce(self, topic: str, type_name: str, is_latched: bool) -> None:  # noqa: FBT001
        text = write_operation(
            "advertise",
            id=f"advertise:{topic}",
            topic=topic,
            type=type_name,
            latch=is_latched or None,
        )
        for channel in (self._control, self._urgent):
            channel.keep_standing(f"advertise:{topic}", text)

    def _take_back(self, topic: str) -> None:
        text = write_operation("unadvertise", id=f"advertise:{topic}", topic=topic)
        for channel in (self._control, self._urgent):
            channel.end_standing(f"advertise:{topic}", text)

    def _channel(self) -> Channel:
        return Channel(
            self.address, on_event=self._take, on_loss=self._lose_goals, patience=self.patience
        )

    def _carries_goal(self, channel: Channel) -> bool:
        return any(carrier is channel for _, carrier in self._goals.values())

    def _free_for_topics(self) -> Channel:
        is_free = self._carries_goal(self._urgent) or not self._carries_goal(self._control)
        return self._control if is_free else self._urgent

    def _free_for_calls(self) -> Channel:
        is_free = self._carries_goal(self._control) or not self._carries_goal(self._urgent)
        return self._urgent if is_free else self._control

    def _begin(self, subscription: Subscription) -> None:
        encoding = Encoding.JSON
        if subscription.type_name and bare_type(subscription.type_name) in BULKY:
            encoding = ENCODINGS[min(subscription.n_renewals, len(ENCODINGS) - 1)]
        operation_id, channel = subscription.reader = new_id(), self._free_for_topics()
        text = write_operation(
            "subscribe",
            id=operation_id,
            topic=subscription.topic,
            type=subscription.type_name,
            compression=encoding.value,
            # Where some are left out, only the latest waits at the server.
            throttle_rate=subscription.throttle_ms or None,
            queue_length=1 if subscription.throttle_ms else None,
        )
        channel.keep_standing(operation_id, text)

    def _end(self, subscription: Subscription) -> None:
        operation_id, channel = subscription.reader
        text = write_operation("unsubscribe", id=operation_id, topic=subscription.topic)
        channel.end_standing(operation_id, text)

    def _take(self, event: Event) -> None:
        if isinstance(event, FrameRefused):
            self.n_frames_refused += 1
        elif event.kind is EventKind.PUBLISHED and event.key in self._subscriptions:
            self._subscriptions[event.key].take(event.values)
        elif event.kind is EventKind.FED_BACK and event.key in self._goals:
            self._goals[event.key][0].take_feedback(event.values)
        elif event.kind is EventKind.ENDED and event.key in self._goals:
            goal, _ = self._goals.pop(event.key)
            goal.take_end(
                ActionEnd(status=event.status, is_result=event.is_result, values=event.values)
            )
        elif event.kind is EventKind.NOTED:
            logger.info("rosbridge notes: %s: %s", event.key[:40], str(event.values)[:200])

    def _lose_goals(self, channel: Channel) -> None:
        # rosbridge itself may have restarted, and forgotten the goals that were given up.
        is_alone = channel.was_replaced
        lost = [
            goal
            for goal, carrier in self._goals.values()
            if carrier is channel or (carrier is None and not is_alone)
        ]
        for goal in lost:
            del self._goals[goal.id]
            goal.take_loss()


@asynccontextmanager
async def open_client(
    address: RobotAddress, *, patience: Patience = USUAL_PATIENCE
) -> AsyncGenerator[RosbridgeClient]:
    """Keep a robot connected while the context lasts.

    Raises:
        LinkError: It cannot be reached.
        ConfigError: An old package stands before one that is needed.
    """
    require_cbor()
    async with keep_open(RosbridgeClient(address, patience=patience)) as client:
        yield client


@asynccontextmanager
async def open_rosbridge_robot(
    url: str | RobotAddress,
    *,
    overrides: RobotOverrides = NOTHING_SAID,
    patience: Patience = USUAL_PATIENCE,
) -> AsyncGenerator[RosRobot]:
    """Offer the robot behind a rosbridge server while the context lasts.

    Leaving the context does not stop the robot: call `stop` before if wanted.

    Raises:
        LinkError: The robot cannot be reached, or does not say what it offers.
        ConfigError: The address is invalid.
    """
    address = RobotAddress(url=url) if isinstance(url, str) else url
    async with open_client(address, patience=patience) as client:
        yield await build_ros_robot(client, overrides=overrides)
