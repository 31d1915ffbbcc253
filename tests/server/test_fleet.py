"""Several robots behind one server."""

from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from mcp.client import Client

from fakes import FakeRobot, two_rooms
from mapspeak.errors import ConfigError, LinkError
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMapStore
from mapspeak.safety import Caller, calling
from mapspeak.server.app import build_server
from mapspeak.server.fleet import FleetServer
from mapspeak.session import Session
from served import MODES, report_of, text_of

pytestmark = pytest.mark.anyio


class StuckRobot(FakeRobot):
    """A robot that cannot be told to stop."""

    async def stop(self) -> None:
        raise LinkError("The robot is out of reach.", hint="Stop it by hand.")


@asynccontextmanager
async def fleet(
    folder: Path, *, mode: str = "auto", beta: FakeRobot | None = None
) -> AsyncGenerator[tuple[Client, FakeRobot, FakeRobot]]:
    robots = {"alpha": FakeRobot(two_rooms()), "beta": beta or FakeRobot(two_rooms())}
    sessions = {
        name: Session(robot, SemanticMapStore(folder / f"{name}.yaml"), lease_s=60.0)
        for name, robot in robots.items()
    }
    servers = {name: build_server(session) for name, session in sessions.items()}
    async with Client(FleetServer(servers), mode=mode) as client:
        yield client, robots["alpha"], robots["beta"]


@pytest.mark.parametrize("mode", MODES)
async def test_each_tool_is_listed_once_and_asks_which_robot(tmp_path: Path, mode: str) -> None:
    async with fleet(tmp_path, mode=mode) as (client, _, _):
        tools = (await client.list_tools()).tools
        instructions = client.instructions or ""
    assert len({tool.name for tool in tools}) == len(tools)
    for tool in tools:
        assert tool.input_schema["properties"]["robot"]["enum"] == ["alpha", "beta"]
        assert ("robot" in tool.input_schema.get("required", [])) is (tool.name != "stop_robot")
    assert "alpha, beta" in instructions


async def test_a_call_reaches_the_robot_it_names_and_no_other(tmp_path: Path) -> None:
    async with fleet(tmp_path) as (client, alpha, beta):
        alpha.pose, beta.pose = Pose(1.0, 1.0, 0.0), Pose(2.0, 1.5, 0.0)
        first = report_of(await client.call_tool("get_robot_pose", {"robot": "alpha"}))
        second = report_of(await client.call_tool("get_robot_pose", {"robot": "beta"}))
    assert (first["pose"]["x"], second["pose"]["x"]) == (1.0, 2.0)


@pytest.mark.parametrize("arguments", [{}, {"robot": "gamma"}, {"robot": "ws://10.0.0.9:9090"}])
async def test_a_robot_that_the_operator_did_not_name_is_out_of_reach(
    tmp_path: Path, arguments: dict[str, str]
) -> None:
    async with fleet(tmp_path) as (client, _, _):
        answer = await client.call_tool("get_robot_pose", arguments)
    assert answer.is_error
    assert "one of: alpha, beta" in text_of(answer)


async def test_a_stop_without_a_name_stops_every_robot(tmp_path: Path) -> None:
    async with fleet(tmp_path) as (client, alpha, beta):
        answer = await client.call_tool("stop_robot", {})
    assert not answer.is_error
    assert (alpha.n_stops, beta.n_stops) == (1, 1)


async def test_a_robot_that_cannot_be_stopped_holds_up_no_other_and_is_named(
    tmp_path: Path,
) -> None:
    async with fleet(tmp_path, beta=StuckRobot(two_rooms())) as (client, alpha, _):
        answer = await client.call_tool("stop_robot", {})
    assert answer.is_error
    assert alpha.n_stops == 1
    assert "beta: NOT STOPPED" in text_of(answer)


def test_a_fleet_of_none_is_refused() -> None:
    with pytest.raises(ConfigError, match="no robot"):
        FleetServer({})


async def test_a_robot_out_of_reach_keeps_no_other_driving_when_their_client_is_gone(
    tmp_path: Path,
) -> None:
    robots = {"alpha": StuckRobot(two_rooms()), "beta": FakeRobot(two_rooms())}
    servers = {}
    for name, robot in robots.items():
        session = Session(robot, SemanticMapStore(tmp_path / f"{name}.yaml"), lease_s=60.0)
        servers[name] = build_server(session)
        with calling(Caller(session="mine")), session.drives.preparing() as ticket:
            goal = await session.find_goal(place=None, x=6.0, y=1.4, yaw_deg=None)
            await session.drives.start(goal.pose, place=goal.name, ticket=ticket)
    await FleetServer(servers).note_hang_up("mine")
    assert robots["beta"].n_stops == 1


async def test_a_stop_that_no_robot_took_is_an_error(tmp_path: Path) -> None:
    async with fleet(tmp_path) as (client, alpha, beta):
        answer = await client.call_tool("stop_robot", {"words": "x" * 2_000_000})
    assert (alpha.n_stops, beta.n_stops) == (0, 0)
    assert answer.is_error
