"""A published rosbridge client, roslibpy, uses the simulated robot as it would a real one."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import anyio
import pytest

from mapspeak.links.simulated import Clock, open_simulated_robot
from mapspeak.ros.messages.fields import Dialect
from mapspeak.rosbridge_server import open_rosbridge_server
from mapspeak.simulator import Simulation, load_world

PROGRAM = Path(__file__).parents[1] / "talking_roslibpy.py"
SUCCEEDED = {Dialect.ROS1: 3, Dialect.ROS2: 4}


@pytest.mark.anyio
@pytest.mark.parametrize("dialect", Dialect)
async def test_roslibpy_sees_the_map_asks_and_drives(dialect: Dialect) -> None:
    simulation = Simulation(load_world("warehouse"), seed=1)
    async with (
        open_simulated_robot(simulation, clock=Clock.VIRTUAL, has_detector=False) as robot,
        open_rosbridge_server(robot, dialect=dialect) as server,
    ):
        with anyio.fail_after(120):
            done = await anyio.run_process(
                [sys.executable, str(PROGRAM), str(server.port), dialect[-1]], check=False
            )
    assert done.returncode == 0, done.stderr.decode()
    seen = json.loads(done.stdout)
    assert seen["size"][0] * seen["size"][1] == seen["n_cells"] > 0
    assert seen["map_type"] == dialect.type_name("nav_msgs/OccupancyGrid")
    assert {"/map", "/tf", "/cmd_vel"} <= set(seen["topics"])
    assert seen["status"] == SUCCEEDED[dialect]
    assert seen["n_feedback"] > 0
    assert seen["driven_m"] == pytest.approx(0.5, abs=0.2)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_command_says_when_clients_may_come_and_ends_when_told(number: signal.Signals) -> None:
    command = [sys.executable, "-m", "mapspeak", "simulate", "--rosbridge", "0", "--ros", "1"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=dict(os.environ)) as run:  # noqa: S603
        assert run.stderr is not None
        said = run.stderr.readline()
        run.send_signal(number)
        rest = run.stderr.read()
        status = run.wait(timeout=30)
    assert "ws://127.0.0.1:" in said
    assert (rest, status) == ("", 0)
