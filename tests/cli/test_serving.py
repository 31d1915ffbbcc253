"""`mapspeak serve`: its help, and what it writes and tells."""

import json
import os
import pty
import re
import shlex
import signal
import socket
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import anyio
import pytest
from click.testing import CliRunner
from mcp.client import Client
from mcp.client.stdio import StdioServerParameters, stdio_client
from rosbags.highlevel import AnyReader

from fakes import FakeRobot, two_rooms
from livepage import find_free_address
from mapspeak.cli import cli
from mapspeak.cli.memory.choosing import rename_memory
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMapStore, Waypoint
from mapspeak.server.app import DEFAULT_TOOLSETS
from mapspeak.server.toolsets import build_toolsets
from mapspeak.session import Session
from mapspeak.simulator import read_state_log
from mapspeak.spatial.mapfiles import load_map
from rosbridge_robot import ScriptedRobot
from rosbridge_script import PATIENCE_S, running
from served import text_of


def test_the_help_names_every_toolset_and_those_that_are_there_by_default(tmp_path: Path) -> None:
    session = Session(FakeRobot(), SemanticMapStore(tmp_path / "places.yaml"), lease_s=60.0)

    said = " ".join(CliRunner().invoke(cli, ["serve", "--help"]).output.split())

    found = re.search(r"\(default: ([\w,]+)\); others are ([\w, ]+)\.", said)
    assert found is not None
    assert tuple(found[1].split(",")) == DEFAULT_TOOLSETS
    others = set(re.findall(r"\w+", found[2])) - {"and"}
    assert others | set(DEFAULT_TOOLSETS) == set(build_toolsets(session))


SECRETS = ("bob", "s3cr3tpw", "t0k3nvalue")
UNMASKED = f"umask 000; exec {shlex.quote(sys.executable)} -m mapspeak"
FACTS = {"name": "desk", "description": "Where the cups are."}


def every_mode_under(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): oct(path.stat().st_mode & 0o777)
        for path in folder.rglob("*")
    }


async def serve_and_stop(url: str, folder: Path, stderr: Path) -> str:
    """Let a client remember and stop, and an operator too; return what the operator is told."""
    call_log = shlex.quote(str(folder / "calls.jsonl"))
    arguments = f"serve --robot {shlex.quote(url)} --call-log {call_log}"
    settings = {"XDG_DATA_HOME": str(folder), "PATH": os.environ["PATH"]}
    server = StdioServerParameters(
        command="sh", args=["-c", f"{UNMASKED} {arguments}"], env=settings
    )
    with stderr.open("w") as errors:
        async with Client(stdio_client(server, errlog=errors)) as client:
            await client.call_tool("look_at_map", {})
            await client.call_tool("write_semantic_data", FACTS)
            told = await anyio.run_process(
                ["sh", "-c", f"{UNMASKED} stop"], env=settings, check=False
            )
            await client.call_tool("stop_robot", {})
    return told.stdout.decode() + told.stderr.decode()


@pytest.mark.anyio
async def test_what_is_written_and_told_holds_no_secret_and_is_for_its_user_alone(
    tmp_path: Path,
) -> None:
    scripted = ScriptedRobot()
    scripted.topics["/map"] = "nav_msgs/msg/OccupancyGrid"
    scripted.latched["/map"] = scripted.map_message(two_rooms())
    folder = tmp_path / "data"
    folder.mkdir()
    with anyio.fail_after(PATIENCE_S):
        async with running(scripted.server) as server:
            address = f"bob:s3cr3tpw@127.0.0.1:{server.port}/?token=t0k3nvalue"
            told = await serve_and_stop(f"ws://{address}", folder, tmp_path / "stderr")

    assert f"ws://127.0.0.1:{server.port}" in told
    written = [path for path in folder.rglob("*") if path.is_file()]
    names = [str(path.relative_to(folder)) for path in written]
    contents = [path.read_bytes() for path in [*written, tmp_path / "stderr"]]
    for secret in SECRETS:
        assert secret not in told
        assert not [name for name in names if secret in name]
        assert not [content for content in contents if secret.encode() in content]
    modes = every_mode_under(folder)
    assert {"mapspeak/audit.jsonl", "calls.jsonl", f"mapspeak/ws_127.0.0.1_{server.port}.yaml"} <= {
        *modes
    }
    assert set(modes.values()) <= {"0o600", "0o700"}, modes


def test_a_memory_that_is_named_by_a_password_gets_another_name(tmp_path: Path) -> None:
    old, new = tmp_path / "ws_bob_s3cr3tpw_robot.yaml", tmp_path / "ws_robot_9090.yaml"
    SemanticMapStore(old).write(Waypoint(name="desk", pose=Pose(1.0, 2.0)))
    episodes = tmp_path / "ws_bob_s3cr3tpw_robot.memory"
    episodes.mkdir()

    rename_memory(old, new)

    assert not [path for path in tmp_path.iterdir() if "s3cr3tpw" in path.name]
    assert (tmp_path / "ws_robot_9090.memory").is_dir()
    assert [each.name for each in SemanticMapStore(new).read().waypoints] == ["desk"]
    assert new.stat().st_mode & 0o777 == 0o600


def test_a_memory_that_is_named_by_a_password_never_takes_the_place_of_another(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    old, new = tmp_path / "ws_bob_s3cr3tpw_robot.yaml", tmp_path / "ws_robot_9090.yaml"
    old.write_text("old")
    new.write_text("new")

    rename_memory(old, new)

    assert (old.read_text(), new.read_text()) == ("old", "new")
    said = capsys.readouterr().err
    assert "Remove it" in said
    assert "s3cr3tpw" not in said


def environment(folder: Path) -> dict[str, str]:
    return {"XDG_DATA_HOME": str(folder), "TMPDIR": str(folder), "PATH": os.environ["PATH"]}


def memories_in(folder: Path) -> list[Path]:
    """Return every memory, and every folder for the time of a run."""
    kinds = ("*.yaml", "*.memory", "mapspeak-*")
    return [path for kind in kinds for path in folder.rglob(kind)]


def in_office(folder: Path, *options: str) -> Client:
    arguments = ["-m", "mapspeak", "serve", "--robot", "sim:office", *options]
    server = StdioServerParameters(command=sys.executable, args=arguments, env=environment(folder))
    return Client(stdio_client(server))


@pytest.mark.anyio
async def test_a_simulated_robot_remembers_nothing_of_an_earlier_one(tmp_path: Path) -> None:
    with anyio.fail_after(PATIENCE_S):
        async with in_office(tmp_path) as client:
            assert not (await client.call_tool("write_semantic_data", FACTS)).is_error
            assert memories_in(tmp_path)
        async with in_office(tmp_path) as client:
            remembered = text_of(await client.call_tool("get_semantic_data", {}))
    assert "desk" not in remembered
    assert not memories_in(tmp_path)


@pytest.mark.anyio
@pytest.mark.parametrize("option", ["--memory", "--semantic-map"])
async def test_a_simulated_robot_keeps_the_memory_that_it_is_given(
    tmp_path: Path, option: str
) -> None:
    file = tmp_path / "kept.yaml"
    with anyio.fail_after(PATIENCE_S):
        async with in_office(tmp_path, option, str(file)) as client:
            await client.call_tool("write_semantic_data", FACTS)
    assert [each.name for each in SemanticMapStore(file).read().waypoints] == ["desk"]


@pytest.mark.anyio
@pytest.mark.parametrize(
    ("toolsets", "has", "lacks"),
    [
        ("+explore", {"explore", "look_at_map", "stop_robot"}, set()),
        ("+explore,routes", {"explore", "follow_route", "look_at_map"}, set()),
        ("explore", {"explore", "stop_robot"}, {"look_at_map", "navigate_to"}),
        ("look", {"look_at_map"}, {"stop_robot"}),
    ],
)
async def test_toolsets_are_replaced_or_added_to_and_who_drives_can_stop(
    tmp_path: Path, toolsets: str, has: set[str], lacks: set[str]
) -> None:
    with anyio.fail_after(PATIENCE_S):
        async with in_office(tmp_path, "--toolsets", toolsets) as client:
            names = {tool.name for tool in (await client.list_tools()).tools}
    assert names >= has
    assert not names & lacks


@pytest.mark.anyio
async def test_over_http_it_says_where_it_answers_once_it_does(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "mapspeak", "serve", "--robot", "sim:office"]
    with anyio.fail_after(PATIENCE_S):
        async with await anyio.open_process(
            [*command, "--http", f"127.0.0.1:{port}"], env=environment(tmp_path)
        ) as process:
            assert process.stderr is not None
            said = (await process.stderr.receive()).decode()
            where = await ask_for(port, "/")
            process.terminate()
            await process.wait()
    assert said == f"mapspeak: sim:office at http://127.0.0.1:{port}/mcp (Ctrl-C ends it)\n"
    assert "/mcp" in where
    assert "/health" in where
    assert not memories_in(tmp_path)


@pytest.mark.anyio
async def test_a_recording_is_whole_when_a_signal_ends_the_server(tmp_path: Path) -> None:
    address, path = find_free_address(), tmp_path / "run.mcap"
    command = [sys.executable, "-m", "mapspeak", "serve", "--robot", "sim:office"]
    options = ["--http", address, "--record", str(path)]
    with anyio.fail_after(PATIENCE_S):
        async with await anyio.open_process(
            [*command, *options], env=environment(tmp_path)
        ) as process:
            assert process.stderr is not None
            await process.stderr.receive()
            async with Client(f"http://{address}/mcp") as client:
                await client.call_tool("get_robot_pose", {})
            process.terminate()
            await process.wait()
    with AnyReader([path]) as reader:
        assert "/mapspeak/calls" in {each.topic for each in reader.connections}


async def ask_for(port: int, path: str) -> str:
    answer = b""
    async with await anyio.connect_tcp("127.0.0.1", port) as stream:
        await stream.send(
            f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\n\r\n".encode()
        )
        with suppress(anyio.EndOfStream):
            while True:
                answer += await stream.receive()
    assert answer.startswith(b"HTTP/1.1 200")
    return answer.decode()


@pytest.mark.anyio
async def test_a_person_who_types_it_is_told_that_it_waits_for_a_client(tmp_path: Path) -> None:
    ours, terminal = pty.openpty()
    command = [sys.executable, "-m", "mapspeak", "serve", "--robot", "sim:office"]
    try:
        with anyio.fail_after(PATIENCE_S):
            async with await anyio.open_process(
                command, stdin=terminal, env=environment(tmp_path)
            ) as process:
                assert process.stderr is not None
                said = (await process.stderr.receive()).decode()
                process.terminate()
                await process.wait()
    finally:
        os.close(ours)
        os.close(terminal)
    assert said.startswith("mapspeak: sim:office for an MCP client on standard input")
    assert "serve --http` serves it at an address" in said


def test_the_end_does_not_wait_for_what_is_computed_ahead_of_questions() -> None:
    computing = "threading.Thread(target=threading.Event().wait).start()"
    code = f"import threading; from mapspeak.cli.serving.command import end_at_once; {computing}"
    ended = subprocess.run(  # noqa: S603 - our own interpreter
        [sys.executable, "-c", f"{code}; end_at_once()"], timeout=PATIENCE_S, check=False
    )
    assert ended.returncode == 0


@pytest.mark.anyio
@pytest.mark.parametrize("transport", ["http", "stdio"])
async def test_the_robots_map_is_written_when_a_signal_ends_the_server(
    tmp_path: Path, transport: str
) -> None:
    path, log = tmp_path / "map.yaml", tmp_path / "state.jsonl"
    command = [sys.executable, "-m", "mapspeak", "serve", "--robot", "sim:office"]
    options = ["--final-map", str(path), "--state-log", str(log)]
    if transport == "http":
        options += ["--http", find_free_address()]
    with anyio.fail_after(PATIENCE_S):
        async with await anyio.open_process(
            [*command, *options], env=environment(tmp_path)
        ) as process:
            assert process.stderr is not None
            said = b""
            if transport == "http":
                while b"(Ctrl-C ends it)" not in said:
                    said += await process.stderr.receive()
            else:
                assert process.stdout is not None
                assert process.stdin is not None
                await process.stdin.send(initialize_line())
                await process.stdout.receive()
            process.terminate()
            said += b"".join([part async for part in process.stderr])
            await process.wait()
    assert process.returncode == 128 + signal.SIGTERM, said
    assert load_map(path).grid.free.any()
    assert read_state_log(log)


@pytest.mark.anyio
@pytest.mark.parametrize("hangs_up", [True, False])
async def test_a_client_that_takes_no_more_answers_ends_the_server_without_a_fault(
    tmp_path: Path,
    hangs_up: bool,  # noqa: FBT001 - a case
) -> None:
    command = [sys.executable, "-m", "mapspeak", "serve", "--robot", "sim:office"]
    reading, writing = os.pipe()
    with anyio.fail_after(PATIENCE_S):
        async with await anyio.open_process(
            command, stdout=writing, env=environment(tmp_path)
        ) as process:
            os.close(writing)
            os.close(reading)
            assert process.stdin is not None
            assert process.stderr is not None
            await process.stdin.send(initialize_line())
            if hangs_up:
                await process.stdin.aclose()
            said = b"".join([part async for part in process.stderr])
            await process.wait()
    assert not said
    assert process.returncode == 0


def initialize_line() -> bytes:
    """Gives what a client says first over stdio."""
    client = {"name": "test", "version": "0"}
    told = {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": client}
    message = {"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": told}
    return json.dumps(message).encode() + b"\n"
