"""Models as agents: one loop of tool calls, and who may be asked in it."""

from mapspeak.evaluation.agents.models.loop import ModelAgent
from mapspeak.evaluation.agents.models.mind import (
    Ending,
    Mind,
    Reply,
    Talk,
    Thinking,
    ToolCallRequest,
    Usage,
)
from mapspeak.evaluation.agents.models.mock import MockMind

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
