"""Replays of call logs and audit logs."""

import json
from pathlib import Path

import pytest
from mcp.client import Client

from drawing import grid_from_text
from fakes import FakeRobot, two_rooms
from guarding import make_guard
from mapspeak.errors import ConfigError, PolicyError
from mapspeak.memory import SemanticMapStore
from mapspeak.safety import Caller, Publish, calling
from mapspeak.server.app import build_server
from mapspeak.server.fleet import FleetServer
from mapspeak.server.view.replay import MAPS, MapLog, replay_log
from mapspeak.server.wire.calllog import CallLog
from mapspeak.session import Session
from served import connect

ROOM = """
    ########
    #......#
    #......#
    ########
"""


@pytest.fixture
async def calls(tmp_path: Path) -> Path:
    """A call log of three calls."""
    log = CallLog(tmp_path / "calls.jsonl")
    async with connect(FakeRobot(two_rooms()), tmp_path, call_log=log) as client:
        await client.call_tool("look_at_map", {})
        await client.call_tool("get_robot_pose", {})
        await client.call_tool("navigate_to", {"place": "R99"})
    return log.path


@pytest.mark.anyio
async def test_a_call_log_is_replayed_with_pictures_and_poses(calls: Path) -> None:
    told = replay_log(calls)
    look, pose, refused = told.steps
    assert look.call.pictures == ("calls/0001-0.png",)
    assert (look.pose, refused.call.is_error) == (None, True)
    assert pose.pose is not None
    assert (pose.pose.x, pose.pose.y, pose.trail) == (1.5, 1.4, (0, 1))
    assert told.map is None


@pytest.mark.anyio
async def test_the_map_of_a_call_log_is_as_it_was_after_each_call(tmp_path: Path) -> None:
    robot, log = FakeRobot(two_rooms()), CallLog(tmp_path / "calls.jsonl")
    store = SemanticMapStore(tmp_path / "m.yaml", map_id="two-rooms")
    session = Session(robot, store, lease_s=60.0, find_model=lambda: None)
    maps = MapLog(session, log.pictures / MAPS, log)
    async with Client(build_server(session, call_log=maps)) as client:
        await client.call_tool("get_robot_pose", {})
        await client.call_tool("look_at_map", {})
        noted = {"name": "the spot", "description": "here"}
        await client.call_tool("write_semantic_data", noted)
        await client.call_tool("look_at_map", {})
        robot.grid = grid_from_text(ROOM, resolution_m=1.0)
        await client.call_tool("look_at_map", {})
    told = replay_log(log.path)
    assert [step.n_moments for step in told.steps] == [1, 1, 2, 2, 3]
    first, noted_then, grown = told.moments
    assert first.overlay["doors"].names == ["D1"]
    assert (noted_then.map, list(noted_then.overlay)) == (None, ["places"])
    assert [item["name"] for item in noted_then.overlay["places"].items] == ["the spot"]
    assert grown.map is not None
    assert (grown.map.n_rows, grown.map.n_cols) == (4, 8)
    assert grown.overlay["doors"].names == []
    assert told.map is not None
    assert {name for row in grown.map.tiles for name in row} <= set(told.map.pictures or ())


@pytest.mark.anyio
async def test_a_log_of_several_robots_shows_each_step_on_the_map_of_its_robot(
    tmp_path: Path,
) -> None:
    log, servers = CallLog(tmp_path / "calls.jsonl"), {}
    for name, grid in {"hall": two_rooms(), "yard": grid_from_text(ROOM)}.items():
        store = SemanticMapStore(tmp_path / f"{name}.yaml")
        session = Session(FakeRobot(grid), store, lease_s=60.0, find_model=lambda: None)
        maps = MapLog(session, log.pictures / MAPS / name, log.of(name))
        servers[name] = build_server(session, call_log=maps)
    async with Client(FleetServer(servers)) as client:
        for robot, tool in (
            ("hall", "get_robot_pose"),
            ("yard", "look_at_map"),
            ("hall", "look_at_map"),
            ("yard", "get_robot_pose"),
        ):
            await client.call_tool(tool, {"robot": robot})
    told = replay_log(log.path)
    assert [step.call.note for step in told.steps] == ["hall", "yard", "hall", "yard"]
    shown = [told.moments[step.n_moments - 1] for step in told.steps]
    assert [each.overlay["doors"].names for each in shown] == [["D1"], [], ["D1"], []]
    assert [each.map and each.map.n_cols for each in shown] == [30, 8, 30, 8]
    assert [step.trail for step in told.steps] == [(0, 1), (1, 1), (0, 1), (1, 2)]


def test_a_robot_that_is_named_like_another_folder_has_no_map(tmp_path: Path) -> None:
    (tmp_path / "moments.jsonl").write_text("no json\n")
    (tmp_path / "log" / MAPS).mkdir(parents=True)
    path = tmp_path / "log.jsonl"
    path.write_text(json.dumps({"tool": "look", "robot": "../.."}) + "\n")
    assert not replay_log(path).moments


@pytest.mark.anyio
@pytest.mark.parametrize("line", ["{}", '{"n_calls": 1, "map": 2}', "no json", "[]"])
async def test_a_log_of_maps_that_is_none_is_refused(calls: Path, line: str) -> None:
    (calls.with_suffix("") / MAPS).mkdir()
    (calls.with_suffix("") / MAPS / "moments.jsonl").write_text(f"{line}\n")
    with pytest.raises(ConfigError, match="no log of maps"):
        replay_log(calls)


@pytest.mark.anyio
async def test_a_log_is_shown_on_a_map_that_is_named(calls: Path) -> None:
    told = replay_log(calls, grid_from_text(ROOM, resolution_m=1.0))
    assert told.map is not None
    assert len(told.map.pictures or ()) == 1


def test_an_audit_log_is_replayed_with_who_what_and_why(tmp_path: Path) -> None:
    guard = make_guard(tmp_path)
    tf = Publish(topic="/tf", type="tf2_msgs/msg/TFMessage", message={})
    with calling(Caller(client="tester", tool="publish")), pytest.raises(PolicyError):
        guard.clear(tf, robot_s=2.0)
    guard.note_event("stop", "stopped", robot_s=3.0)
    refused, stopped = replay_log(tmp_path / "audit.jsonl").steps
    assert (refused.call.tool, refused.call.is_error) == ("publish", True)
    assert "tester" in refused.call.note
    assert stopped.call.text == "stop\nstopped"


def test_a_drive_of_an_audit_log_shows_where_it_was_sent(tmp_path: Path) -> None:
    line = {"number": 1, "run": "r", "robot": "", "wall_time": "2026-11-25T10:00:00.000"}
    line |= {"robot_s": 1.0, "event": "decision", "client": "c", "tool": "navigate_to"}
    line |= {"kind": "drive", "what": "drive to R2", "verdict": "allowed", "said": ""}
    later = {**line, "wall_time": "2026-11-25T10:00:07.500", "event": "ended", "details": {}}
    line |= {"details": {"x": 2.0, "y": 1.0, "yaw_rad": 0.0}}
    path = tmp_path / "audit.jsonl"
    path.write_text(f"{json.dumps(line)}\n{json.dumps(later)}\n")
    drive, ended = replay_log(path).steps
    assert drive.goal is not None
    assert (drive.goal.x, drive.goal.y) == (2.0, 1.0)
    assert (ended.goal, ended.at_s) == (None, 7.5)


@pytest.mark.parametrize("content", ["", "no json\n{}\n", "[1]\n{}\n"])
def test_what_is_no_log_is_refused(tmp_path: Path, content: str) -> None:
    path = tmp_path / "log.jsonl"
    path.write_text(content)
    with pytest.raises(ConfigError):
        replay_log(path)


def test_pictures_that_lie_elsewhere_are_not_shown(tmp_path: Path) -> None:
    (tmp_path / "secret.png").write_bytes(b"x")
    line = {"tool": "look", "text": "", "pictures": ["../secret.png", "/etc/passwd", "none.png"]}
    path = tmp_path / "log.jsonl"
    path.write_text(json.dumps(line) + "\n")
    (step,) = replay_log(path).steps
    assert step.call.pictures == ()
