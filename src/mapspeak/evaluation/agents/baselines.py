"""The best and the worst to compare with: an oracle that knows the truth, and a random agent."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mapspeak.evaluation.agents.scripted import ScriptedAgent
from mapspeak.evaluation.client import ToolClient
from mapspeak.evaluation.driver import ARRIVED, ToolDriver
from mapspeak.evaluation.scores.site import GroundTruth
from mapspeak.evaluation.trials import Agent, AgentEnd, Assignment, ServerAccess, Setting
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import Cell
from mapspeak.spatial.grid import Mask
from mapspeak.spatial.paths import clearance_m

BESIDE_M = 3.0
MOST_GOALS = 6


@dataclass(frozen=True, slots=True)
class OracleAgent:
    """Drives to where truth says, and answers what truth says; explores as the script does."""

    setting: Setting
    site: GroundTruth
    name: str = "oracle"
    connection: ServerAccess = ServerAccess.MEMORY

    async def run(self, task: Assignment, tools: ToolClient) -> AgentEnd:
        """Carry out the assignment."""
        truth, driver = self.setting.truth, ToolDriver(tools)
        known = _known_answer(truth)
        if known is not None:
            return AgentEnd(answer=f"ANSWER: {known}")
        if not self.setting.is_known or not truth:
            script: Agent = ScriptedAgent()
            return await script.run(task, tools)
        for goals in self._stops():
            if not await _drive_to_one(driver, goals):
                return AgentEnd(answer="The robot cannot get there.")
        return AgentEnd(answer="ANSWER: there")

    def _stops(self) -> list[list[Pose]]:
        """Return poses for each stop that are right, the roomiest first."""
        truth, site = self.setting.truth, self.site
        if "goal" in truth:
            goal = Point(*truth["goal"])
            return [[Pose(goal.x, goal.y), *self._roomiest(site.near(goal, 0.3))]]
        if "rooms" in truth or "room" in truth:
            names = truth.get("rooms") or [truth["room"]]
            cells = [site.cells_of(site.room_named(name)) for name in names]
            return [self._roomiest(np.logical_or.reduce(cells))]
        return [self._beside(kind) for kind in truth.get("kinds") or [truth["kind"]]]

    def _beside(self, kind: str) -> list[Pose]:
        poses: list[Pose] = []
        for thing in self.site.things(kind):
            place = self.site.place_of(thing)
            poses += [
                Pose(pose.x, pose.y, pose.point.bearing_to(place))
                for pose in self._roomiest(self.site.seen_around(thing, BESIDE_M))
            ]
        return poses

    def _roomiest(self, cells: Mask) -> list[Pose]:
        site = self.site
        room = np.where(cells & site.drivable, clearance_m(site.grid), -1.0)
        best = np.argsort(room, axis=None)[::-1][: MOST_GOALS * 40 : 40]
        rows, cols = np.unravel_index(best, room.shape)
        places = [
            site.grid.point_at(Cell(int(row), int(col)))
            for row, col in zip(rows, cols, strict=True)
            if room[row, col] > 0
        ]
        return [Pose(place.x, place.y) for place in places]


def _known_answer(truth: Mapping[str, Any]) -> str | None:
    """Return the right answer of a question that needs no drive; None for all else."""
    if "said" in truth:
        return str(truth["said"])
    if "number" in truth:
        return f"{truth['number']} {truth['unit']}".rstrip()
    if "letters" in truth:
        return ", ".join(truth["letters"]) or "none"
    return "unreachable" if truth.get("answer") == "unreachable" else None


async def _drive_to_one(driver: ToolDriver, goals: list[Pose]) -> bool:
    for goal in goals:
        if await driver.drive(x=goal.x, y=goal.y, yaw_deg=goal.yaw_deg) == ARRIVED:
            return True
    return False


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
