"""A seeded script in a model's place, to try everything around a model."""

import re
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from mcp_types import Tool

from mapspeak.evaluation.agent import Assignment
from mapspeak.evaluation.agents.models.chat import AnsweredCalls, Reply, ToolCallRequest

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
        heard: The answers to its calls so far, in order.
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


class MockModel:
    """Answers by the script: one conversation."""

    def __init__(self, task: Assignment, tools: Sequence[Tool]) -> None:
        self._task = task
        self._tools = {tool.name for tool in tools}
        self._heard: list[str] = []

    async def ask(self, answers: AnsweredCalls) -> Reply:
        """Return what the script says next."""
        self._heard += [answer.text for _, answer in answers]
        task = self._task
        reply = decide(task.seed, prompt=task.prompt, heard=self._heard, tools=self._tools)
        read = (task.system, task.prompt, *self._heard)
        return replace(
            reply,
            n_input_tokens=sum(map(_count_tokens, read)),
            n_output_tokens=_count_tokens(reply.text),
        )


def _count_tokens(text: str) -> int:
    return len(text) // CHARACTERS_PER_TOKEN
