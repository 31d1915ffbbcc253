"""Goals of actions over rclpy.

An action is three services and two topics. We use these themselves: rclpy's own client of actions
loses the answer to a goal that comes while it is still noting that it has sent it.
"""

from collections.abc import Callable, Coroutine
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import anyio

from mapspeak.errors import LinkError
from mapspeak.links.rclpy.messages import read_message, write_message
from mapspeak.links.rclpy.participant import RclpyParticipant, errors_of_ros
from mapspeak.links.rclpy.services import SERVER_S, Client, RclpyServices
from mapspeak.links.rclpy.types import find_action, name_of
from mapspeak.ros import ActionEnd, ActionGoal, new_id
from mapspeak.ros.goal import PursuedGoal
from mapspeak.ros.messages import Message, bare_type
from mapspeak.ros.native import check_name, wrong_type

FEEDBACK_DEPTH = 10
CANCEL_S = 5.0
CANCEL_TYPE = "action_msgs/srv/CancelGoal"

StartSoon = Callable[[Callable[[], Coroutine[Any, Any, None]]], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Action:
    """An action that we have used.

    Attributes:
        action_class: Of rclpy.
        send: Its service send_goal.
        result: Its service get_result.
    """

    action_class: Any
    send: Client
    result: Client


@dataclass(slots=True, eq=False)
class _Pursuit:
    """A goal under way.

    Attributes:
        goal: As others see it.
        servers: The ids in ROS of what published feedback when it was sent: a server that was
            killed and started again has the same name, and knows nothing of the goal.
        scope: Of what waits for its answers.
    """

    goal: PursuedGoal
    servers: frozenset[bytes]
    scope: anyio.CancelScope = field(default_factory=anyio.CancelScope)


class Goals:
    """Sends goals, and says what becomes of them.

    Args:
        participant: Ours.
        services: Calls them.
        start_soon: Runs something in the background.
    """

    def __init__(
        self, participant: RclpyParticipant, services: RclpyServices, *, start_soon: StartSoon
    ) -> None:
        self._participant = participant
        self._services = services
        self._start_soon = start_soon
        self._actions: dict[str, _Action] = {}
        self._pursuits: dict[str, _Pursuit] = {}

    async def send(self, action: str, arguments: Message, *, type_name: str) -> PursuedGoal:
        """Send a goal; what becomes of it comes later.

        Raises:
            LinkError: Nobody serves the action, it has another type, or the goal does not fit.
        """
        check_name(action)
        used = await self._open(action, type_name)
        goal_id = new_id()
        request = used.action_class.Impl.SendGoalService.Request()
        request.goal = write_message(used.action_class.Goal, arguments)
        request.goal_id = write_message(type(request.goal_id), _uuid(goal_id))
        goal = PursuedGoal(goal_id=goal_id, action=action, ros_id=goal_id)
        pursuit = _Pursuit(goal, self._servers_of(action))
        self._pursuits[goal_id] = pursuit
        self._start_soon(partial(self._pursue, pursuit, used, request))
        return goal

    def cancel(self, goal: ActionGoal) -> None:
        """Ask for the end of a goal that the server has taken."""
        pursuit = self._pursuits.get(goal.goal_id)
        if pursuit is not None and pursuit.goal.is_accepted:
            self._start_soon(partial(self._ask_to_cancel, pursuit.goal))

    def refresh(self) -> None:
        """Take in that servers have gone: nobody will tell how their goals end."""
        for pursuit in list(self._pursuits.values()):
            if self._is_served(pursuit):
                continue
            del self._pursuits[pursuit.goal.goal_id]
            pursuit.scope.cancel()
            pursuit.goal.take_loss()

    def _is_served(self, pursuit: _Pursuit) -> bool:
        servers = self._servers_of(pursuit.goal.action)
        if not pursuit.servers:
            pursuit.servers = servers
        if not pursuit.servers:
            return bool(self._actions[pursuit.goal.action].send.service_is_ready())
        return bool(servers & pursuit.servers)

    def _servers_of(self, action: str) -> frozenset[bytes]:
        infos = self._participant.node.get_publishers_info_by_topic(part_of(action, "feedback"))
        return frozenset(bytes(each.endpoint_gid) for each in infos)

    async def _open(self, action: str, type_name: str) -> _Action:
        """Return an action that somebody serves, and listen to its feedback from now on."""
        action_class = find_action(type_name)
        known = self._actions.get(action)
        if known is not None and known.action_class is not action_class:
            raise wrong_type(action, name_of(known.action_class), type_name)
        self._check_type(action, type_name)
        parts = (
            ("send_goal", action_class.Impl.SendGoalService),
            ("get_result", action_class.Impl.GetResultService),
        )
        send, result = [
            await self._services.connect(part_of(action, name), part, within_s=SERVER_S)
            for name, part in parts
        ]
        if known is None:
            known = _Action(action_class=action_class, send=send, result=result)
            with errors_of_ros(f"{action} cannot be used"):
                self._participant.node.create_subscription(
                    action_class.Impl.FeedbackMessage,
                    part_of(action, "feedback"),
                    self._take_feedback,
                    FEEDBACK_DEPTH,
                )
            self._actions[action] = known
        return known

    def _check_type(self, action: str, type_name: str) -> None:
        services = dict(self._participant.node.get_service_names_and_types())
        for found in services.get(part_of(action, "send_goal"), []):
            if bare_type(found.removesuffix("_SendGoal")) != bare_type(type_name):
                raise wrong_type(action, found.removesuffix("_SendGoal"), type_name)

    async def _pursue(self, pursuit: _Pursuit, used: _Action, request: Any) -> None:  # noqa: ANN401
        """Wait for the server's answers, which may be none at all."""
        goal = pursuit.goal
        with pursuit.scope:
            try:
                is_accepted = (await self._services.ask(used.send, request)).accepted
                if is_accepted:
                    self._accept(pursuit)
                    end = await self._wait_for_result(used, request.goal_id)
                else:
                    end = ActionEnd(status=None, is_result=False, values="")
            except LinkError as error:
                end = ActionEnd(status=None, is_result=False, values=error.message)
            self._pursuits.pop(goal.goal_id, None)
            goal.take_end(end)

    async def _wait_for_result(self, used: _Action, goal_id: Any) -> ActionEnd:  # noqa: ANN401
        question = used.action_class.Impl.GetResultService.Request()
        question.goal_id = goal_id
        answer = await self._services.ask(used.result, question)
        return ActionEnd(
            status=int(answer.status), is_result=True, values=read_message(answer.result)
        )

    def _accept(self, pursuit: _Pursuit) -> None:
        if pursuit.goal.is_accepted:
            return
        pursuit.goal.take_acceptance()

    async def _ask_to_cancel(self, goal: PursuedGoal) -> None:
        arguments = {"goal_info": {"goal_id": _uuid(goal.goal_id)}}
        # Whether it is cancelled, its end tells.
        try:
            await self._services.call(
                part_of(goal.action, "cancel_goal"),
                arguments,
                type_name=CANCEL_TYPE,
                timeout_s=CANCEL_S,
            )
        except LinkError:
            return

    def _take_feedback(self, message: Any) -> None:  # noqa: ANN401 - rclpy has no types
        """Take what is said of any goal of the action, in the thread of rclpy."""
        goal_id = bytes(message.goal_id.uuid).hex()
        if goal_id in self._pursuits:
            feedback = read_message(message.feedback)
            self._participant.hand_over(self._give_feedback, goal_id, feedback)

    def _give_feedback(self, goal_id: str, feedback: Message) -> None:
        pursuit = self._pursuits.get(goal_id)
        if pursuit is not None:
            self._accept(pursuit)
            pursuit.goal.take_feedback(feedback)


def part_of(action: str, name: str) -> str:
    """Return the full name of one of the services and topics that an action consists of."""
    return f"{action}/_action/{name}"


def _uuid(goal_id: str) -> dict[str, bytes]:
    return {"uuid": bytes.fromhex(goal_id)}
