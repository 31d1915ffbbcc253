"""A described ROS system, asked over the wire by our own client of rosbridge."""

from dataclasses import replace

import numpy as np
import pytest

from fakes import two_rooms
from mapspeak.errors import LinkError
from mapspeak.evaluation.inspected import (
    InspectedSystem,
    Names,
    draw_names,
    draw_system,
    play,
)
from mapspeak.links.rosbridge import RobotAddress, open_client
from mapspeak.ros.messages.fields import Dialect, read_header
from mapspeak.ros.messages.grids import read_grid
from mapspeak.ros.messages.poses import read_transforms

pytestmark = pytest.mark.anyio
DIALECTS = tuple(Dialect)
PATIENCE_S = 60.0


def drawn(dialect: Dialect, seed: int = 1) -> tuple[Names, InspectedSystem]:
    random = np.random.default_rng(seed)
    names = draw_names(random)
    return names, draw_system(random, names, two_rooms(), dialect=dialect)


@pytest.mark.parametrize("dialect", DIALECTS)
async def test_a_played_system_shows_who_publishes_and_who_hears(dialect: Dialect) -> None:
    names, system = drawn(dialect)
    async with play(system) as url, open_client(RobotAddress(url=url)) as client:
        graph = await client.fetch_graph()
        assert graph.dialect is dialect
        assert set(system.topics) <= set(graph.types)
        assert set(system.nodes) <= set(await client.fetch_nodes())
        assert await client.fetch_publishers(names.velocity) == (names.smoother,)
        assert await client.fetch_subscribers(names.velocity) == (names.motors,)


@pytest.mark.parametrize("dialect", DIALECTS)
async def test_streams_come_with_stamps_of_the_robots_clock(dialect: Dialect) -> None:
    names, system = drawn(dialect)
    async with play(system) as url, open_client(RobotAddress(url=url)) as client:
        heard = client.subscribe(names.imu_data)
        message = await heard.wait_for_more_than(0, timeout_s=PATIENCE_S)
        now_s = await client.fetch_time_s()
        assert now_s is not None
        _, stamp_s = read_header(message)
        assert 0.0 <= now_s - stamp_s < PATIENCE_S


@pytest.mark.parametrize("dialect", DIALECTS)
async def test_the_map_is_kept_for_those_who_come_later(dialect: Dialect) -> None:
    names, system = drawn(dialect)
    async with play(system) as url, open_client(RobotAddress(url=url)) as client:
        heard = client.subscribe(names.map, type_name=dialect.type_name("nav_msgs/OccupancyGrid"))
        grid = read_grid(await heard.wait_for_more_than(0, timeout_s=PATIENCE_S))
        assert np.array_equal(grid.cells, two_rooms().cells)


@pytest.mark.parametrize("dialect", DIALECTS)
async def test_types_of_its_own_services_and_parameters_are_told(dialect: Dialect) -> None:
    names, system = drawn(dialect)
    system = replace(system, parameters={**system.parameters, names.navigator: {"max_speed": 9.5}})
    async with play(system) as url, open_client(RobotAddress(url=url)) as client:
        await client.fetch_graph()
        texts = await client.fetch_definitions(names.device_type)
        assert texts[names.device_type].split() == system.types[names.device_type].split()
        offered = system.services[0]
        assert await client.fetch_service_type(offered.service) == offered.type
        assert await client.call_service(offered.service) is not None
        assert await client.fetch_parameter(names.navigator, "max_speed") == 9.5


async def test_a_dead_stream_is_silent_while_its_node_is_there() -> None:
    names, system = drawn(Dialect.ROS2)
    system = system.with_stream(system.stream_on(names.range), rate_hz=0.0)
    async with play(system) as url, open_client(RobotAddress(url=url)) as client:
        heard, alive = client.subscribe(names.range), client.subscribe(names.imu_data)
        await alive.wait_for_more_than(10, timeout_s=PATIENCE_S)
        with pytest.raises(LinkError):
            await heard.wait_for_more_than(0, timeout_s=0.01)
        assert await client.fetch_publishers(names.range) == (names.sonar,)


async def test_a_late_stream_is_stamped_in_the_past() -> None:
    names, system = drawn(Dialect.ROS2)
    system = system.with_stream(system.stream_on(names.charge), lag_s=500.0)
    async with play(system) as url, open_client(RobotAddress(url=url)) as client:
        heard = client.subscribe(names.charge)
        _, stamp_s = read_header(await heard.wait_for_more_than(0, timeout_s=PATIENCE_S))
        now_s = await client.fetch_time_s()
        assert now_s is not None
        assert 500.0 <= now_s - stamp_s < 500.0 + PATIENCE_S


async def test_transforms_that_are_told_together_come_together() -> None:
    names, system = drawn(Dialect.ROS2)
    stream = system.stream_to(names.laser_frame)
    async with play(system) as url, open_client(RobotAddress(url=url)) as client:
        heard = client.subscribe("/tf_static")
        told = read_transforms(await heard.wait_for_more_than(0, timeout_s=PATIENCE_S))
        assert [each.child for each in told] == [each.child for each in stream.transforms]


def test_a_node_that_is_gone_does_nothing_any_more() -> None:
    names, system = drawn(Dialect.ROS2)
    gone = system.without_node(names.sonar)
    assert names.sonar not in gone.nodes
    assert gone.publishers_of(names.range) == ()
    assert gone.subscribers_of(names.range) == (names.watcher,)


@pytest.mark.parametrize("seed", range(20))
def test_in_good_order_somebody_hears_every_topic_and_somebody_publishes_it(seed: int) -> None:
    _, system = drawn(Dialect.ROS1, seed)
    assert all(system.subscribers_of(topic) for topic in system.topics)
    assert all(system.publishers_of(topic) for topic in system.topics)
    assert len({*system.topics}) == len(system.topics)


def test_another_seed_draws_another_system() -> None:
    assert drawn(Dialect.ROS2, 1)[0] != drawn(Dialect.ROS2, 2)[0]
    assert drawn(Dialect.ROS2, 3)[0] == drawn(Dialect.ROS2, 3)[0]
