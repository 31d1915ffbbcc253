import json
import re
import socket
import sys
from collections.abc import AsyncGenerator, Iterable
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import anyio
import pytest
from anyio.streams.buffered import BufferedByteReceiveStream
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from fakes import FakeRobot, two_rooms
from mapspeak.errors import ConfigError, LinkError
from mapspeak.memory import SemanticMapStore
from mapspeak.safety import Caller, calling
from mapspeak.server.app import build_server
from mapspeak.server.transport import HangUpWatch, serve_http
from mapspeak.server.wire.access import TokenGuard
from mapspeak.session import Session
from skillmaking import FakeSkill, never, spec

pytestmark = pytest.mark.anyio

START: Message = {"type": "http.response.start", "status": 200, "headers": []}
MORE: Message = {"type": "http.response.body", "body": b"so far", "more_body": True}
END: Message = {"type": "http.response.body", "body": b"", "more_body": False}
HANG_UP: Message = {"type": "http.disconnect"}
HELLO = {
    "jsonrpc": "2.0",
    "id": 1,
    "method": "initialize",
    "params": {
        "protocolVersion": "2025-06-18",
        "capabilities": {},
        "clientInfo": {"name": "test", "version": "0"},
    },
}
JSON = {"Content-Type": "application/json", "Accept": "application/json, text/event-stream"}


class Answering:
    """An application that sends these messages and then listens for what comes."""

    def __init__(self, *messages: Message) -> None:
        self.messages = messages

    async def __call__(self, _scope: Scope, receive: Receive, send: Send) -> None:
        for message in self.messages:
            await send(message)
        await receive()


async def ask(
    app: ASGIApp,
    *,
    method: str = "POST",
    path: str = "/mcp",
    headers: Iterable[tuple[bytes, bytes]] = (),
) -> list[Message]:
    """Gives what an application sends to a client that hangs up."""
    sent: list[Message] = []

    async def receive() -> Message:
        return HANG_UP

    async def send(message: Message) -> None:
        sent.append(message)

    scope = {"type": "http", "method": method, "path": path, "headers": list(headers)}
    await app(scope, receive, send)
    return sent


@pytest.mark.parametrize(
    ("messages", "n_hang_ups"), [((), 1), ((START, MORE), 1), ((START, MORE, END), 0)]
)
async def test_a_client_that_goes_before_its_answer_has_come_is_noticed(
    messages: tuple[Message, ...], n_hang_ups: int
) -> None:
    noticed: list[str] = []

    async def note(client: str) -> None:
        noticed.append(client)

    await ask(HangUpWatch(Answering(*messages), note))
    assert len(noticed) == n_hang_ups


@pytest.mark.parametrize(
    ("method", "headers"),
    [("GET", []), ("POST", [(b"mcp-method", b"subscriptions/listen")])],
)
async def test_a_client_that_closes_a_stream_of_news_alone_is_not_gone(
    method: str, headers: list[tuple[bytes, bytes]]
) -> None:
    noticed: list[str] = []

    async def note(client: str) -> None:
        noticed.append(client)

    await ask(HangUpWatch(Answering(START, MORE), note), method=method, headers=headers)
    assert not noticed


async def test_what_a_hang_up_asks_for_is_done_though_the_request_ends_meanwhile() -> None:
    done: list[str] = []

    async def note(client: str) -> None:
        await anyio.lowlevel.checkpoint()
        done.append(client)

    async def answer(_scope: Scope, receive: Receive, _send: Send) -> None:
        async def listen() -> None:
            await receive()

        async with anyio.create_task_group() as tasks:
            tasks.start_soon(listen)
            await anyio.lowlevel.checkpoint()
            tasks.cancel_scope.cancel()

    await ask(HangUpWatch(answer, note))
    assert done == [""]


async def test_a_drive_ends_when_its_client_is_gone(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    session = Session(robot, SemanticMapStore(tmp_path / "m.yaml"), lease_s=60.0)
    with calling(Caller(session="mine")), session.drives.preparing() as ticket:
        goal = await session.find_goal(place=None, x=6.0, y=1.4, yaw_deg=None)
        await session.drives.start(goal.pose, place=goal.name, ticket=ticket)
    await build_server(session).note_hang_up("another")
    assert session.drives.under_way is not None
    await build_server(session).note_hang_up("mine")
    assert robot.n_stops == 1
    assert session.drives.under_way is None


@pytest.mark.parametrize(("client", "n_stops"), [("another", 0), ("mine", 1)])
async def test_a_goal_that_is_being_checked_is_given_up_with_its_own_client_alone(
    tmp_path: Path, client: str, n_stops: int
) -> None:
    robot = FakeRobot(two_rooms())
    session = Session(robot, SemanticMapStore(tmp_path / "m.yaml"), lease_s=60.0)
    with calling(Caller(session="mine")), session.drives.preparing():
        await build_server(session).note_hang_up(client)
    assert robot.n_stops == n_stops


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ([], 401),
        ([(b"authorization", b"Bearer wrong")], 401),
        ([(b"authorization", b"Basic right")], 401),
        ([(b"authorization", b"right")], 401),
        ([(b"authorization", b"Bearer right")], 200),
        ([(b"authorization", b"bearer right")], 200),
    ],
)
async def test_only_who_has_the_token_is_let_in(
    headers: list[tuple[bytes, bytes]], status: int
) -> None:
    sent = await ask(TokenGuard(Answering(START, END), "right"), headers=headers)
    assert sent[0]["status"] == status


async def test_the_health_check_needs_no_token() -> None:
    sent = await ask(TokenGuard(Answering(START, END), "right"), path="/health")
    assert sent[0]["status"] == 200


@pytest.mark.parametrize("address", ["0.0.0.0:8766", "192.0.2.7:80", "[::]:8766"])
async def test_other_machines_are_not_served_without_a_token(address: str, tmp_path: Path) -> None:
    session = Session(FakeRobot(), SemanticMapStore(tmp_path / "m.yaml"), lease_s=60.0)
    with pytest.raises(ConfigError, match="MAPSPEAK_HTTP_TOKEN"):
        await serve_http(build_server(session), address)


@asynccontextmanager
async def drive_over_http(folder: Path) -> AsyncGenerator[tuple[FakeRobot, str, str]]:
    """Serve a robot that a client drives; yield it, the address, and the client's session."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        address = f"127.0.0.1:{free.getsockname()[1]}"
    robot = FakeRobot(two_rooms())
    session = Session(robot, SemanticMapStore(folder / "m.yaml"), lease_s=60.0)
    with anyio.fail_after(20.0):
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(serve_http, build_server(session), address)
            client = await begin_session(address)
            with calling(Caller(session=client)), session.drives.preparing() as ticket:
                goal = await session.find_goal(place=None, x=6.0, y=1.4, yaw_deg=None)
                await session.drives.start(goal.pose, place=goal.name, ticket=ticket)
            yield robot, address, client
            tasks.cancel_scope.cancel()


async def request(address: str, method: str, headers: dict[str, str], body: str = "") -> str:
    """Return what the server answers, as it comes; nothing where it is not there."""
    host, port = address.split(":")
    fields = {"Host": address, "Connection": "close", "Content-Length": str(len(body))} | headers
    lines = [f"{method} /mcp HTTP/1.1", *(f"{name}: {text}" for name, text in fields.items())]
    try:
        stream = await anyio.connect_tcp(host, int(port))
    except OSError:
        return ""
    answer = ""
    async with stream:
        await stream.send("\r\n".join([*lines, "", body]).encode())
        with suppress(anyio.EndOfStream):
            while True:
                answer += (await stream.receive()).decode()
    return answer


async def begin_session(address: str) -> str:
    """Return the id of a new session, once the server listens."""
    answer = ""
    while not answer:
        await anyio.lowlevel.checkpoint()
        answer = await request(address, "POST", JSON, json.dumps(HELLO))
    found = re.search(r"mcp-session-id: (\w+)", answer)
    assert found is not None, answer
    return found[1]


@pytest.mark.parametrize(
    ("changed", "status", "n_stops"),
    [
        ({}, 200, 1),
        ({"Host": "evil.example"}, 421, 0),
        ({"Origin": "http://evil.example"}, 403, 0),
        ({"Mcp-Session-Id": "unknown"}, 404, 0),
        ({"Mcp-Session-Id": "unknown", "Host": "evil.example"}, 421, 0),
    ],
)
async def test_only_the_end_of_a_known_session_stops_its_drive(
    tmp_path: Path, changed: dict[str, str], status: int, n_stops: int
) -> None:
    async with drive_over_http(tmp_path) as (robot, address, session):
        answer = await request(address, "DELETE", {"Mcp-Session-Id": session} | changed)
        assert answer.startswith(f"HTTP/1.1 {status} ")
        assert robot.n_stops == n_stops


async def test_a_drive_goes_on_when_its_client_opens_its_stream_of_news_again(
    tmp_path: Path,
) -> None:
    async with drive_over_http(tmp_path) as (robot, address, session):
        for _ in range(2):
            await open_and_close_news(address, session)
        assert robot.n_stops == 0


async def open_and_close_news(address: str, session: str) -> None:
    """Open a client's stream of news, once the one before it has ended, and close it."""
    host, port = address.split(":")
    fields = {"Host": address, "Accept": "text/event-stream", "Mcp-Session-Id": session}
    lines = ["GET /mcp HTTP/1.1", *(f"{name}: {text}" for name, text in fields.items())]
    answer = b""
    while not answer.startswith(b"HTTP/1.1 200"):
        async with await anyio.connect_tcp(host, int(port)) as stream:
            await stream.send("\r\n".join([*lines, "", ""]).encode())
            answer = await stream.receive()


async def call_tool(address: str, session: str, tool: str, **arguments: object) -> str:
    body = {"jsonrpc": "2.0", "id": 7, "method": "tools/call"}
    body |= {"params": {"name": tool, "arguments": arguments}}
    return await request(address, "POST", JSON | {"Mcp-Session-Id": session}, json.dumps(body))


async def test_only_the_client_of_a_mission_answers_its_question_until_it_hangs_up(
    tmp_path: Path,
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        address = f"127.0.0.1:{free.getsockname()[1]}"
    session = Session(FakeRobot(two_rooms()), SemanticMapStore(tmp_path / "m.yaml"), lease_s=60.0)
    server = build_server(session, toolsets=("missions",))
    with anyio.fail_after(60.0):
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(server.keep_skills)
            tasks.start_soon(serve_http, server, address)
            one, other = await begin_session(address), await begin_session(address)
            asked = await call_tool(address, one, "run_mission", tree="- ask: Ready?\n")
            refused = await call_tool(address, other, "answer_mission", answer="yes")
            await request(address, "DELETE", {"Mcp-Session-Id": one})
            answered = await call_tool(address, other, "answer_mission", answer="yes")
            tasks.cancel_scope.cancel()
    assert "Ready?" in asked
    assert "Only the client that runs the mission answers it." in refused
    assert "Q1 is answered: yes." in answered


async def test_a_client_that_leaves_in_mid_request_costs_one_line(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    async with drive_over_http(tmp_path) as (_, address, session):
        host, port = address.split(":")
        fields = JSON | {"Host": address, "Mcp-Session-Id": session, "Content-Length": "1000"}
        lines = ["POST /mcp HTTP/1.1", *(f"{name}: {text}" for name, text in fields.items())]
        async with await anyio.connect_tcp(host, int(port)) as stream:
            await stream.send("\r\n".join([*lines, "", "{"]).encode())
        while not [each for each in caplog.records if "left before its request" in each.message]:
            await anyio.lowlevel.checkpoint()
    assert "Traceback" not in capfd.readouterr().err
    assert not [each for each in caplog.records if each.exc_info]


async def test_a_line_that_is_no_message_is_answered_and_the_talk_goes_on() -> None:
    ping = {"jsonrpc": "2.0", "id": 4, "method": "ping"}
    lines = ["{oops", "", json.dumps(HELLO), '{"jsonrpc": "2.0", "id": 2, "params": []}']
    program = [sys.executable, "-m", "mapspeak", "serve"]
    with anyio.fail_after(120.0):
        async with await anyio.open_process(program, stderr=None) as process:
            assert process.stdin is not None
            assert process.stdout is not None
            await process.stdin.send("\n".join([*lines, json.dumps(ping), ""]).encode())
            answers = BufferedByteReceiveStream(process.stdout)
            told = [json.loads(await answers.receive_until(b"\n", 1_000_000)) for _ in range(4)]
            await process.stdin.aclose()
            assert await process.wait() == 0
    codes = [each["error"]["code"] for each in told if each["id"] is None]
    assert codes == [-32700, -32600]
    assert {each["id"] for each in told if "result" in each} == {1, 4}


class Unreachable(FakeRobot):
    """A robot that hears no stop."""

    async def stop(self) -> None:
        raise LinkError("There is no connection.", hint="Wait.")


async def test_the_skills_of_a_client_that_is_gone_end_though_the_robot_is_out_of_reach(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    session = Session(Unreachable(two_rooms()), SemanticMapStore(tmp_path / "m.yaml"), lease_s=60.0)
    server = build_server(session)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(server.keep_skills)
        await anyio.wait_all_tasks_blocked()
        with calling(Caller(session="mine")):
            run = await server.book.runs.begin(FakeSkill(spec(), do=never), {}, wait_s=0.0)
        with calling(Caller(session="mine")), session.drives.preparing() as ticket:
            goal = await session.find_goal(place=None, x=6.0, y=1.4, yaw_deg=None)
            await session.drives.start(goal.pose, place=goal.name, ticket=ticket)
        await server.note_hang_up("mine")
        assert run.is_over
        assert "could not be stopped yet" in caplog.text
        tasks.cancel_scope.cancel()
