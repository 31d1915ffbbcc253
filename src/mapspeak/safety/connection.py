"""A ROS system behind the guard: reading passes, what changes something is decided on first."""

import re
from collections.abc import Callable, Coroutine, Mapping
from contextlib import suppress
from typing import Any, TypeVar

from mapspeak.errors import LinkError
from mapspeak.ros.activity import ActionGoal
from mapspeak.ros.messages.fields import VELOCITIES, Message, bare_type
from mapspeak.ros.port import RosConnection
from mapspeak.safety.commands import (
    Act,
    Call,
    Command,
    Publish,
    SetParameter,
    read_action_goal,
)
from mapspeak.safety.deciding import Refused, find_speeds, is_name_denied
from mapspeak.safety.guard import Guard
from mapspeak.safety.planning import Planner
from mapspeak.safety.teleop import (
    Teleop,
    is_zero_velocity,
    refuse_velocity,
)

T = TypeVar("T")

CANCEL_TYPE = re.compile(r"actionlib_msgs/(?:msg/)?GoalID")
CANCEL_SERVICE_TYPE = re.compile(r"action_msgs/(?:srv/)?CancelGoal")
HARMLESS = frozenset(
    {
        *("patience", "is_open", "connected_for_s", "lost_for_s", "link", "own_ends", "started"),
        *("start_soon", "wait_until_connected", "clear_the_way", "find_quality"),
        *("subscribe", "unsubscribe", "renew", "unadvertise", "advertise_late", "advertise_early"),
        *("fetch_graph", "fetch_topics", "fetch_time_s", "fetch_nodes", "fetch_node"),
        *("fetch_publishers", "fetch_subscribers", "fetch_services", "fetch_service_type"),
        *("fetch_action_type", "fetch_definitions", "fetch_parameter_names", "fetch_parameter"),
    }
)
"""Members that are passed on; a new one is refused until it is guarded or named here."""


class GuardedConnection:
    """A `RosConnection` that changes only what its policy allows; stopping always passes.

    Args:
        teleop: Knows where velocities would take the robot.
        planner: Checks the poses of goals against the map.
    """

    def __init__(
        self,
        connection: RosConnection,
        *,
        guard: Guard,
        now_s: Callable[[], float],
        teleop: Teleop,
        planner: Planner,
    ) -> None:
        self._planner = planner
        self._connection = connection
        self._teleop = teleop
        self._guard = guard
        self._now_s = now_s
        self._types: dict[str, str] = {}

    # --- what changes something ---

    async def publish(self, topic: str, message: Message) -> None:
        """Publish on an advertised topic what the policy allows.

        Raises:
            PolicyError: It does not.
        """
        command = Publish(topic=topic, type=self._types.get(topic, ""), message=message)
        if _is_stop(command):
            await self._connection.publish(topic, message)
            self._note_stop(command)
            return
        goal = read_action_goal(command)
        if goal is not None:
            await self._send(goal, self._connection.publish(topic, message))
            return
        objection = await self._teleop.find_objection(message)
        await self._guarded(command, self._connection.publish(topic, message), objection)

    def publish_everywhere(self, topic: str, message: Message) -> int:
        """Publish at once by every way that is open, and return how many: for a stop.

        Raises:
            PolicyError: It is not a stop, and the policy does not allow it.
        """
        command = Publish(topic=topic, type=self._types.get(topic, ""), message=message)
        if _is_stop(command):
            n_ways = self._connection.publish_everywhere(topic, message)
            self._note_stop(command)
            return n_ways
        objection = self._objection_unseen(command)
        permit = self._guard.clear(command, robot_s=self._now_s(), objection=objection)
        n_ways = self._connection.publish_everywhere(topic, message)
        self._guard.note_result(permit, f"by {n_ways} ways", robot_s=self._now_s())
        return n_ways

    async def call_service(
        self,
        service: str,
        arguments: Mapping[str, Any] | None = None,
        *,
        type_name: str | None = None,
        timeout_s: float | None = None,
    ) -> dict[str, Any]:
        """Return what a service answers that the policy allows to be called.

        Raises:
            PolicyError: It does not.
        """
        command = Call(service=service, type=type_name or "", arguments=arguments or {})
        answer = self._connection.call_service(
            service, arguments, type_name=type_name, timeout_s=timeout_s
        )
        if _is_stop(command):
            self._note_stop(command)
            return await answer
        return await self._guarded(command, answer)

    async def send_goal(self, action: str, arguments: Message, *, type_name: str) -> ActionGoal:
        """Send a goal to an action of ROS 2 that the policy allows.

        Raises:
            PolicyError: It does not.
        """
        command = Act(
            action=action,
            type=type_name,
            goal=arguments,
            true_type=await self._fetch_action_type(action),
        )
        return await self._send(
            command, self._connection.send_goal(action, arguments, type_name=type_name)
        )

    async def _send(self, command: Act, work: Coroutine[Any, Any, T]) -> T:
        """Send the goal of an action that the policy allows, when its poses are goals."""
        objection = None
        try:
            # What is denied anyway needs no look at the map.
            if not is_name_denied(command, self._guard.policy):
                objection = await self._planner.judge_message(command.goal)
        except BaseException:
            work.close()
            raise
        return await self._guarded(command, work, objection)

    async def _fetch_action_type(self, action: str) -> str:
        """Return an action's type as the robot says; empty when it does not tell it."""
        with suppress(LinkError):
            return await self._connection.fetch_action_type(action)
        return ""

    async def set_parameter(self, node: str, name: str, value: Any) -> None:  # noqa: ANN401
        """Set a node's parameter that the policy allows to be set.

        Raises:
            PolicyError: It does not.
        """
        command = SetParameter(node=node, name=name, value=value)
        await self._guarded(command, self._connection.set_parameter(node, name, value))

    def check_name(self, command: Command) -> None:
        """Return when a command is not denied for its name, whatever else it says.

        Raises:
            PolicyError: It is.
        """
        is_stop = isinstance(command, Publish | Call) and _is_stop(command)
        if not is_stop and is_name_denied(command, self._guard.policy):
            self._guard.clear(command, robot_s=self._now_s())

    def is_name_denied(self, command: Command) -> bool:
        """Return True when the policy denies a command for its name; nothing is noted."""
        return is_name_denied(command, self._guard.policy)

    def _objection_unseen(self, command: Publish) -> Refused | None:
        """Return the objection to a velocity when there is no time to fetch the pose."""
        if not self._teleop.knows_areas or not any(find_speeds(command.message)):
            return None
        return refuse_velocity("A velocity goes out by all ways at once only when it is zero.")

    async def _guarded(
        self, command: Command, work: Coroutine[Any, Any, T], objection: Refused | None = None
    ) -> T:
        """Do what was decided to be allowed, and note how it ended."""
        try:
            permit = self._guard.clear(command, robot_s=self._now_s(), objection=objection)
        except BaseException:
            work.close()
            raise
        # From before it is sent: what fails half-way may move the robot all the same.
        if isinstance(command, Publish) and _is_velocity(command.type):
            self._teleop.begin(command.topic)
        said = "given up"
        try:
            result = await work
            said = "done"
        finally:
            self._guard.note_result(permit, said, robot_s=self._now_s())
        return result

    def _note_stop(self, command: Publish | Call) -> None:
        if isinstance(command, Publish):
            self._teleop.end(command.topic)
        name = command.service if isinstance(command, Call) else command.topic
        said = f"zero velocity, or the end of a goal, on {name}"
        self._guard.note_event("stop", said, robot_s=self._now_s())

    # --- what ends something: never refused ---

    def cancel_goal(self, goal: ActionGoal) -> None:
        """Ask for the end of a goal that the server has taken; its `end` tells if that worked."""
        self._connection.cancel_goal(goal)
        self._guard.note_event("stop", f"cancelled {goal.id}", robot_s=self._now_s())

    # --- what only reads, or is undone by itself ---

    def advertise(self, topic: str, *, type_name: str, is_latched: bool = False) -> None:
        """Say that we will publish; the robot needs a moment until it listens.

        Raises:
            PolicyError: The policy forbids the topic: the robot must not even hear of it.
        """
        command = Publish(topic=topic, type=type_name, message={})
        self.check_name(read_action_goal(command) or command)
        self._types[topic] = type_name
        self._connection.advertise(topic, type_name=type_name, is_latched=is_latched)

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - any member of the port
        """Return a member of the connection that changes nothing on the robot."""
        if name not in HARMLESS:
            raise AttributeError(name)
        return getattr(self._connection, name)


def _is_stop(command: Publish | Call) -> bool:
    """Return True for a velocity of zero, and for what cancels goals in ROS 1 and ROS 2."""
    if isinstance(command, Call):
        # The name is asked for too: a type is what the caller says, and some links do not check it.
        is_cancel = not command.type or CANCEL_SERVICE_TYPE.fullmatch(command.type) is not None
        return is_cancel and command.service.endswith("/_action/cancel_goal")
    if CANCEL_TYPE.fullmatch(command.type) and command.topic.endswith("/cancel"):
        return True
    # Only types that hold nothing else: an odometry message with zero speed is not a stop.
    return _is_velocity(command.type) and is_zero_velocity(command.message)


def _is_velocity(type_name: str) -> bool:
    return bare_type(type_name) in VELOCITIES
