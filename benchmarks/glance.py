"""How much a model reads while it explores a building by the tools, one frontier after the other.

Each step is a `look_at_map`, the first frontier of its table, a drive there and a picture: the way
of the paper, with a script in place of the model.
"""

import re
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import anyio
from mcp.client import Client
from mcp_types import TextContent

from benchmarks.figure import Figure
from mapspeak.links.simulated import SoloRobot
from mapspeak.memory import SemanticMapStore
from mapspeak.server.app import build_server
from mapspeak.session import Session
from mapspeak.simulator import Simulation, load_world

__all__ = ["measure"]

WORLDS = ("office", "clinic_2", "school_1")
MOST_GOALS = 60
WAIT_S = 25
FIRST_FRONTIER = re.compile(r"^## Frontiers.*\n.*\n(F\d+) \|", re.MULTILINE)


class Reader:
    """Calls tools and counts the characters of what they say."""

    def __init__(self, client: Client) -> None:
        self._client = client
        self.lengths: dict[str, list[int]] = defaultdict(list)

    async def call(self, tool: str, **arguments: object) -> str:
        """Call a tool; return its text."""
        result = await self._client.call_tool(tool, arguments)
        text = "\n".join(each.text for each in result.content if isinstance(each, TextContent))
        self.lengths[tool].append(len(text))
        return text

    @property
    def n_all(self) -> int:
        """The characters of all answers."""
        return sum(map(sum, self.lengths.values()))


async def explore(world: str, folder: Path) -> Reader:
    """Explore a world until no frontier is left."""
    robot = SoloRobot(Simulation(load_world(world), seed=7), has_detector=True)
    memory = SemanticMapStore(folder / "memory.yaml", map_id=robot.description.map_name)
    session = Session(robot, memory, lease_s=60.0, find_model=lambda: None)
    async with Client(build_server(session, toolsets=("look", "places", "drive"))) as client:
        reader = Reader(client)
        for _ in range(MOST_GOALS):
            frontier = FIRST_FRONTIER.search(await reader.call("look_at_map"))
            if frontier is None:
                break
            told = await reader.call("navigate_to", place=frontier[1], wait_s=WAIT_S)
            while '"driving"' in told:
                told = await reader.call("wait_for_goal", wait_s=WAIT_S)
            await reader.call("look_through_camera")
    return reader


def measure() -> Iterator[Figure]:
    """Explore some buildings, and count what was said."""
    for world in WORLDS:
        with tempfile.TemporaryDirectory() as folder:
            reader = anyio.run(explore, world, Path(folder))
        looks = reader.lengths["look_at_map"]
        figures = {
            "all that is said": (reader.n_all, "characters"),
            f"look_at_map, mean of {len(looks)}": (sum(looks) / len(looks), "characters"),
            "drives": (len(reader.lengths["navigate_to"]), ""),
        }
        for name, (value, unit) in figures.items():
            yield Figure(name=f"{world}: {name}", value=value, unit=unit)
