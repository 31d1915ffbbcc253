"""The services and actions that we use, each with its topics opened once and kept."""

from collections.abc import Mapping
from typing import Any

import anyio

from mapspeak.errors import LinkError
from mapspeak.links.dds.discovery import Endpoint
from mapspeak.links.dds.endpoints import (
    SERVICE_PART,
    Sample,
    action_type_of,
    dds_topic,
    reply_topic,
    request_topic,
)
from mapspeak.links.dds.graph import DdsGraph
from mapspeak.links.dds.participant import DdsParticipant
from mapspeak.links.dds.services import DdsActionClient, ServiceClient
from mapspeak.ros.activity import ActionGoal
from mapspeak.ros.link import check_name, wrong_type
from mapspeak.ros.messages.fields import Message, bare_type

APPEARANCE_S = 1.0
"""For a service to be found that is asked for, in wall time."""


class Calls:
    """Calls services, and pursues goals.

    Args:
        connection: Knows who serves what, and how types look.
    """

    def __init__(self, connection: DdsGraph, participant: DdsParticipant) -> None:
        self._connection = connection
        self._discovery = connection.discovery
        self._participant = participant
        self._services: dict[str, ServiceClient] = {}
        self._actions: dict[str, DdsActionClient] = {}
        self._news = anyio.Event()

    async def call(
        self,
        service: str,
        arguments: Mapping[str, Any],
        *,
        type_name: str | None,
        timeout_s: float,
    ) -> Sample:
        """Return what a service answers, and when it did."""
        check_name(service)
        found = self._discovery.service_type(service)
        if type_name is not None and found not in (None, bare_type(type_name)):
            raise wrong_type(service, str(found), type_name)
        client = await self._service(service)
        return await client.call(client.encode(arguments), timeout_s=timeout_s)

    async def send_goal(
        self, action: str, arguments: Message, *, type_name: str, timeout_s: float
    ) -> ActionGoal:
        """Send a goal and return what becomes of it, as it becomes."""
        check_name(action)
        found = self._discovery.actions.get(action)
        if found not in (None, bare_type(type_name)):
            raise wrong_type(action, str(found), type_name)
        client = self._actions.get(action) or await self._open_action(action)
        return await client.send_goal(action, arguments, timeout_s=timeout_s)

    def cancel_goal(self, goal: ActionGoal) -> None:
        """Ask for the end of a goal."""
        if goal.action in self._actions:
            self._actions[goal.action].cancel_goal(goal.goal_id)

    def note_change(self, dds_name: str) -> None:
        """Take in that others have begun or ended to read or write a topic."""
        news, self._news = self._news, anyio.Event()
        news.set()
        for action, client in self._actions.items():
            if dds_name == reply_topic(_part(action, "send_goal")):
                client.note_servers([each.key for each in self._discovery.writers_of(dds_name)])
        for service, asked in self._services.items():
            if reply_topic(service) == dds_name:
                server = self._discovery.server_of(service)
                asked.note_server(None if server is None else server.framing)

    async def _find_server(self, service: str) -> Endpoint | None:
        """Find who serves a service; right after opening, others are still found bit by bit.

        Who serves it is found by its answers; what it takes is told by who reads the requests.
        """
        with anyio.move_on_after(APPEARANCE_S):
            while self._discovery.server_of(service) is None:
                await self._news.wait()
            while not self._discovery.readers_of(request_topic(service)):
                await self._news.wait()
        return self._discovery.server_of(service)

    async def _service(self, service: str) -> ServiceClient:
        server = await self._find_server(service)
        if server is None:
            raise LinkError(
                f"Nobody serves {service[:80]}.",
                hint="Ask for the list of services; the node that offers it may have ended.",
            )
        type_name = SERVICE_PART.sub("", server.type_name)
        await self._connection.learn(server, f"{type_name}_Request", f"{type_name}_Response")
        if service not in self._services:
            self._services[service] = ServiceClient(
                self._participant,
                service,
                type_name,
                framing=server.framing,
                types=self._connection.types,
            )
        return self._services[service]

    async def _open_action(self, action: str) -> DdsActionClient:
        send, result, cancel = [
            await self._service(_part(action, name))
            for name in ("send_goal", "get_result", "cancel_goal")
        ]
        if action in self._actions:
            return self._actions[action]
        client = DdsActionClient(
            send=send, result=result, cancel=cancel, start_soon=self._connection.start_soon
        )
        self._actions[action] = client
        self.note_change(reply_topic(send.service))
        await self._learn_feedback(action)
        for name, take in (("status", client.take_statuses), ("feedback", client.take_feedback)):
            subscription = self._connection.subscribe(_part(action, name))
            subscription.listen(take)
            if name == "status" and subscription.latest is not None:
                take(subscription.latest)
        return client

    async def _learn_feedback(self, action: str) -> None:
        writers = self._discovery.writers_of(dds_topic(_part(action, "feedback")))
        if writers:
            await self._connection.learn(
                writers[0], f"{action_type_of(writers[0].type_name)}_Feedback"
            )


def _part(action: str, name: str) -> str:
    return f"{action}/_action/{name}"
