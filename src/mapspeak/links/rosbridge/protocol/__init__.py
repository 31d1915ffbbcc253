"""The rosbridge protocol without I/O: frames in, events out; operations as text."""

from mapspeak.links.rosbridge.protocol.bounds import MAX_FRAME_BYTES, FrameFault
from mapspeak.links.rosbridge.protocol.codec import require_cbor
from mapspeak.links.rosbridge.protocol.conversation import LIGHT_BYTES, Conversation
from mapspeak.links.rosbridge.protocol.operations import (
    Encoding,
    Event,
    FrameRefused,
    GoalEnded,
    GoalFedBack,
    Published,
    ServiceAnswered,
    StatusNoted,
    write_operation,
)

__all__ = [
    "LIGHT_BYTES",
    "MAX_FRAME_BYTES",
    "Conversation",
    "Encoding",
    "Event",
    "FrameFault",
    "FrameRefused",
    "GoalEnded",
    "GoalFedBack",
    "Published",
    "ServiceAnswered",
    "StatusNoted",
    "require_cbor",
    "write_operation",
]
