"""The port of models: what is said to one, what it says and wishes to have called; and a mock."""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
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
        tool: Its name.
        arguments: What to call it with.
        mistake: Why it cannot be called as it was written; None where it can.
    """

    id: str
    tool: str
    arguments: dict[str, Any] = field(default_factory=dict)
    mistake: str | None = None


@dataclass(frozen=True, slots=True)
class Usage:
    """What one request has cost, as the model's API counts.

    Attributes:
        n_input_tokens: Read, cached ones included.
        n_output_tokens: Written, thoughts included.
    """

    n_input_tokens: int
    n_output_tokens: int


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
        text: In words.
        wishes: Calls that it wants made, in their order; none when it has finished.
        usage: What it has cost; None where the API does not say.
        ending: Why it ends.
    """

    text: str
    wishes: tuple[ToolCallRequest, ...] = ()
    usage: Usage | None = None
    ending: Ending = Ending.ITS_OWN


class Talk(Protocol):
    """One conversation, which keeps all that was said in it."""

    async def ask(self) -> Reply:
        """Return the model's answer to all that was said so far.

        Raises:
            LinkError: The model cannot be reached, or does not take what it was asked.
        """
        ...

    def tell(self, wish: ToolCallRequest, answer: ToolAnswer) -> None:
        """Say what a call was answered, with its pictures, or the error as an error."""
        ...


class Mind(Protocol):
    """A model that can be talked to."""

    def begin(self, *, system: str, prompt: str, tools: Sequence[Tool], seed: int) -> Talk:
        """Begin a conversation.

        Args:
            system: What it is told before.
            prompt: What it is asked.
            tools: What it may call, as the server lists it.
            seed: Of its draws, where it takes one.
        """
        ...


CHARACTERS_PER_TOKEN = 4
IDS = re.compile(r"\b[RCFW]\d+\b")
POSE = re.compile(r'(?:x |"x":)(-?[\d.]+?), ?(?:y |"y":)(-?[\d.]+?)[,}]')
MOST_DRIVES = 3
NEAR_M = 1.0
SAYINGS = ("1", "unreachable", "12.5 m2", "8.0 m", "A", "none", "1.0, -2.0")


@dataclass(frozen=True, slots=True, kw_only=True)
class Move:
    """What the script does next.

    Attributes:
        text: What it says.
        tool: What it calls; None when it has finished.
        arguments: What it calls it with.
    """

    text: str
    tool: str | None = None
    arguments: dict[str, Any] = field(default_factory=dict)


def decide(seed: int, *, prompt: str, heard: Sequence[str], tools: Collection[str]) -> Move:
    """Return the next move: it looks, errs once, drives a little, and answers.

    Args:
        seed: Of its draws.
        prompt: What it was asked.
        heard: The answers to its calls so far, in their order.
        tools: What it may call.
    """
    is_question = "Answer without driving" in prompt
    random = np.random.default_rng([seed, len(heard)])
    n_drives = 0 if is_question else int(np.random.default_rng(seed).integers(1, MOST_DRIVES + 1))
    opening = [
        Move(text="I look at the map.", tool="look_at_map"),
        Move(text="I look ahead.", tool="look_through_camera"),
        Move(text="I ask for what is not there.", tool="describe_place", arguments={"place": "R0"}),
        Move(text="I look at the ROS.", tool="ros_overview"),
        Move(text="I read a topic.", tool="ros_read", arguments={"topic": "/tf"}),
        Move(text="I read what is not there.", tool="ros_topic", arguments={"topic": "/none"}),
    ]
    driving = [_drive(random, heard)] * n_drives
    plan = [move for move in (*opening, *driving) if move.tool in tools]
    if len(heard) < len(plan):
        return plan[len(heard)]
    return Move(text=f"ANSWER: {random.choice(SAYINGS) if is_question else 'there'}")


def count_mock_tokens(text: str) -> int:
    """Return what stands for tokens where there is no model: characters by four."""
    return len(text) // CHARACTERS_PER_TOKEN


def _drive(random: np.random.Generator, heard: Sequence[str]) -> Move:
    """Drive to an id that it has read, else to a point near the pose that it has read."""
    first = heard[0] if heard else ""
    ids = sorted(set(IDS.findall(first)))
    if ids:
        place = str(random.choice(ids))
    else:
        pose = POSE.search(first)
        x, y = (float(pose[1]), float(pose[2])) if pose else (0.0, 0.0)
        x, y = np.array([x, y]) + random.uniform(-NEAR_M, NEAR_M, 2)
        place = f"{x:.2f}, {y:.2f}"
    return Move(
        text=f"I drive to {place}.",
        tool="navigate_to",
        arguments={"place": place, "wait_s": 25.0},
    )


@dataclass(slots=True)
class _MockTalk:
    seed: int
    prompt: str
    tools: tuple[str, ...]
    n_read: int
    heard: list[str] = field(default_factory=list)

    async def ask(self) -> Reply:
        move = decide(self.seed, prompt=self.prompt, heard=self.heard, tools=self.tools)
        usage = Usage(
            n_input_tokens=self.n_read,
            n_output_tokens=count_mock_tokens(move.text),
        )
        wish = () if move.tool is None else (self._wish(move.tool, move.arguments),)
        return Reply(text=move.text, wishes=wish, usage=usage)

    def tell(self, wish: ToolCallRequest, answer: ToolAnswer) -> None:
        del wish
        self.heard.append(answer.text)
        self.n_read += count_mock_tokens(answer.text)

    def _wish(self, tool: str, arguments: dict[str, Any]) -> ToolCallRequest:
        return ToolCallRequest(id=f"call-{len(self.heard)}", tool=tool, arguments=arguments)


@dataclass(frozen=True, slots=True)
class MockMind:
    """Answers by the script; its "tokens" are characters by four, and its pictures are not read."""

    def begin(self, *, system: str, prompt: str, tools: Sequence[Tool], seed: int) -> Talk:
        """Begin a conversation."""
        return _MockTalk(
            seed=seed,
            prompt=prompt,
            tools=tuple(tool.name for tool in tools),
            n_read=count_mock_tokens(system) + count_mock_tokens(prompt),
        )
