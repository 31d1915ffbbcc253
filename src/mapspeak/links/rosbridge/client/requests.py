"""How a topic was asked for."""

from dataclasses import dataclass

from mapspeak.links.ros import TopicSubscription
from mapspeak.links.rosbridge.client.channel import Channel
from mapspeak.links.rosbridge.protocol import Encoding

ENCODINGS = (Encoding.CBOR, Encoding.CBOR, Encoding.JSON)
"""Of bulky messages: asked for so first, and again, and again.

Where CBOR is beyond the server's size limit it is dropped in silence, while JSON comes in pieces.
"""


@dataclass(slots=True, eq=False)
class TopicRequest:
    """How a topic was asked for.

    Attributes:
        subscription: Of the topic.
        is_bulky: See `ENCODINGS`.
        throttle_ms: The least time between two messages.
        n_renewals: How often it was asked for anew.
        operation_id: Under which the server knows it.
        channel: Over which it was asked for.
    """

    subscription: TopicSubscription
    is_bulky: bool
    throttle_ms: int
    n_renewals: int = 0
    operation_id: str = ""
    channel: Channel | None = None

    @property
    def encoding(self) -> Encoding:
        """How the server is to write the messages."""
        if not self.is_bulky:
            return Encoding.JSON
        return ENCODINGS[min(self.n_renewals, len(ENCODINGS) - 1)]
