"""The mock model: no model at all, but a seeded script that behaves like one.

It shows that everything around a model works - tools, pictures, errors, accounts, limits - and says
nothing about any model. The same seed and the same answers give the same words.
"""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from mcp_types import Tool

from mapspeak.evaluation.agents.models.mind import Reply, Talk, ToolCallRequest, Usage
from mapspeak.evaluation.client import ToolAnswer

__all__ = ["MockMind", "Move", "count_mock_tokens", "decide"]

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
