"""Services over DDS, framed in both ways."""

from collections.abc import Callable
from typing import Any

import anyio
import pytest

pytest.importorskip("cyclonedds", reason="has no wheel for this Python")

from dds_node import SET_BOOL, answer_set_bool, open_both, until
from mapspeak.errors import LinkError
from mapspeak.links.dds.discovery import Framing

pytestmark = pytest.mark.anyio


@pytest.mark.parametrize("framing", list(Framing))
async def test_a_service_answers(framing: Framing) -> None:
    async with open_both(framing=framing) as (node, connection):
        node.serve("/switch", SET_BOOL, answer_set_bool, framing=framing)
        await until(lambda: connection.discovery.server_of("/switch"))
        for is_on in (True, False, True):
            answer = await connection.call_service("/switch", {"data": is_on})
            assert answer == {"success": is_on, "message": "as you wish"}


async def test_many_calls_at_once_get_each_its_own_answer() -> None:
    async with open_both(
        lambda node: node.serve(
            "/add",
            "example_interfaces/srv/AddTwoInts",
            lambda request, reply: reply({"sum": request["a"] + request["b"]}),
        )
    ) as (_, connection):
        sums: dict[int, int] = {}

        async def add(number: int) -> None:
            answer = await connection.call_service("/add", {"a": number, "b": 1})
            sums[number] = answer["sum"]

        async with anyio.create_task_group() as tasks:
            for number in range(20):
                tasks.start_soon(add, number)
    assert sums == {number: number + 1 for number in range(20)}


async def test_a_service_that_does_not_answer_is_an_error_after_the_limit() -> None:
    async with open_both(
        lambda node: node.serve("/switch", SET_BOOL, lambda _request, _reply: None)
    ) as (_, connection):
        with pytest.raises(LinkError, match="did not answer"):
            await connection.call_service("/switch", {"data": True}, timeout_s=0.1)


async def test_a_late_answer_is_not_taken_for_that_of_the_next_call() -> None:
    held: list[tuple[dict[str, Any], Callable[[dict[str, Any]], None]]] = []

    def answer_two_at_once(
        request: dict[str, Any], reply: Callable[[dict[str, Any]], None]
    ) -> None:
        held.append((request, reply))
        if len(held) == 2:
            for each, answer in held:
                answer_set_bool(each, answer)

    async with open_both(
        lambda node: node.serve("/switch", SET_BOOL, answer_two_at_once, framing=Framing.BARE),
        framing=Framing.BARE,
    ) as (_, connection):
        with pytest.raises(LinkError):
            await connection.call_service("/switch", {"data": True}, timeout_s=0.2)
        answer = await connection.call_service("/switch", {"data": False})
    assert answer["success"] is False


async def test_an_answer_counts_though_an_earlier_call_never_had_one() -> None:
    requests: list[dict[str, Any]] = []

    def answer_but_the_first(
        request: dict[str, Any], reply: Callable[[dict[str, Any]], None]
    ) -> None:
        requests.append(request)
        if len(requests) > 1:
            answer_set_bool(request, reply)

    async with open_both(
        lambda node: node.serve("/switch", SET_BOOL, answer_but_the_first, framing=Framing.BARE),
        framing=Framing.BARE,
    ) as (_, connection):
        with pytest.raises(LinkError):
            await connection.call_service("/switch", {"data": True}, timeout_s=0.2)
        answer = await connection.call_service("/switch", {"data": True})
    assert answer["success"] is True


@pytest.mark.parametrize(
    ("service", "type_name", "arguments", "message"),
    [
        ("/nothing", None, {}, "Nobody serves"),
        ("/switch", "std_srvs/srv/Trigger", {}, "is a std_srvs/SetBool"),
        ("/switch", SET_BOOL, {"on": True}, "'on'"),
        ("no name", None, {}, "not the name of a ROS topic"),
    ],
)
async def test_a_call_that_cannot_be_is_an_error(
    service: str, type_name: str | None, arguments: dict[str, Any], message: str
) -> None:
    async with open_both(lambda node: node.serve("/switch", SET_BOOL, answer_set_bool)) as (
        _,
        connection,
    ):
        with pytest.raises(LinkError, match=message):
            await connection.call_service(service, arguments, type_name=type_name)


async def test_a_node_that_does_not_answer_keeps_the_others_from_telling_the_time_but_once() -> (
    None
):
    service, types = "get_parameter_types", "rcl_interfaces/srv/GetParameterTypes"
    async with open_both() as (node, connection):
        node.serve(f"/a/{service}", types, lambda _request, _reply: None)
        node.serve(f"/b/{service}", types, lambda _request, reply: reply({"types": b""}))
        await until(lambda: len(connection.discovery.services) == 2)
        told = [await connection.fetch_time_s() for _ in range(3)]
    assert told[0] is None
    assert None not in told[1:]
