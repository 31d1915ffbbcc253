"""Models as agents: one loop of tool calls, and who may be asked in it."""

from mapspeak.evaluation.agents.models.loop import ModelAgent
from mapspeak.evaluation.agents.models.mind import (
    Ending,
    Mind,
    MockMind,
    Reply,
    Talk,
    Thinking,
    ToolCallRequest,
    Usage,
)

__all__ = [
    "Ending",
    "Mind",
    "MockMind",
    "ModelAgent",
    "Reply",
    "Talk",
    "Thinking",
    "ToolCallRequest",
    "Usage",
]
