"""Services that we call, and goals of actions that we send, over rclpy.

An action is three services and two topics. We use these themselves: rclpy's own client of actions
loses the answer to a goal that comes while it is still noting that it has sent it.
"""

from collections.abc import Callable, Coroutine, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import anyio

from mapspeak.errors import LinkError
from mapspeak.links.rclpy.participant import RclpyParticipant, errors_of_ros, wait_until
from mapspeak.links.rclpy.types import find_message, name_of, read_message, write_message
from mapspeak.ros.activity import REFUSED, ActionEnd, ActionGoal
from mapspeak.ros.link import check_name, wrong_type
from mapspeak.ros.messages.fields import Message, bare_type
from mapspeak.ros.port import new_id

SERVER_S = 2.0
"""For somebody who serves to be found: right after connecting, not all are known."""
FEEDBACK_DEPTH = 10
CANCEL_S = 5.0
CANCEL_TYPE = "action_msgs/srv/CancelGoal"

Client = Any  # rclpy has no types
StartSoon = Callable[[Callable[[], Coroutine[Any, Any, None]]], None]


class RclpyServices:
    """Calls services; a call that is not answered in time is forgotten."""

    def __init__(self, participant: RclpyParticipant) -> None:
        self._participant = participant
        self._clients: dict[str, Client] = {}

    async def call(
        self,
        service: str,
        arguments: Mapping[str, Any],
        *,
        type_name: str | None,
        timeout_s: float,
    ) -> dict[str, Any]:
        """Return what a service answers."""
        check_name(service)
        found = await self._find_type(service, within_s=min(timeout_s, SERVER_S))
        if type_name is not None and bare_type(type_name) != bare_type(found):
            raise wrong_type(service, found, type_name)
        service_class = find_message(found, "srv")
        request = write_message(service_class.Request, arguments)
        client = await self.connect(service, service_class, within_s=min(timeout_s, SERVER_S))
        with anyio.move_on_after(timeout_s):
            return read_message(await self.ask(client, request))
        raise LinkError(
            f"{service} did not answer within {timeout_s:g} s.",
            hint="The node that serves it may be stuck: look at its log, or restart it.",
        )

    async def connect(self, service: str, service_class: Any, *, within_s: float) -> Client:  # noqa: ANN401
        """Return a client whose service somebody serves."""
        client = self._clients.get(service)
        if client is None:
            with errors_of_ros(f"{service} cannot be called"):
                client = self._participant.node.create_client(service_class, service)
            self._clients[service] = client
        if not await wait_until(client.service_is_ready, within_s=within_s):
            raise nobody_serves(service)
        return client

    async def ask(self, client: Client, request: Any) -> Any:  # noqa: ANN401 - rclpy has no types
        """Return the answer to a request, both as messages of rclpy; wait as long as it takes."""
        with errors_of_ros("The request cannot be sent"):
            future = client.call_async(request)
        try:
            return await self._participant.wait_for(future)
        finally:
            client.remove_pending_request(future)

    async def _find_type(self, service: str, *, within_s: float) -> str:
        def types() -> list[str]:
            found = dict(self._participant.node.get_service_names_and_types())
            return list(found.get(service, []))

        if not await wait_until(lambda: bool(types()), within_s=within_s):
            raise nobody_serves(service)
        return types()[0]


def nobody_serves(name: str) -> LinkError:
    """Return the error for a service or an action that is not there."""
    return LinkError(
        f"Nobody serves {name[:80]}.",
        hint="Ask for the list of what there is; the node that offers it may have ended.",
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Action:
    """An action that we have used."""

    action_class: Any
    send: Client
    result: Client


class RclpyGoal(ActionGoal):
    """A goal of ours.

    Args:
        servers: The ids in ROS of what published feedback when it was sent: a server that was
            killed and started again has the same name, and knows nothing of the goal.
    """

    def __init__(self, action: str, servers: frozenset[bytes]) -> None:
        goal_id = new_id()
        super().__init__(goal_id=goal_id, action=action, ros_id=goal_id)
        self.servers = servers
        self.scope = anyio.CancelScope()
        """Of what waits for its answers."""


class Goals:
    """Sends goals, and says what becomes of them."""

    def __init__(
        self, participant: RclpyParticipant, services: RclpyServices, *, start_soon: StartSoon
    ) -> None:
        self._participant = participant
        self._services = services
        self._start_soon = start_soon
        self._actions: dict[str, _Action] = {}
        self._goals: dict[str, RclpyGoal] = {}

    async def send(self, action: str, arguments: Message, *, type_name: str) -> ActionGoal:
        """Send a goal; what becomes of it comes later."""
        check_name(action)
        used = await self._open(action, type_name)
        goal = RclpyGoal(action, self._servers_of(action))
        request = used.action_class.Impl.SendGoalService.Request()
        request.goal = write_message(used.action_class.Goal, arguments)
        request.goal_id = write_message(type(request.goal_id), _uuid(goal.goal_id))
        self._goals[goal.goal_id] = goal
        self._start_soon(partial(self._pursue, goal, used, request))
        return goal

    def cancel(self, goal: ActionGoal) -> None:
        """Ask for the end of a goal that the server has taken."""
        if goal.goal_id in self._goals and goal.is_accepted:
            self._start_soon(partial(self._ask_to_cancel, goal))

    def refresh(self) -> None:
        """Take in that servers have gone: nobody will tell how their goals end."""
        for goal in list(self._goals.values()):
            if not self._is_served(goal):
                del self._goals[goal.goal_id]
                goal.scope.cancel()
                goal.take_loss()

    def _is_served(self, goal: RclpyGoal) -> bool:
        servers = self._servers_of(goal.action)
        goal.servers = goal.servers or servers
        if not goal.servers:
            return bool(self._actions[goal.action].send.service_is_ready())
        return bool(servers & goal.servers)

    def _servers_of(self, action: str) -> frozenset[bytes]:
        infos = self._participant.node.get_publishers_info_by_topic(part_of(action, "feedback"))
        return frozenset(bytes(each.endpoint_gid) for each in infos)

    async def _open(self, action: str, type_name: str) -> _Action:
        """Return an action that somebody serves, and listen to its feedback from now on."""
        action_class = find_message(type_name, "action")
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

    async def _pursue(self, goal: RclpyGoal, used: _Action, request: Any) -> None:  # noqa: ANN401
        """Wait for the server's answers, which may be none at all."""
        with goal.scope:
            try:
                end = REFUSED
                if (await self._services.ask(used.send, request)).accepted:
                    self._accept(goal)
                    end = await self._wait_for_result(used, request.goal_id)
            except LinkError as error:
                end = ActionEnd(status=None, is_result=False, values=error.message)
            self._goals.pop(goal.goal_id, None)
            goal.take_end(end)

    async def _wait_for_result(self, used: _Action, goal_id: Any) -> ActionEnd:  # noqa: ANN401
        question = used.action_class.Impl.GetResultService.Request()
        question.goal_id = goal_id
        answer = await self._services.ask(used.result, question)
        return ActionEnd(
            status=int(answer.status), is_result=True, values=read_message(answer.result)
        )

    def _accept(self, goal: RclpyGoal) -> None:
        if not goal.is_accepted:
            goal.take_acceptance()

    async def _ask_to_cancel(self, goal: ActionGoal) -> None:
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
        if goal_id in self._goals:
            feedback = read_message(message.feedback)
            self._participant.hand_over(self._give_feedback, goal_id, feedback)

    def _give_feedback(self, goal_id: str, feedback: Message) -> None:
        goal = self._goals.get(goal_id)
        if goal is not None:
            self._accept(goal)
            goal.take_feedback(feedback)


def part_of(action: str, name: str) -> str:
    """Return the full name of one of the services and topics that an action consists of."""
    return f"{action}/_action/{name}"


def _uuid(goal_id: str) -> dict[str, bytes]:
    return {"uuid": bytes.fromhex(goal_id)}
