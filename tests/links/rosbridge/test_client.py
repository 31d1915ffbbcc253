"""The rosbridge client: one robot, two sockets, whatever the network does."""

import random
import subprocess
import sys
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path

import anyio
import orjson
import pytest
from anyio.abc import ByteStream, SocketAttribute
from websockets.http11 import Request
from websockets.server import ServerProtocol

from benchmarks.mutations import mutate, seed_frames
from mapspeak.errors import ConfigError, LinkError
from mapspeak.links.rosbridge import RobotAddress, RosbridgeClient, open_client
from mapspeak.links.rosbridge.connection import MAX_REFUSED
from mapspeak.links.rosbridge.protocol.bounds import MAX_FRAME_BYTES
from mapspeak.links.rosbridge.websocket import MAX_PARTS, MAX_SKIPPED_BYTES
from mapspeak.ros.link import Patience
from rosbridge_script import (
    PATIENCE_S,
    Operation,
    ScriptedServer,
    Visitor,
    answering_with,
    running,
)

pytestmark = pytest.mark.anyio

QUICK = Patience(first_pause_s=0.001, longest_pause_s=0.01, linger_s=0.0, goodbye_s=1.0)
TWIST = "geometry_msgs/msg/Twist"
OLD_CBOR = """
class CBOREncoder: ...
class CBORTag: ...
class CBORDecodeError(Exception): ...
def dumps(value, default=None): return b"\\xf6"
def loads(data, tag_hook=None): return None
"""


@asynccontextmanager
async def connected(
    server: ScriptedServer, patience: Patience = QUICK
) -> AsyncGenerator[RosbridgeClient]:
    with anyio.fail_after(PATIENCE_S):
        async with (
            running(server),
            open_client(RobotAddress(url=server.url), patience=patience) as client,
        ):
            yield client


async def echo(visitor: Visitor, call: Operation) -> None:
    await visitor.answer(call, call["args"])


async def refuse(visitor: Visitor, call: Operation) -> None:
    await visitor.answer(call, "service does not exist", is_success=False)


def is_whole(server: ScriptedServer) -> bool:
    """True when both sockets are there, and one has subscribed."""
    present = server.present
    return len(present) == 2 and any(each.asked("subscribe") for each in present)


async def fails_with(address: RobotAddress) -> LinkError:
    with pytest.raises(LinkError) as raised:
        async with open_client(address, patience=QUICK):
            pass
    return raised.value


async def test_a_call_is_answered() -> None:
    async with connected(ScriptedServer({"call_service": echo})) as client:
        assert await client.call_service("/add", {"a": 1}) == {"a": 1}


async def test_a_robot_is_reached_over_two_sockets_however_much_is_asked() -> None:
    server = ScriptedServer({"call_service": echo})
    async with connected(server) as client:
        for number in range(50):
            client.subscribe(f"/topic_{number}")
            await client.call_service("/add", {"a": number})
    assert len(server.visitors) == 2


async def test_answers_find_their_calls_in_whatever_order_they_come() -> None:
    waiting: list[tuple[Visitor, Operation]] = []

    async def answer_the_last_first(visitor: Visitor, call: Operation) -> None:
        waiting.append((visitor, call))
        if len(waiting) == 20:
            for each, its_call in reversed(waiting):
                await echo(each, its_call)

    async with connected(ScriptedServer({"call_service": answer_the_last_first})) as client:
        values: dict[int, dict[str, object]] = {}

        async def ask(number: int) -> None:
            values[number] = await client.call_service("/add", {"a": number})

        async with anyio.create_task_group() as tasks:
            for number in range(20):
                tasks.start_soon(ask, number)
    assert values == {number: {"a": number} for number in range(20)}


async def test_a_refused_call_says_why() -> None:
    async with connected(ScriptedServer({"call_service": refuse})) as client:
        with pytest.raises(LinkError, match="/add failed: service does not exist"):
            await client.call_service("/add")


async def test_a_silent_service_ends_the_wait_and_not_the_connection() -> None:
    server = ScriptedServer()
    async with connected(server) as client:
        heard = client.subscribe("/slow")
        with pytest.raises(LinkError, match="did not answer within"):
            await client.call_service("/never", timeout_s=0.01)
        await server.until(lambda: server.asked("subscribe"))
        await server.publish("/slow", {"data": 1})
        assert await heard.wait_for_more_than(0, timeout_s=PATIENCE_S) == {"data": 1}
        assert client.n_connections == 1


async def test_behind_a_call_that_is_stuck_the_next_is_answered_over_a_fresh_socket() -> None:
    async def answer_unless_stuck(visitor: Visitor, call: Operation) -> None:
        is_stuck = any(each["service"] == "/never" for each in visitor.asked("call_service"))
        if not is_stuck:
            await echo(visitor, call)

    async with connected(ScriptedServer({"call_service": answer_unless_stuck})) as client:
        with pytest.raises(LinkError):
            await client.call_service("/never", timeout_s=0.01)
        assert await client.call_service("/add", {"a": 1}) == {"a": 1}


async def test_a_topic_much_slower_than_the_wait_is_read_over_one_subscription() -> None:
    # Fault 1 of the field: a receive limit closed the socket, and the subscription with it.
    server = ScriptedServer()
    async with connected(server) as client:
        slow = client.subscribe("/slow")
        for _ in range(3):
            with pytest.raises(LinkError, match="No message came on /slow"):
                await slow.wait_for_more_than(0, timeout_s=0.01)
        await server.publish("/slow", {"data": "at last"})
        assert await slow.wait_for_more_than(0, timeout_s=PATIENCE_S) == {"data": "at last"}
    assert len(server.asked("subscribe")) == 1
    assert len(server.visitors) == 2


async def test_the_latest_message_wins() -> None:
    server = ScriptedServer()
    async with connected(server) as client:
        heard = client.subscribe("/pose")
        await server.until(lambda: server.asked("subscribe"))
        for number in range(100):
            await server.publish("/pose", {"data": number})
        latest = await heard.wait_for_more_than(99, timeout_s=PATIENCE_S)
    assert latest == {"data": 99}


async def test_two_users_of_a_topic_share_one_subscription() -> None:
    server = ScriptedServer()
    async with connected(server) as client:
        first, second = client.subscribe("/map"), client.subscribe("/map")
        client.unsubscribe(first)
        await server.until(lambda: server.asked("subscribe"))
        await server.publish("/map", {"data": 1})
        await second.wait_for_more_than(0, timeout_s=PATIENCE_S)
        client.unsubscribe(second)
        await server.until(lambda: server.asked("unsubscribe"))
    assert len(server.asked("subscribe")) == len(server.asked("unsubscribe")) == 1


async def test_after_a_loss_everything_is_as_it_was() -> None:
    server = ScriptedServer({"call_service": echo})
    async with connected(server) as client:
        heard = client.subscribe("/pose")
        client.advertise("/cmd_vel", type_name=TWIST)
        await server.until(lambda: server.asked("subscribe"))
        await server.drop_all()
        await server.until(lambda: len(server.asked("subscribe")) == 2)
        await server.publish("/pose", {"data": 2})
        assert await heard.wait_for_more_than(0, timeout_s=PATIENCE_S) == {"data": 2}
        assert await client.call_service("/add", {"a": 1}) == {"a": 1}
        await client.publish("/cmd_vel", {"linear": {"x": 0.1}})
        await server.until(lambda: server.asked("publish"))
        publisher = next(each for each in server.visitors if each.asked("publish"))
        assert publisher.asked("advertise")
        assert publisher.number >= 2


async def test_what_was_ended_is_not_begun_again_after_a_loss() -> None:
    server = ScriptedServer({"call_service": echo})
    async with connected(server) as client:
        client.unsubscribe(client.subscribe("/camera"))
        client.subscribe("/pose")
        await server.until(lambda: len(server.asked("subscribe")) == 2)
        await server.drop_all()
        await server.until(lambda: len(server.asked("subscribe")) == 3)
    assert server.asked("subscribe")[-1]["topic"] == "/pose"


async def test_a_call_under_way_when_the_connection_goes_is_an_error_at_once() -> None:
    async def vanish(visitor: Visitor, _call: Operation) -> None:
        await visitor.drop()

    async with connected(ScriptedServer({"call_service": vanish})) as client:
        with pytest.raises(LinkError, match="was lost while /add was asked"):
            await client.call_service("/add", timeout_s=PATIENCE_S)


async def test_a_server_that_comes_back_later_is_found_again() -> None:
    server = ScriptedServer({"call_service": echo})
    async with connected(server) as client:
        server.hangs_up = True
        await server.drop_all()
        while client.lost_for_s is None:
            await anyio.lowlevel.checkpoint()
        with pytest.raises(LinkError, match="has been lost for"):
            await client.call_service("/add", timeout_s=0.05)
        server.hangs_up = False
        assert await client.call_service("/add", {"a": 2}, timeout_s=PATIENCE_S) == {"a": 2}


async def test_waits_for_a_robot_that_has_gone_do_not_add_up() -> None:
    server = ScriptedServer({"call_service": echo})
    patience = replace(QUICK, answer_s=0.5, attempt_s=0.01)
    async with connected(server, patience=patience) as client:
        server.hangs_up = True
        await server.drop_all()
        while client.lost_for_s is None:
            await anyio.lowlevel.checkpoint()
        for _ in range(60):
            # Half a second each would be more than a test may take.
            with pytest.raises(LinkError, match="has been lost for"):
                await client.wait_until_connected()
        assert client.lost_for_s is not None
        server.hangs_up = False
        await client.call_service("/add", timeout_s=PATIENCE_S)
        while client.lost_for_s is not None:
            await anyio.lowlevel.checkpoint()
        await client.wait_until_connected()


async def test_a_hundred_losses_leave_no_socket_behind() -> None:
    server = ScriptedServer({"call_service": echo})
    async with connected(server) as client:
        client.subscribe("/pose")
        for _ in range(100):
            await server.until(lambda: is_whole(server))
            await server.drop_all()
        await server.until(lambda: is_whole(server))
        assert await client.call_service("/add", {"a": 1}, timeout_s=PATIENCE_S) == {"a": 1}
        assert len(server.visitors) == 202


async def test_a_socket_without_a_sign_of_life_is_replaced() -> None:
    server = ScriptedServer(answers_pings=True)
    patience = Patience(
        connect_s=PATIENCE_S,
        ping_s=0.01,
        silence_s=0.05,
        first_pause_s=0.001,
        linger_s=0.0,
        goodbye_s=0.01,
    )
    async with connected(server, patience) as client:
        client.subscribe("/pose")
        await server.until(lambda: server.asked("subscribe"))
        (subscriber,) = (each for each in server.visitors if each.asked("subscribe"))
        server.answers_pings = False
        await server.until(lambda: subscriber.is_gone)
        server.answers_pings = True
        await server.until(lambda: len(server.asked("subscribe")) >= 2)


async def test_garbage_is_counted_and_the_talk_goes_on() -> None:
    server = ScriptedServer()
    async with connected(server) as client:
        heard = client.subscribe("/pose")
        await server.until(lambda: server.asked("subscribe"))
        for visitor in server.present:
            await visitor.send_text(b"{no json")
            await visitor.send_binary(b"\xff\x00")
            await visitor.send_text(b"[]")
            await visitor.send({"op": "publish", "topic": "/nobody/asked", "msg": {}})
        await server.publish("/pose", {"data": 1})
        assert await heard.wait_for_more_than(0, timeout_s=PATIENCE_S) == {"data": 1}
        assert client.n_frames_refused >= 3
        assert client.n_connections == 1


async def test_bytes_that_are_no_websocket_frames_cost_the_socket_and_nothing_else() -> None:
    server = ScriptedServer({"call_service": echo})
    async with connected(server) as client:
        heard = client.subscribe("/pose")
        await server.until(lambda: server.asked("subscribe"))
        for visitor in server.present:
            await visitor.send_raw(b"\xff" * 20)
        await server.until(lambda: len(server.asked("subscribe")) == 2)
        await server.publish("/pose", {"data": 1})
        assert await heard.wait_for_more_than(0, timeout_s=PATIENCE_S) == {"data": 1}


async def test_a_frame_cut_off_by_a_loss_is_not_taken_for_a_message() -> None:
    server = ScriptedServer()
    async with connected(server) as client:
        heard = client.subscribe("/pose")
        await server.until(lambda: server.asked("subscribe"))
        text = orjson.dumps({"op": "publish", "topic": "/pose", "msg": {"data": 1}})
        for visitor in server.present:
            await visitor.send_raw(bytes([0x81, len(text)]) + text[:-5])
            await visitor.drop()
        await server.until(lambda: len(server.asked("subscribe")) == 2)
        assert heard.n_received == 0
        await server.publish("/pose", {"data": 2})
        assert await heard.wait_for_more_than(0, timeout_s=PATIENCE_S) == {"data": 2}


async def test_the_last_publication_arrives_before_the_connection_closes() -> None:
    server = ScriptedServer()
    async with connected(server) as client:
        client.advertise("/cmd_vel", type_name=TWIST)
        await client.publish("/cmd_vel", {"linear": {"x": 0.0}})
    assert server.asked("publish") == [
        {"op": "publish", "topic": "/cmd_vel", "msg": {"linear": {"x": 0.0}}}
    ]


async def test_an_error_of_the_user_comes_out_as_it_was_raised() -> None:
    async with running(ScriptedServer()) as server:
        with pytest.raises(LinkError, match="mine"):
            async with open_client(RobotAddress(url=server.url), patience=QUICK):
                raise LinkError("mine", hint="")


async def test_nobody_at_the_port_is_said_with_how_to_start_rosbridge() -> None:
    server = ScriptedServer()
    async with running(server):
        pass
    error = await fails_with(RobotAddress(url=server.url))
    assert "Nothing listens at ws://127.0.0.1:" in error.message
    assert "rosbridge_websocket_launch.xml" in error.hint


async def test_a_name_that_nobody_knows_is_said() -> None:
    error = await fails_with(RobotAddress(url="ws://no-such-robot.invalid"))
    assert "'no-such-robot.invalid'" in error.message


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\nhi", "HTTP status 200"),
        (b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n", "HTTP status 404"),
        (b"SSH-2.0-OpenSSH_9.6\r\n", "something else than a websocket"),
        (b"", "hung up"),
    ],
)
async def test_something_else_at_the_port_is_said(data: bytes, told: str) -> None:
    async with answering_with(data) as url:
        error = await fails_with(RobotAddress(url=url))
    assert "is not a rosbridge server" in error.message
    assert told in error.message
    assert "9090" in error.hint


async def test_a_server_that_wants_a_token_is_said() -> None:
    async with answering_with(b"HTTP/1.1 401 Unauthorized\r\nContent-Length: 0\r\n\r\n") as url:
        error = await fails_with(RobotAddress(url=url))
    assert "does not let us in" in error.message
    assert "token" in error.hint


async def test_a_token_goes_into_the_header_or_ahead_of_everything_else() -> None:
    server = ScriptedServer({"call_service": echo})
    async with running(server):
        address = RobotAddress(
            url=server.url,
            headers={"Authorization": "Bearer secret"},
            token="open sesame",  # noqa: S106 - a fairy tale
        )
        async with open_client(address, patience=QUICK) as client:
            await client.call_service("/add")
    for visitor in server.visitors:
        assert visitor.request is not None
        assert visitor.request.headers["Authorization"] == "Bearer secret"
        assert visitor.operations[0] == {"op": "auth", "token": "open sesame"}
    assert "secret" not in repr(address)
    assert "sesame" not in repr(address)


@pytest.mark.parametrize(
    ("url", "shown"),
    [
        ("ws://robot", "ws://robot:9090"),
        ("ws://robot:8080/", "ws://robot:8080"),
        ("ws://robot/?token=secret", "ws://robot:9090"),
        ("wss://user:secret@robot", "wss://robot:9090"),
        ("ws://[fe80::1]", "ws://[fe80::1]:9090"),
        ("ws://[fe80::1]:80", "ws://[fe80::1]:80"),
    ],
)
def test_an_address_has_the_usual_port_and_shows_no_password(url: str, shown: str) -> None:
    assert RobotAddress(url=url).shown == shown
    assert "secret" not in repr(RobotAddress(url=url))


def test_robots_behind_one_gateway_are_told_apart_without_their_tokens() -> None:
    urls = ("wss://gate/hall", "wss://gate/?id=7", "wss://gate/?id=8&token=a", "wss://gate")
    assert len({RobotAddress(url=url).shown for url in urls}) == len(urls)
    renewed = RobotAddress(url="wss://gate/?id=8&token=b")
    assert renewed.shown == RobotAddress(url=urls[2]).shown


@pytest.mark.parametrize("url", ["ws://bob:secret@robot:port", "ws://robot:x/?token=secret"])
def test_what_is_no_address_is_refused_without_showing_its_secrets(url: str) -> None:
    with pytest.raises(ConfigError) as refused:
        RobotAddress(url=url)
    assert "secret" not in str(refused.value)


@pytest.mark.parametrize("url", ["", "robot:9090", "http://robot", "ws://", "ws://robot:port"])
def test_what_is_no_address_is_refused(url: str) -> None:
    with pytest.raises(ConfigError, match="not the address"):
        RobotAddress(url=url)


async def test_a_robot_that_sends_nothing_but_garbage_gets_another_connection(
    caplog: pytest.LogCaptureFixture,
) -> None:
    server = ScriptedServer({"call_service": echo})
    async with connected(server) as client:
        garbage = next(iter(server.present))
        for _ in range(MAX_REFUSED):
            await garbage.send_text(b"{no json")
        await garbage.send({"op": "status", "level": "info", "msg": "an honest word"})
        for _ in range(MAX_REFUSED + 1):
            await garbage.send_text(b"{no json")
        await server.until(lambda: len(server.visitors) == 3)
        assert await client.call_service("/echo", {"a": 1}) == {"a": 1}
    warnings = [each.message for each in caplog.records]
    assert len([each for each in warnings if "left away" in each]) == 1
    assert len([each for each in warnings if "made anew" in each]) == 1


async def test_a_frame_that_claims_to_be_far_too_large_costs_the_connection() -> None:
    server = ScriptedServer({"call_service": echo})
    async with connected(server) as client:
        head = b"\x82\x7f" + (MAX_SKIPPED_BYTES + 1).to_bytes(8)
        await next(iter(server.present)).send_raw(head)
        await server.until(lambda: len(server.visitors) == 3)
        assert await client.call_service("/echo", {"a": 1}) == {"a": 1}


async def test_a_message_that_is_too_large_is_left_away_and_the_connection_stays(
    caplog: pytest.LogCaptureFixture,
) -> None:
    server = ScriptedServer()
    half = MAX_FRAME_BYTES // 2 + 1
    async with connected(server) as client:
        heard = client.subscribe("/pose")
        await server.until(lambda: server.asked("subscribe"))
        for visitor in (each for each in server.present if each.asked("subscribe")):
            await visitor.send_raw(b"\x82\x7f" + (2 * half).to_bytes(8))
            for _ in range(2):
                await visitor.send_raw(bytes(half))
            await visitor.send_raw(b"\x02\x7f" + half.to_bytes(8))
            await visitor.send_raw(bytes(half))
            await visitor.send_raw(b"\x80\x7f" + half.to_bytes(8))
            await visitor.send_raw(bytes(half))
        await server.publish("/pose", {"data": 1})
        assert await heard.wait_for_more_than(0, timeout_s=PATIENCE_S) == {"data": 1}
        assert client.n_connections == 1
        assert client.n_frames_refused >= 2
    assert [each for each in caplog.records if f"> {MAX_FRAME_BYTES} bytes" in each.message]


async def test_a_message_in_countless_empty_frames_costs_the_connection() -> None:
    server = ScriptedServer({"call_service": echo})
    async with connected(server) as client:
        begun, more = b"\x01\x00", b"\x00\x00"
        await next(iter(server.present)).send_raw(begun + more * (MAX_PARTS + 10))
        await server.until(lambda: len(server.visitors) == 3)
        assert await client.call_service("/echo", {"a": 1}) == {"a": 1}


async def test_a_latched_topic_is_advertised_as_such() -> None:
    server = ScriptedServer()
    async with connected(server) as client:
        client.advertise("/markers", type_name=TWIST, is_latched=True)
        client.advertise("/cmd_vel", type_name=TWIST)
        await server.until(lambda: len(server.asked("advertise")) == 4)
    latched = {each["topic"]: each.get("latch") for each in server.asked("advertise")}
    assert latched == {"/markers": True, "/cmd_vel": None}


async def test_countless_empty_frames_behind_the_greeting_are_no_rosbridge() -> None:
    async def greet(stream: ByteStream) -> None:
        protocol = ServerProtocol()
        async with stream:
            protocol.receive_data(await stream.receive())
            (request,) = protocol.events_received()
            assert isinstance(request, Request)
            protocol.send_response(protocol.accept(request))
            frames = b"\x01\x00" + b"\x00\x00" * (MAX_PARTS + 10)
            await stream.send(b"".join([*protocol.data_to_send(), frames]))

    listener = await anyio.create_tcp_listener(local_host="127.0.0.1")
    port = listener.extra(SocketAttribute.local_port)  # noqa: S610 - no SQL
    async with listener, anyio.create_task_group() as tasks:
        tasks.start_soon(listener.serve, greet)
        told = await fails_with(RobotAddress(url=f"ws://127.0.0.1:{port}"))
        tasks.cancel_scope.cancel()
    assert "is not a rosbridge server" in told.message


async def test_a_goal_whose_sender_gave_up_in_an_outage_takes_no_socket() -> None:
    server = ScriptedServer({"call_service": echo})
    async with connected(server) as client:
        client.subscribe("/pose")
        await server.until(lambda: server.asked("subscribe"))
        server.hangs_up = True
        await server.drop_all()
        while client.lost_for_s is None:
            await anyio.lowlevel.checkpoint()
        with anyio.move_on_after(0.05):
            await client.send_goal("/dance", {}, type_name="dance_msgs/action/Dance")
        server.hangs_up = False
        await server.until(lambda: is_whole(server))
        client.subscribe("/scan")
        await client.call_service("/add", {"a": 1}, timeout_s=PATIENCE_S)
        await server.until(
            lambda: any(each["topic"] == "/scan" for each in server.asked("subscribe"))
        )
        (asked,) = [each for each in server.present if each.asked("call_service")]
        assert not asked.asked("subscribe")


async def test_a_message_in_many_frames_is_put_together() -> None:
    server = ScriptedServer()
    async with connected(server) as client:
        heard = client.subscribe("/pose")
        await server.until(lambda: server.asked("subscribe"))
        text = orjson.dumps({"op": "publish", "topic": "/pose", "msg": {"data": "x" * 1_000}})
        frames = [bytes([0, 1, each]) for each in text]
        raw = b"".join([b"\x01\x00", *frames, b"\x80\x00"])
        for visitor in server.present:
            await visitor.send_raw(raw)
        assert await heard.wait_for_more_than(0, timeout_s=PATIENCE_S) == {"data": "x" * 1_000}


@pytest.mark.parametrize("n_behind", [0, 10])
async def test_a_large_frame_is_taken_with_what_comes_behind_it(n_behind: int) -> None:
    server = ScriptedServer()
    async with connected(server) as client:
        heard = client.subscribe("/map")
        await server.until(lambda: server.asked("subscribe"))
        for number in range(n_behind + 1):
            await server.publish("/map", {"data": [number] * 300_000})
        cells = (await heard.wait_for_more_than(n_behind, timeout_s=PATIENCE_S))["data"]
        assert cells.tolist() == [n_behind] * 300_000


async def test_compression_is_not_offered() -> None:
    server = ScriptedServer()
    async with connected(server):
        for visitor in server.present:
            assert visitor.request is not None
            assert "Sec-WebSocket-Extensions" not in visitor.request.headers


def test_an_old_cbor_library_before_ours_is_named(tmp_path: Path) -> None:
    (tmp_path / "cbor2.py").write_text(OLD_CBOR)
    program = f"""
import sys
sys.path.insert(0, {str(tmp_path)!r})
import anyio
from mapspeak.errors import ConfigError
from mapspeak.links.rosbridge import RobotAddress, open_client
async def connect():
    async with open_client(RobotAddress(url="ws://127.0.0.1:1")): pass
try:
    anyio.run(connect)
except ConfigError as error:
    print(error)
"""
    said = subprocess.run(  # noqa: S603 - our own program
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    ).stdout
    assert f"cbor2 in {tmp_path} is too old" in said
    assert "PYTHONPATH" in said


@pytest.mark.parametrize("seed", range(4))
async def test_whatever_is_sent_other_calls_are_answered(
    seed: int, caplog: pytest.LogCaptureFixture
) -> None:
    server = ScriptedServer({"call_service": echo})
    chance = random.Random(seed)  # noqa: S311 - no secret
    seeds = seed_frames("/pose")
    async with connected(server) as client:
        heard = client.subscribe("/pose")
        await server.until(lambda: server.asked("subscribe"))
        for number in range(200):
            is_text, data = mutate(chance.choice(seeds), chance.choice(seeds), chance)
            for visitor in server.present:
                await (visitor.send_text(data) if is_text else visitor.send_binary(data))
            if number % 50 == 0:
                assert await client.call_service("/echo", {"a": number}) == {"a": number}
        n_received = heard.n_received
        await server.publish("/pose", {"data": 1})
        await heard.wait_for_more_than(n_received, timeout_s=PATIENCE_S)
        assert client.n_connections == 1
    assert not [each for each in caplog.records if each.exc_info]
