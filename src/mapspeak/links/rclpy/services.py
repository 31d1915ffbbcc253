"""The services that we call, each with its client kept for the next call."""

from collections.abc import Mapping
from typing import Any

import anyio

from mapspeak.errors import LinkError
from mapspeak.links.rclpy.messages import read_message, write_message
from mapspeak.links.rclpy.participant import RclpyParticipant, errors_of_ros, wait_until
from mapspeak.links.rclpy.types import find_service
from mapspeak.ros.messages import bare_type
from mapspeak.ros.native import check_name, wrong_type

SERVER_S = 2.0
"""For somebody who serves to be found: right after connecting, not all are known."""

Client = Any  # rclpy has no types


class RclpyServices:
    """Calls services; a call that is not answered in time is forgotten.

    Args:
        participant: Ours.
    """

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
        """Return what a service answers.

        Raises:
            LinkError: Nobody serves it, it has another type, the request does not fit, or there is
                no answer.
        """
        check_name(service)
        found = await self._find_type(service, within_s=min(timeout_s, SERVER_S))
        if type_name is not None and bare_type(type_name) != bare_type(found):
            raise wrong_type(service, found, type_name)
        service_class = find_service(found)
        request = write_message(service_class.Request, arguments)
        client = await self.connect(service, service_class, within_s=min(timeout_s, SERVER_S))
        with anyio.move_on_after(timeout_s):
            return read_message(await self.ask(client, request))
        raise LinkError(
            f"{service} did not answer within {timeout_s:g} s.",
            hint="The node that serves it may be stuck: look at its log, or restart it.",
        )

    async def connect(self, service: str, service_class: Any, *, within_s: float) -> Client:  # noqa: ANN401
        """Return a client whose service somebody serves.

        Raises:
            LinkError: Nobody does.
        """
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
