"""The random agent: goes to ids it reads on the map, and answers with what it draws."""

import re
from dataclasses import dataclass

import numpy as np

from mapspeak.evaluation.agents.driver import ToolDriver
from mapspeak.evaluation.client import ToolClient
from mapspeak.evaluation.trials import AgentEnd, Assignment, ServerAccess
from mapspeak.geometry import Point

__all__ = ["RandomAgent"]

MOST_DRIVES = 3
MOST_SAID = 50.0


@dataclass(frozen=True, slots=True)
class RandomAgent:
    """What chance alone is worth: the floor under every other agent's figures."""

    name: str = "random"
    connection: ServerAccess = ServerAccess.MEMORY

    async def run(self, task: Assignment, tools: ToolClient) -> AgentEnd:
        """Drive to some places that the map names, or answers."""
        random, driver = np.random.default_rng(task.seed), ToolDriver(tools)
        if "Answer without driving" in task.prompt:
            return AgentEnd(answer=f"ANSWER: {await _say(task.prompt, random, driver)}")
        for _ in range(int(random.integers(1, MOST_DRIVES + 1))):
            view = await driver.look()
            ids = [row.id for rows in view.tables.values() for row in rows]
            if ids:
                await driver.drive(place=str(random.choice(ids)))
        return AgentEnd(answer="ANSWER: there")


async def _say(prompt: str, random: np.random.Generator, driver: ToolDriver) -> str:
    form = prompt.rpartition("ANSWER:")[2]
    if "-2.0" in form:
        here: Point = (await driver.find_pose()).point
        shift = random.normal(0.0, 3.0, 2)
        return f"{here.x + shift[0]:.1f}, {here.y + shift[1]:.1f}"
    if "none" in form:
        letters = sorted(set(re.findall(r"\b([A-H]) \(", prompt)))
        chosen = [letter for letter in letters if random.random() < 0.5]
        return ", ".join(chosen) or "none"
    if "m" in form:
        return f"{random.uniform(0.0, MOST_SAID):.1f} {'m2' if 'm2' in form else 'm'}"
    return str(int(random.integers(1, 6)))
