"""The rosbridge protocol without I/O: frames in, events out; operations as text."""

from mapspeak.links.rosbridge.protocol.bounds import MAX_FRAME_BYTES
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
    advertise,
    authenticate,
    call_service,
    cancel_action_goal,
    publish,
    send_action_goal,
    subscribe,
    unadvertise,
    unsubscribe,
)

__all__ = [
    "LIGHT_BYTES",
    "MAX_FRAME_BYTES",
    "Conversation",
    "Encoding",
    "Event",
    "FrameRefused",
    "GoalEnded",
    "GoalFedBack",
    "Published",
    "ServiceAnswered",
    "StatusNoted",
    "advertise",
    "authenticate",
    "call_service",
    "cancel_action_goal",
    "publish",
    "require_cbor",
    "send_action_goal",
    "subscribe",
    "unadvertise",
    "unsubscribe",
]
