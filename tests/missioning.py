"""Missions of a robot for tests, run by the tools of an MCP client."""

from collections.abc import AsyncGenerator, Sequence
from contextlib import asynccontextmanager
from pathlib import Path

import anyio
import anyio.lowlevel
from mcp.client import Client

from fakes import FakeRobot, two_rooms
from mapspeak.memory import SemanticMapStore
from mapspeak.robot import CameraPicture, Robot
from mapspeak.safety import Guard
from mapspeak.server.app import MapspeakServer, build_server
from mapspeak.session import Session
from mapspeak.skill import Skill
from mapspeak.skills.skillsfile import OwnersEntry, load_skills
from rosserved import Caller

PATIENCE_S = 60.0


class MissionRobot(FakeRobot):
    """Lets others do something in every sleep, and waits in its drives for as long as a test says.

    Its skills and its battery are what a test gives it.
    """

    def __init__(self, skills: Sequence[Skill] = ()) -> None:
        super().__init__(two_rooms())
        self._skills = skills
        self.battery: float | None = 0.8
        self.may_drive = anyio.Event()
        self.may_drive.set()
        self.stopped = anyio.Event()
        self.n_pictures = 0

    async def sleep(self, duration_s: float) -> None:
        await anyio.lowlevel.checkpoint()
        await self.may_drive.wait()
        await super().sleep(duration_s)

    def build_skills(self, driven: Robot) -> Sequence[Skill]:
        del driven
        return self._skills

    async def stop(self) -> None:
        await super().stop()
        self.stopped.set()

    async def fetch_battery(self) -> float | None:
        return self.battery

    async def fetch_picture(self, camera: str | None = None) -> CameraPicture:
        self.n_pictures += 1
        return await super().fetch_picture(camera)


class MissionCaller(Caller):
    """Calls the tools of missions."""

    def __init__(
        self, client: Client, server: MapspeakServer, session: Session, robot: MissionRobot
    ) -> None:
        super().__init__(client)
        self.server = server
        self.session = session
        self.robot = robot

    async def until(self, state: str) -> str:
        """Asks how the latest run stands until it has come to a state."""
        with anyio.fail_after(PATIENCE_S):
            while f"): {state} after" not in (told := await self.ask("skill_status", wait_s=0.05)):
                pass
        return told


@asynccontextmanager
async def missions(
    folder: Path,
    *skills: Skill,
    guard: Guard | None = None,
    skills_file: str = "",
    toolsets: tuple[str, ...] = ("drive", "missions"),
) -> AsyncGenerator[MissionCaller]:
    """Gives what calls the tools over a robot in two rooms, where it may do what is asked."""
    robot = MissionRobot(skills)
    memory = SemanticMapStore(folder / "semantic_map.yaml")
    session = Session(
        robot, memory, lease_s=60.0, guard=guard, skilled=robot, find_model=lambda: None
    )
    entries: tuple[OwnersEntry, ...] = ()
    if skills_file:
        path = folder / "skills.yaml"
        path.write_text(skills_file)
        entries = load_skills(path)
    server = build_server(session, toolsets=toolsets, skills=entries)
    with anyio.fail_after(PATIENCE_S):
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(server.keep_skills)
            async with Client(server) as client:
                yield MissionCaller(client, server, session, robot)
            tasks.cancel_scope.cancel()
