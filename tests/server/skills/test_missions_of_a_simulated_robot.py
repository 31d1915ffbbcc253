"""Missions on the simulated robot, and over its rosbridge as either ROS, to the same deeds."""

import math
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import anyio
import anyio.lowlevel
import pytest
from mcp.client import Client

from guarding import audit_of, make_guard, rectangle
from mapspeak.geometry import Pose
from mapspeak.links.rosbridge import RobotAddress, open_rosbridge_robot
from mapspeak.links.simulated import SimulatedRobot
from mapspeak.memory import SemanticMapStore
from mapspeak.ros.messages.fields import Dialect
from mapspeak.rosbridge_server import open_rosbridge_server
from mapspeak.safety import CommandKind, Policy
from mapspeak.server.app import build_server
from mapspeak.session import Session
from mapspeak.simulator import Simulation, StateRecord
from mapspeak.skills.skillsfile import OwnersEntry, load_skills
from rosserved import Caller
from skilledworld import make_workshop

pytestmark = pytest.mark.anyio
SIMULATED = "simulated"
links = pytest.mark.parametrize("link", [SIMULATED, *Dialect])
PATIENCE_S = 120.0
BY_ROS = """skills:
- {name: open_door, sentence: Opens the door, service: /robot_skills/open_door}
- {name: lift_pallet, sentence: Lifts a pallet, service: /robot_skills/lift_pallet}
"""
WIDTH = {SIMULATED: "{opened.width_m}"}
"""What opening a door gives: a field of its own, or the message of a service."""


@dataclass(frozen=True)
class Worker(Caller):
    """Calls the tools of a robot before a shut door, and knows the truth."""

    client: Client
    simulation: Simulation
    driven: SimulatedRobot

    @property
    def deeds(self) -> tuple[str, ...]:
        return StateRecord.of(self.simulation).deeds

    async def until_over(self, told: str) -> str:
        while ": running after" in told:
            told = await self.ask("skill_status", wait_s=1.0)
        return told


@asynccontextmanager
async def working(
    session: Session,
    simulation: Simulation,
    driven: SimulatedRobot,
    entries: tuple[OwnersEntry, ...] = (),
) -> AsyncGenerator[Worker]:
    server = build_server(session, toolsets=("drive", "missions"), skills=entries)
    with anyio.fail_after(PATIENCE_S):
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(server.keep_skills)
            async with Client(server) as client:
                yield Worker(client, simulation, driven)
            tasks.cancel_scope.cancel()


@asynccontextmanager
async def worker(link: str, folder: Path) -> AsyncGenerator[Worker]:
    """Gives a robot whose door opens at the third try, by the link."""
    world = replace(make_workshop(folder), n_faults={"open_door": 2})
    simulation = Simulation(world, seed=1, start=Pose(4.9, 1.5))
    robot = SimulatedRobot(simulation, has_detector=False)
    memory, skills = SemanticMapStore(folder / "semantic_map.yaml"), folder / "skills.yaml"
    if link == SIMULATED:
        session = Session(robot, memory, lease_s=60.0, skilled=robot, find_model=lambda: None)
        async with working(session, simulation, robot) as found:
            yield found
        return
    skills.write_text(BY_ROS)
    async with (
        open_rosbridge_server(robot, dialect=Dialect(link), skilled=robot) as server,
        open_rosbridge_robot(RobotAddress(url=server.url)) as far,
    ):
        session = Session(far, memory, lease_s=60.0, ros=far.connection, find_model=lambda: None)
        async with working(session, simulation, robot, load_skills(skills)) as found:
            yield found


@links
async def test_steps_follow_each_other_are_tried_again_replaced_and_cut_off(
    link: str, tmp_path: Path
) -> None:
    width = WIDTH.get(link, "{opened.message}")
    tree = f"""
- check: {{battery_above: 0.1}}
- fallback:
  - lift_pallet
  - note: there is no pallet here
- fallback:
  - timeout_s: 2
    do:
    - wait: 600
  - note: that took too long
- retry: 3
  do:
  - open_door:
    as: opened
- note: "the door is open: {width}"
- drive: "0.6, 0.0"
"""
    async with worker(link, tmp_path) as robot:
        told = await robot.until_over(await robot.ask("run_mission", tree=tree, wait_s=20.0))
    assert "succeeded" in told
    assert "1.1" in told
    assert robot.deeds[-1] == "open_door: store door"
    assert [deed for deed in robot.deeds if "fault" in deed] == [
        "open_door fault: 1 left",
        "open_door fault: 0 left",
    ]
    assert robot.simulation.truth.pose.x == pytest.approx(0.6, abs=0.2)


@links
async def test_a_saved_mission_is_run_by_its_name(link: str, tmp_path: Path) -> None:
    async with worker(link, tmp_path) as robot:
        tree = "- retry: 3\n  do: [open_door]\n- drive: '{place}'\n"
        await robot.ask(
            "save_mission", name="go_through", tree=tree, parameters={"place": "0.6, 0.0"}
        )
        told = await robot.ask("run_mission", name="go_through", wait_s=20.0)
        assert "succeeded" in await robot.until_over(told)
    assert robot.deeds[-1] == "open_door: store door"


@links
async def test_a_cancelled_mission_leaves_the_robot_standing(link: str, tmp_path: Path) -> None:
    async with worker(link, tmp_path) as robot:
        tree = "- repeat: 50\n  do:\n  - drive: '-1.5, 0.0'\n  - drive: '0.2, 0.0'\n"
        told = await robot.ask("run_mission", tree=tree, wait_s=0.5)
        assert "running" in told
        ended = await robot.ask("cancel_skill", run="S1")
        assert "cancelled" in ended
        before = robot.simulation.truth.driven_m
        while robot.simulation.velocity.speed_mps:
            await robot.driven.sleep(0.1)
        settled = robot.simulation.truth.driven_m
        assert settled - before < 1.0
        assert "0" in await robot.ask("wait_for_goal", wait_s=0.0)
        assert robot.simulation.truth.driven_m == settled


async def test_docking_is_a_drive_like_any_other_to_the_policy(tmp_path: Path) -> None:
    simulation = Simulation(make_workshop(tmp_path), seed=1, start=Pose(1.7, 1.5, math.pi))
    robot = SimulatedRobot(simulation, has_detector=False)
    memory = SemanticMapStore(tmp_path / "semantic_map.yaml")
    area = rectangle("charging", (0.1, -0.8), (1.6, 0.8))
    guard = make_guard(tmp_path, Policy(areas=(area,)))
    session = Session(
        robot, memory, lease_s=60.0, guard=guard, skilled=robot, find_model=lambda: None
    )
    async with working(session, simulation, robot) as caller:
        told = await caller.refuse("dock")
    drives = [line for line in audit_of(tmp_path) if line.kind == CommandKind.DRIVE]
    assert [line.verdict for line in drives] == ["refused"]
    assert "charging" in told
    assert simulation.truth.driven_m < 0.01
