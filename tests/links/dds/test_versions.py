"""Types that differ from one distribution of ROS 2 to the next: the robot's own are found."""

from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from functools import partial
from typing import Any

import anyio
import pytest

pytest.importorskip("cyclonedds", reason="has no wheel for this Python")

from dds_node import DdsNode, Reply, Request, open_dds_node, open_here, some_network, until
from mapspeak.errors import LinkError
from mapspeak.links.dds import DdsConnection
from mapspeak.links.dds.types import Types, build_type_book
from mapspeak.ros.activity import ActionGoal
from mapspeak.ros.definitions.texts import DISTROS
from mapspeak.ros.definitions.types import hash_type

pytestmark = pytest.mark.anyio

SPIN, SPIN_TYPE = "/spin", "nav2_msgs/action/Spin"
PARTS_ON_THE_WIRE = ("SendGoal_Request", "GetResult_Response", "FeedbackMessage")
SUCCEEDED = 4


def actions_of(distro: str) -> list[str]:
    texts = build_type_book(distro).texts
    goals = [name for name in texts if name.startswith("nav2_msgs/") and name.endswith("_Goal")]
    return [name.removesuffix("_Goal") for name in goals]


@pytest.mark.parametrize("distro", DISTROS)
def test_every_action_of_nav2_is_found_by_the_hashes_of_its_parts(distro: str) -> None:
    book, types = build_type_book(distro), Types()
    actions = actions_of(distro)
    assert {"nav2_msgs/Spin", "nav2_msgs/BackUp", "nav2_msgs/FollowWaypoints"} <= set(actions)
    for action in actions:
        for part in PARTS_ON_THE_WIRE:
            types.take_hash(f"{action}_{part}", hash_type(book, f"{action}_{part}"))
            assert types.knows(f"{action}_{part}")
        for name, text in types.definitions(action).items():
            assert fields_in(text) == fields_in(book.texts[name]), name


def fields_in(text: str) -> list[str]:
    """Constants are no part of a hash."""
    return [line.partition(" ")[2].split()[0] for line in text.splitlines() if "=" not in line]


def test_a_service_is_found_by_the_hash_of_its_request() -> None:
    book, types = build_type_book("jazzy"), Types()
    name = "nav2_msgs/IsPathValid_Request"
    assert book.texts[name] != build_type_book("kilted").texts[name]
    types.take_hash(name, hash_type(book, name))
    assert types.definitions(name) == {each: book.texts[each] for each in types.definitions(name)}


def serve_action(
    node: DdsNode,
    name: str,
    action_type: str,
    take: Callable[[Request], None],
    result: Request | None = None,
) -> None:
    """Serves an action whose goals are reached at once."""

    def accept(request: Request, reply: Reply) -> None:
        take(request)
        reply({"accepted": True})

    def finish(_request: Request, reply: Reply) -> None:
        reply({"status": SUCCEEDED, "result": result or {}})

    node.advertise(f"{name}/_action/feedback", f"{action_type}_FeedbackMessage")
    node.advertise(f"{name}/_action/status", "action_msgs/msg/GoalStatusArray")
    node.serve(f"{name}/_action/send_goal", f"{action_type}_SendGoal", accept)
    node.serve(f"{name}/_action/get_result", f"{action_type}_GetResult", finish)
    node.serve(
        f"{name}/_action/cancel_goal",
        "action_msgs/srv/CancelGoal",
        lambda _request, reply: reply({}),
    )


@asynccontextmanager
async def open_spinner(distro: str) -> AsyncGenerator[tuple[list[Request], DdsConnection]]:
    """A robot that turns at once, and says that it took a second."""
    network = some_network()
    taken: list[Request] = []

    async with open_dds_node(network, distro=distro) as node:
        result = {"total_elapsed_time": {"sec": 1}}
        serve_action(node, SPIN, SPIN_TYPE, taken.append, result)
        async with open_here(network) as connection:
            yield taken, connection


@pytest.mark.parametrize("distro", DISTROS)
async def test_a_robot_of_each_distribution_spins(distro: str) -> None:
    async with open_spinner(distro) as (taken, connection):
        goal = await connection.send_goal(SPIN, {"target_yaw": 1.5}, type_name=SPIN_TYPE)
        ended = await until_over(goal)
    (request,) = taken
    assert request["goal"]["target_yaw"] == 1.5
    assert ("disable_collision_checks" in request["goal"]) is (distro in ("kilted", "lyrical"))
    assert ended["total_elapsed_time"] == {"sec": 1, "nanosec": 0}


async def test_every_action_of_nav2_runs_on_a_robot_of_humble() -> None:
    book, network = build_type_book("humble"), some_network()
    actions = {f"/{action.rpartition('/')[2].lower()}": action for action in actions_of("humble")}
    taken: dict[str, Request] = {}
    async with open_dds_node(network, distro="humble") as node:
        for name, action in actions.items():
            full = action.replace("/", "/action/")
            serve_action(node, name, full, partial(taken.__setitem__, action))
        async with open_here(network) as connection:
            await until(lambda: connection.discovery.nodes)
            assert (await connection.fetch_graph()).distro == "humble"
            for name, action in actions.items():
                goal = await connection.send_goal(
                    name, {}, type_name=action.replace("/", "/action/")
                )
                result = await until_over(goal)
                assert result.keys() == {field.name for field in book[f"{action}_Result"].fields}
    assert taken.keys() == set(actions.values())
    for action, request in taken.items():
        fields = book[f"{action}_Goal"].fields
        assert request["goal"].keys() == {field.name for field in fields}


async def test_a_version_that_nobody_knows_is_refused_before_anything_is_sent() -> None:
    async with open_spinner("kilted") as (taken, connection):
        await until(lambda: connection.types.knows(f"{SPIN_TYPE}_SendGoal_Request"))
        connection.types.take_hash(f"{SPIN_TYPE}_SendGoal_Request", f"RIHS01_{'0' * 64}")
        with pytest.raises(LinkError, match="other fields") as refused:
            await connection.send_goal(SPIN, {"target_yaw": 1.5}, type_name=SPIN_TYPE)
    assert taken == []
    assert "again does not help" in refused.value.hint


async def until_over(goal: ActionGoal) -> dict[str, Any]:
    is_over = anyio.Event()
    goal.listen(lambda: is_over.set() if goal.end is not None else None)
    if goal.end is None:
        with anyio.fail_after(5.0):
            await is_over.wait()
    assert goal.end is not None
    values: dict[str, Any] = goal.end.values
    return values
