from collections.abc import Iterable
from pathlib import Path

import pytest
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from fakes import FakeRobot, two_rooms
from mapspeak.errors import ConfigError
from mapspeak.semantic import SemanticMapStore
from mapspeak.server import build_server, serve_http
from mapspeak.server.transport import HangUpWatch, TokenGuard
from mapspeak.session import Session

pytestmark = pytest.mark.anyio

START: Message = {"type": "http.response.start", "status": 200, "headers": []}
MORE: Message = {"type": "http.response.body", "body": b"so far", "more_body": True}
END: Message = {"type": "http.response.body", "body": b"", "more_body": False}
HANG_UP: Message = {"type": "http.disconnect"}


class Answering:
    """An application that sends these messages and then listens for what comes."""

    def __init__(self, *messages: Message) -> None:
        self.messages = messages

    async def __call__(self, _scope: Scope, receive: Receive, send: Send) -> None:
        for message in self.messages:
            await send(message)
        await receive()


async def ask(
    app: ASGIApp, *, path: str = "/mcp", headers: Iterable[tuple[bytes, bytes]] = ()
) -> list[Message]:
    """Gives what an application sends to a client that hangs up."""
    sent: list[Message] = []

    async def receive() -> Message:
        return HANG_UP

    async def send(message: Message) -> None:
        sent.append(message)

    await app({"type": "http", "path": path, "headers": list(headers)}, receive, send)
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


async def test_a_drive_ends_when_its_client_is_gone(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    session = Session(robot, SemanticMapStore(tmp_path / "m.yaml"), lease_s=60.0)
    with session.drives.preparing() as ticket:
        goal = await session.find_goal(place=None, x=6.0, y=1.4, yaw_deg=None)
        await session.drives.start(goal.pose, place=goal.name, ticket=ticket, client="mine")
    await build_server(session).note_hang_up("another")
    assert session.drives.under_way is not None
    await build_server(session).note_hang_up("mine")
    assert robot.n_stops == 1
    assert session.drives.under_way is None


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
