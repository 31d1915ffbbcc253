"""How topics are asked for and services called, again where rosbridge has not found one yet."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import anyio

from mapspeak.errors import LinkError
from mapspeak.links.rosbridge.channel import Channel
from mapspeak.links.rosbridge.protocol import Encoding, write_operation
from mapspeak.ros import new_id
from mapspeak.ros.link import TopicRequest

ROSAPI = "/rosapi/"
UNKNOWN = "does not exist"
"""In rosbridge's words; such a call has reached nobody, so it may be made again."""
LOOK_AGAIN_S = 0.1


class ServiceCaller:
    """Calls services, each over the channel that is free.

    rosbridge and rosapi are two nodes: what one of them knows the other may find a moment later.
    """

    def __init__(self, choose: Callable[[], Channel]) -> None:
        self._choose = choose

    async def call(
        self,
        service: str,
        arguments: Mapping[str, Any],
        *,
        type_name: str | None,
        timeout_s: float,
    ) -> dict[str, Any]:
        """Return what a service answers, as the port says."""
        until_s = anyio.current_time() + timeout_s
        left_s = timeout_s
        while True:
            try:
                return await self._call_once(service, arguments, type_name, left_s)
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
        values = await self._choose().call(text, call_id=call_id, what=service, timeout_s=timeout_s)
        return values if isinstance(values, dict) else {}


ENCODINGS = (Encoding.CBOR, Encoding.CBOR, Encoding.JSON)
"""Of bulky messages: asked for so first, and again, and again.

Where CBOR is beyond the server's size limit it is dropped in silence, while JSON comes in pieces.
"""


@dataclass(slots=True, eq=False)
class RosbridgeTopicRequest(TopicRequest):
    """How a topic was asked for.

    Attributes:
        operation_id: Under which the server knows it.
        channel: Over which it was asked for.
    """

    operation_id: str = ""
    channel: Channel | None = None

    @property
    def encoding(self) -> Encoding:
        """How the server is to write the messages."""
        if not self.is_bulky:
            return Encoding.JSON
        return ENCODINGS[min(self.n_renewals, len(ENCODINGS) - 1)]
