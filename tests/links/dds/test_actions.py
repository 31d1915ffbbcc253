"""Goals over DDS to an action server in this process."""

from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from typing import Any

import anyio
import pytest

pytest.importorskip("cyclonedds", reason="has no wheel for this Python")

from dds_node import LATCHED, DdsNode, Reply, Request, open_dds_node, open_here, some_network
from dds_node import until as until_so
from mapspeak.errors import LinkError
from mapspeak.links.dds import DdsConnection
from mapspeak.links.dds.discovery import Framing
from mapspeak.ros.actions import open_action
from mapspeak.ros.activity import ActionGoal, ActionState
from mapspeak.ros.link import USUAL_PATIENCE, Patience
from mapspeak.ros.messages.fields import Dialect

pytestmark = pytest.mark.anyio

ACTION, TYPE = "/count", "example_interfaces/action/Fibonacci"
CANCEL_TYPE = "action_msgs/srv/CancelGoal"
UNKNOWN_GOAL = 2
BRIEF = Patience(acceptance_s=0.3, listing_s=0.0)
EXECUTING, SUCCEEDED, CANCELED, ABORTED = 2, 4, 5, 6


class Counter:
    """An action server whose goals do what the test says."""

    def __init__(self, node: DdsNode, *, framing: Framing) -> None:
        self.node = node
        self.accepts = True
        self.is_slow = False
        self.late: list[tuple[Request, Reply]] = []
        self.statuses: dict[bytes, int] = {}
        self._waiting: list[tuple[bytes, Reply]] = []
        self._results: dict[bytes, Request] = {}
        node.advertise(f"{ACTION}/_action/feedback", f"{TYPE}_FeedbackMessage")
        node.advertise(
            f"{ACTION}/_action/status", "action_msgs/msg/GoalStatusArray", quality=LATCHED
        )
        for part, type_name, answer in (
            ("send_goal", f"{TYPE}_SendGoal", self._judge),
            ("get_result", f"{TYPE}_GetResult", self._promise),
            ("cancel_goal", CANCEL_TYPE, self._cancel),
        ):
            node.serve(f"{ACTION}/_action/{part}", type_name, answer, framing=framing)

    def take_late(self) -> None:
        """Takes the goals that have waited."""
        self.is_slow = False
        for request, reply in self.late:
            self._judge(request, reply)

    def _judge(self, request: Request, reply: Reply) -> None:
        if self.is_slow:
            self.late.append((request, reply))
            return
        if self.accepts:
            self.statuses[request["goal_id"]["uuid"]] = EXECUTING
        reply({"accepted": self.accepts})
        self.tell()

    def _promise(self, request: Request, reply: Reply) -> None:
        uuid = request["goal_id"]["uuid"]
        if uuid in self._results:
            reply(self._results[uuid])
        else:
            self._waiting.append((uuid, reply))

    def _cancel(self, request: Request, reply: Reply) -> None:
        uuid = request["goal_info"]["goal_id"]["uuid"]
        if uuid not in self.statuses:
            reply({"return_code": UNKNOWN_GOAL})
            return
        reply({"return_code": 0, "goals_canceling": [{"goal_id": {"uuid": uuid}}]})
        self.end(uuid, CANCELED)

    def tell(self) -> None:
        statuses = [
            {"goal_info": {"goal_id": {"uuid": uuid}}, "status": status}
            for uuid, status in self.statuses.items()
        ]
        self.node.publish(f"{ACTION}/_action/status", {"status_list": statuses})

    def feed_back(self, uuid: bytes, *numbers: int) -> None:
        feedback = {"goal_id": {"uuid": uuid}, "feedback": {"sequence": list(numbers)}}
        self.node.publish(f"{ACTION}/_action/feedback", feedback)

    def answer_other_client(self, status: int) -> None:
        """Answers as if another client had asked for the result of its own goal."""
        type_name, raw_writer = self.node._raw_writers["rr/count/_action/get_resultReply"]
        message = {"status": status, "result": {"sequence": [99]}}
        raw_writer.write(self.node.types.encode(type_name, message))

    def end(self, uuid: bytes, status: int, *numbers: int) -> None:
        self.statuses[uuid] = status
        self.tell()
        self._results[uuid] = {"status": status, "result": {"sequence": list(numbers)}}
        for asked, reply in self._waiting:
            if asked == uuid:
                reply(self._results[uuid])


@asynccontextmanager
async def open_counter(
    framing: Framing = Framing.NUMBERED, *, patience: Patience = USUAL_PATIENCE
) -> AsyncGenerator[tuple[Counter, DdsConnection]]:
    network = some_network()
    async with open_dds_node(network) as node:
        counter = Counter(node, framing=framing)
        async with open_here(network, framing=framing, patience=patience) as connection:
            yield counter, connection


@pytest.fixture(params=list(Framing), ids=lambda framing: str(framing.name).lower())
def framing(request: pytest.FixtureRequest) -> Framing:
    # All of DDS here is Cyclone's: that a node is on Fast DDS can only be claimed.
    chosen: Framing = request.param
    return chosen


async def until(goal: ActionGoal, is_so: Callable[[ActionGoal], object]) -> None:
    news = anyio.Event()

    def consider() -> None:
        if is_so(goal):
            news.set()

    goal.listen(consider)
    consider()
    with anyio.fail_after(5.0):
        await news.wait()


def uuid_of(goal: ActionGoal) -> bytes:
    return bytes.fromhex(goal.ros_id or "")


async def send(connection: DdsConnection) -> ActionGoal:
    goal = await connection.send_goal(ACTION, {"order": 3}, type_name=TYPE)
    await until(goal, lambda goal: goal.is_accepted)
    return goal


async def test_the_action_is_in_the_graph_and_its_parts_are_not(framing: Framing) -> None:
    async with open_counter(framing) as (_, connection):
        graph = await connection.fetch_graph()
        assert await connection.fetch_action_type(ACTION) == "example_interfaces/Fibonacci"
        assert await connection.fetch_services() == ()
    assert (graph.actions, dict(graph.types)) == ((ACTION,), {})


async def test_a_goal_is_accepted_fed_back_and_ends_with_its_result(framing: Framing) -> None:
    async with open_counter(framing) as (counter, connection):
        goal = await send(connection)
        counter.feed_back(uuid_of(goal), 0, 1)
        await until(goal, lambda goal: goal.feedback)
        counter.end(uuid_of(goal), SUCCEEDED, 0, 1, 1)
        await until(goal, lambda goal: goal.end)
    assert goal.feedback is not None
    assert list(goal.feedback["sequence"]) == [0, 1]
    assert goal.end is not None
    assert (goal.end.status, goal.end.is_result) == (SUCCEEDED, True)
    assert list(goal.end.values["sequence"]) == [0, 1, 1]


async def test_a_rejected_goal_ends_without_a_result(framing: Framing) -> None:
    async with open_counter(framing) as (counter, connection):
        counter.accepts = False
        goal = await connection.send_goal(ACTION, {"order": 3}, type_name=TYPE)
        await until(goal, lambda goal: goal.end)
    assert goal.end is not None
    assert not goal.end.is_result
    assert not goal.is_accepted


async def test_a_cancelled_goal_says_so(framing: Framing) -> None:
    async with open_counter(framing) as (_, connection):
        goal = await send(connection)
        connection.cancel_goal(goal)
        await until(goal, lambda goal: goal.end)
    assert goal.end is not None
    assert goal.end.status == CANCELED


async def test_two_goals_end_each_as_it_does(framing: Framing) -> None:
    async with open_counter(framing) as (counter, connection):
        first, second = await send(connection), await send(connection)
        counter.end(uuid_of(second), SUCCEEDED, 2)
        counter.end(uuid_of(first), ABORTED, 1)
        await until(first, lambda goal: goal.end)
        await until(second, lambda goal: goal.end)
    assert first.end is not None
    assert second.end is not None
    assert (first.end.status, list(first.end.values["sequence"])) == (ABORTED, [1])
    assert (second.end.status, list(second.end.values["sequence"])) == (SUCCEEDED, [2])


async def test_the_result_of_somebody_elses_goal_does_not_end_ours() -> None:
    async with open_counter(Framing.BARE) as (counter, connection):
        goal = await send(connection)
        counter.answer_other_client(ABORTED)
        counter.feed_back(uuid_of(goal), 1)
        await until(goal, lambda goal: goal.feedback)
        assert goal.end is None
        counter.end(uuid_of(goal), SUCCEEDED, 5)
        await until(goal, lambda goal: goal.end)
    assert goal.end is not None
    assert list(goal.end.values["sequence"]) == [5]


async def test_a_goal_whose_server_goes_is_lost(framing: Framing) -> None:
    async with open_counter(framing) as (counter, connection):
        goal = await send(connection)
        counter.node.stop_serving(f"{ACTION}/_action/send_goal")
        await until(goal, lambda goal: goal.is_lost)
    assert goal.end is None


async def test_a_goal_is_lost_with_its_server_though_another_was_started_since() -> None:
    network = some_network()
    async with open_dds_node(network) as first, open_dds_node(network, name="/again") as second:
        Counter(first, framing=Framing.NUMBERED)
        async with open_here(network) as connection:
            goal = await send(connection)
            Counter(second, framing=Framing.NUMBERED)
            first.stop_serving(f"{ACTION}/_action/send_goal")
            await until(goal, lambda goal: goal.is_lost)
    assert goal.end is None


@pytest.mark.parametrize("is_stopped", [False, True])
async def test_a_goal_that_is_taken_too_late_is_cancelled_at_once(
    framing: Framing, *, is_stopped: bool
) -> None:
    async with open_counter(framing, patience=BRIEF) as (counter, connection):
        counter.is_slow = True
        client = open_action(connection, ACTION, dialect=Dialect.ROS2, type_name=TYPE)
        goal = await client.send({"order": 3}, through=connection)
        await client.wait_until_taken(goal)
        assert goal.state is ActionState.REJECTED
        if is_stopped:
            await client.end()
        counter.take_late()
        assert await goal.wait_until(lambda: goal.is_settled, within_s=5.0)
    assert counter.statuses == {bytes.fromhex(goal.id): CANCELED}
    assert "cancelled at once" in goal.afterwards


async def test_a_goal_that_was_ended_before_it_was_taken_is_cancelled_when_it_is(
    framing: Framing,
) -> None:
    async with open_counter(framing, patience=BRIEF) as (counter, connection):
        counter.is_slow = True
        client = open_action(connection, ACTION, dialect=Dialect.ROS2, type_name=TYPE)
        goal = await client.send({"order": 3}, through=connection)
        await client.end()
        assert goal.state is ActionState.CANCELLED
        await until_so(lambda: counter.late)
        counter.take_late()
        assert await goal.wait_until(lambda: goal.is_settled, within_s=5.0)
    assert counter.statuses == {bytes.fromhex(goal.id): CANCELED}


async def test_a_goal_that_does_not_fit_or_goes_nowhere_is_an_error() -> None:
    async with open_counter() as (_, connection):
        for action, arguments, type_name, message in (
            (ACTION, {"orders": 3}, TYPE, "'goal.orders'"),
            (ACTION, {"order": 3}, "nav2_msgs/action/Wait", "is a example_interfaces/Fibonacci"),
            ("/nobody", {}, TYPE, "Nobody serves"),
        ):
            request: dict[str, Any] = arguments
            with pytest.raises(LinkError, match=message):
                await connection.send_goal(action, request, type_name=type_name)
