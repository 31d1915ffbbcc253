"""The port of models: what is said to one, what it says and wants to have called; and a mock."""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any, Protocol

import numpy as np
from mcp_types import Tool

from mapspeak.evaluation.client import ToolAnswer


class Thinking(StrEnum):
    """How much a model may think before it answers."""

    NONE = "none"
    LOW = "low"
    MEDIUM = "medium"
    HIGH = "high"


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolCallRequest:
    """A call that a model wants made.

    Attributes:
        id: The model's own, by which it knows the answer again.
        mistake: Why it cannot be called as it was written; None where it can.
    """

    id: str
    tool: str
    arguments: dict[str, Any] = field(default_factory=dict)
    mistake: str | None = None


class Ending(StrEnum):
    """Why a model says no more in a reply."""

    ITS_OWN = "its own"
    """It has said what it had to say."""
    REFUSED = "refused"
    """The model, or its provider for it, does not want to answer."""
    CUT_OFF = "cut off"
    """It has written as much as it may, or has more to read than it can."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Reply:
    """What a model answers to all that was said.

    Attributes:
        calls: Calls that it wants made, in their order; none when it has finished.
        n_input_tokens: Read, cached ones included; None where the API does not say.
        n_output_tokens: Written, thoughts included.
    """

    text: str
    calls: tuple[ToolCallRequest, ...] = ()
    n_input_tokens: int | None = None
    n_output_tokens: int | None = None
    ending: Ending = Ending.ITS_OWN


class ModelConversation(Protocol):
    """One conversation, which keeps all that was said in it."""

    async def ask(self) -> Reply:
        """Return the model's answer to all that was said so far.

        Raises:
            LinkError: The model cannot be reached, or does not take what it was asked.
        """
        ...

    def tell(self, call: ToolCallRequest, answer: ToolAnswer) -> None:
        """Say what a call was answered, with its pictures, or the error as an error."""
        ...


class ChatModel(Protocol):
    """A model that can be talked to."""

    def begin(
        self, *, system: str, prompt: str, tools: Sequence[Tool], seed: int
    ) -> ModelConversation:
        """Begin a conversation.

        Args:
            seed: Of its draws, where it takes one.
        """
        ...


CHARACTERS_PER_TOKEN = 4
"""The mock's tokens; it does not read its pictures."""
IDS = re.compile(r"\b[RCFW]\d+\b")
POSE = re.compile(r'(?:x |"x":)(-?[\d.]+?), ?(?:y |"y":)(-?[\d.]+?)[,}]')
MOST_DRIVES = 3
NEAR_M = 1.0
ANSWERS = ("1", "unreachable", "12.5 m2", "8.0 m", "A", "none", "1.0, -2.0")
OPENING: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("I look at the map.", "look_at_map", {}),
    ("I look ahead.", "look_through_camera", {}),
    ("I ask for what is not there.", "describe_place", {"place": "R0"}),
    ("I look at the ROS.", "ros_overview", {}),
    ("I read a topic.", "ros_read", {"topic": "/tf"}),
    ("I read what is not there.", "ros_topic", {"topic": "/none"}),
)


def decide(seed: int, *, prompt: str, heard: Sequence[str], tools: Collection[str]) -> Reply:
    """Return the mock's next reply: it looks, errs once, drives a little, and answers.

    Args:
        seed: Of its draws.
        heard: The answers to its calls so far, in their order.
    """
    is_question = "Answer without driving" in prompt
    random = np.random.default_rng([seed, len(heard)])
    n_drives = 0 if is_question else int(np.random.default_rng(seed).integers(1, MOST_DRIVES + 1))
    place = _choose_place(random, heard[0] if heard else "")
    opening = [move for move in OPENING if move[1] in tools]
    if len(heard) < len(opening):
        text, tool, arguments = opening[len(heard)]
    elif "navigate_to" in tools and len(heard) < len(opening) + n_drives:
        text, tool = f"I drive to {place}.", "navigate_to"
        arguments = {"place": place, "wait_s": 25.0}
    else:
        return Reply(text=f"ANSWER: {random.choice(ANSWERS) if is_question else 'there'}")
    call = ToolCallRequest(id=f"call-{len(heard)}", tool=tool, arguments=arguments)
    return Reply(text=text, calls=(call,))


def _choose_place(random: np.random.Generator, first: str) -> str:
    """Return an id that it has read first, else a point near the pose that it has read."""
    ids = sorted(set(IDS.findall(first)))
    if ids:
        return str(random.choice(ids))
    pose = POSE.search(first)
    x, y = (float(pose[1]), float(pose[2])) if pose else (0.0, 0.0)
    x, y = np.array([x, y]) + random.uniform(-NEAR_M, NEAR_M, 2)
    return f"{x:.2f}, {y:.2f}"


@dataclass(slots=True)
class MockModel:
    """Answers by the script."""

    _seed: int = 0
    _prompt: str = ""
    _tools: tuple[str, ...] = ()
    _n_read: int = 0
    _heard: list[str] = field(default_factory=list)

    def begin(
        self, *, system: str, prompt: str, tools: Sequence[Tool], seed: int
    ) -> ModelConversation:
        """Begin a conversation."""
        names = tuple(tool.name for tool in tools)
        return MockModel(seed, prompt, names, _count_tokens(system) + _count_tokens(prompt))

    async def ask(self) -> Reply:
        """Return what the script says next."""
        reply = decide(self._seed, prompt=self._prompt, heard=self._heard, tools=self._tools)
        n_written = _count_tokens(reply.text)
        return replace(reply, n_input_tokens=self._n_read, n_output_tokens=n_written)

    def tell(self, call: ToolCallRequest, answer: ToolAnswer) -> None:
        """Remember an answer."""
        del call
        self._heard.append(answer.text)
        self._n_read += _count_tokens(answer.text)


def _count_tokens(text: str) -> int:
    return len(text) // CHARACTERS_PER_TOKEN
