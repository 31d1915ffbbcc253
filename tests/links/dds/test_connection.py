"""A connection over DDS to a node in this process, on this machine's own network alone."""

from collections.abc import Callable
from typing import Any

import anyio
import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="has no wheel for this Python")

from dds_node import (
    BEST_EFFORT,
    LATCHED,
    SET_BOOL,
    DdsNode,
    answer_set_bool,
    open_both,
    open_dds_node,
    open_here,
    some_network,
    until,
)
from mapspeak.errors import LinkError
from mapspeak.links.dds import DdsNetwork, open_dds_connection
from mapspeak.links.dds.types import Types
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.messages.grids import read_grid
from mapspeak.ros.messages.markers import Marker, MarkShape, write_markers

pytestmark = pytest.mark.anyio

GRID = {
    "header": {"frame_id": "map"},
    "info": {"width": 3, "height": 2, "resolution": 0.05},
    "data": [0, 0, 100, -1, 0, 0],
}


LATER = {"name": "more", "type": {"type_id": 17}}


def types_with(name: str, *texts: str) -> Types:
    """Gives the types of a node that knows one whose fields are all texts."""
    kind = {"type_id": 17, "capacity": 0, "nested_type_name": ""}
    described = {"type_name": name, "fields": [{"name": each, "type": kind} for each in texts]}
    description = {"type_description": described, "referenced_type_descriptions": []}
    types = Types()
    types.take_description({"successful": True, "type_description": description})
    return types


async def test_a_map_sent_before_we_came_is_received() -> None:
    def prepare(node: DdsNode) -> None:
        node.advertise("/map", "nav_msgs/msg/OccupancyGrid", quality=LATCHED)
        node.publish("/map", GRID)

    async with open_both(prepare) as (_, connection):
        maps = connection.subscribe("/map")
        grid = read_grid(await maps.wait_for_more_than(0, timeout_s=5.0))
    assert grid.cells.tolist() == [[0, 0, 100], [-1, 0, 0]]
    assert grid.resolution_m == 0.05


async def test_a_topic_is_read_whether_its_writer_came_before_or_after_us() -> None:
    async with open_both() as (node, connection):
        texts = connection.subscribe("/said", type_name="std_msgs/msg/String")
        node.advertise("/said", "std_msgs/msg/String", quality=LATCHED)
        node.publish("/said", {"data": "hello"})
        assert await texts.wait_for_more_than(0, timeout_s=5.0) == {"data": "hello"}


async def test_the_quality_of_a_topics_ends_is_told() -> None:
    def prepare(node: DdsNode) -> None:
        node.advertise("/scan", "sensor_msgs/msg/LaserScan", quality=BEST_EFFORT)
        node.listen("/scan", "sensor_msgs/msg/LaserScan")

    async with open_both(prepare) as (_, connection):
        connection.subscribe("/scan")
        await until(lambda: connection.find_quality("/scan").subscribers)
        quality = connection.find_quality("/scan")
    assert [each.is_reliable for each in quality.publishers] == [False]
    assert [(each.is_reliable, each.is_latched) for each in quality.subscribers] == [(True, False)]


async def test_a_writer_that_does_not_repeat_itself_is_heard() -> None:
    async with open_both() as (node, connection):
        node.advertise("/scan", "sensor_msgs/msg/LaserScan", quality=BEST_EFFORT)
        scans = connection.subscribe("/scan")
        while scans.n_received == 0:
            node.publish("/scan", {"ranges": [1.0, 2.0]})
            with anyio.move_on_after(0.05):
                await scans.wait_for_more_than(0, timeout_s=5.0)
    assert scans.latest is not None
    assert isinstance(scans.latest["ranges"], np.ndarray)


async def test_asking_anew_brings_what_is_latched_once_more() -> None:
    async with open_both() as (node, connection):
        node.advertise("/map", "nav_msgs/msg/OccupancyGrid", quality=LATCHED)
        node.publish("/map", GRID)
        maps = connection.subscribe("/map")
        await maps.wait_for_more_than(0, timeout_s=5.0)
        connection.renew(maps)
        await maps.wait_for_more_than(1, timeout_s=5.0)


async def test_after_the_last_unsubscription_nothing_is_heard() -> None:
    async with open_both() as (node, connection):
        node.advertise("/said", "std_msgs/msg/String", quality=LATCHED)
        first, second = connection.subscribe("/said"), connection.subscribe("/said")
        connection.unsubscribe(first)
        node.publish("/said", {"data": "one"})
        await second.wait_for_more_than(0, timeout_s=5.0)
        connection.unsubscribe(second)
        node.publish("/said", {"data": "two"})
        with pytest.raises(LinkError):
            await second.wait_for_more_than(1, timeout_s=0.1)


async def test_the_first_message_we_publish_arrives() -> None:
    async with open_both(lambda node: node.listen("/cmd_vel", "geometry_msgs/msg/Twist")) as (
        node,
        connection,
    ):
        connection.advertise("/cmd_vel", type_name="geometry_msgs/msg/Twist")
        await connection.publish("/cmd_vel", {"linear": {"x": 0.5}})
        await until(lambda: node.heard["/cmd_vel"])
    assert node.heard["/cmd_vel"][0]["linear"]["x"] == 0.5


async def test_what_was_published_last_arrives_though_we_leave_at_once() -> None:
    network = some_network()
    async with open_dds_node(network) as node:
        node.listen("/cmd_vel", "geometry_msgs/msg/Twist")
        async with open_here(network) as connection:
            connection.advertise("/cmd_vel", type_name="geometry_msgs/msg/Twist")
            await connection.publish("/cmd_vel", {"angular": {"z": 1.0}})
        await until(lambda: node.heard["/cmd_vel"])


async def test_nan_is_not_published() -> None:
    async with open_both() as (_, connection):
        connection.advertise("/cmd_vel", type_name="geometry_msgs/msg/Twist")
        with pytest.raises(LinkError, match=r"linear\.x"):
            await connection.publish("/cmd_vel", {"linear": {"x": float("nan")}})


async def test_the_graph_tells_topics_nodes_and_services() -> None:
    def prepare(node: DdsNode) -> None:
        node.advertise("/map", "nav_msgs/msg/OccupancyGrid", quality=LATCHED)
        node.listen("/cmd_vel", "geometry_msgs/msg/Twist")
        node.serve("/switch", SET_BOOL, answer_set_bool)

    async with open_both(prepare) as (_, connection):
        await until(lambda: "/robot" in connection.discovery.nodes)
        graph = await connection.fetch_graph()
        node = await connection.fetch_node("/robot")
        assert await connection.fetch_nodes() == ("/robot",)
        assert await connection.fetch_publishers("/map") == ("/robot",)
        assert await connection.fetch_subscribers("/cmd_vel") == ("/robot",)
        assert await connection.fetch_services() == ("/switch",)
        assert await connection.fetch_service_type("/switch") == "std_srvs/SetBool"
    assert graph.types == {
        "/map": "nav_msgs/OccupancyGrid",
        "/cmd_vel": "geometry_msgs/Twist",
    }
    assert (node.publishes, node.subscribes, node.serves) == (
        ("/map",),
        ("/cmd_vel",),
        ("/switch",),
    )


async def test_what_we_do_ourselves_is_not_in_the_graph() -> None:
    async with open_both() as (_, connection):
        connection.advertise("/cmd_vel", type_name="geometry_msgs/msg/Twist")
        assert (await connection.fetch_graph()).types == {}


async def test_what_is_not_there_is_an_error() -> None:
    async with open_both() as (_, connection):
        for ask in (
            connection.fetch_node,
            connection.fetch_service_type,
            connection.fetch_action_type,
        ):
            with pytest.raises(LinkError, match="/nobody"):
                await ask("/nobody")


async def test_the_definitions_of_a_service_are_those_of_its_parts_and_what_is_within() -> None:
    async with open_both() as (_, connection):
        texts = await connection.fetch_definitions("nav_msgs/srv/GetMap")
    assert list(texts)[:2] == ["nav_msgs/GetMap_Request", "nav_msgs/GetMap_Response"]
    assert "nav_msgs/MapMetaData" in texts


async def test_another_type_than_the_robots_is_refused() -> None:
    async with open_both(lambda node: node.listen("/cmd_vel", "geometry_msgs/msg/Twist")) as (
        _,
        connection,
    ):
        with pytest.raises(LinkError, match="is a geometry_msgs/Twist"):
            connection.advertise("/cmd_vel", type_name="geometry_msgs/msg/TwistStamped")
        with pytest.raises(LinkError, match="is a geometry_msgs/Twist"):
            connection.subscribe("/cmd_vel", type_name="std_msgs/msg/String")
        with pytest.raises(LinkError, match="not the name of a ROS type"):
            connection.advertise("/said", type_name="string")


async def test_a_type_that_we_do_not_know_is_asked_of_its_node() -> None:
    name, type_hash = "my_msgs/msg/Secret", "RIHS01_0123abcd"
    asked = []

    def describe(request: dict[str, Any], reply: Callable[[dict[str, Any]], None]) -> None:
        asked.append((request["type_name"], request["type_hash"]))
        label = {"name": "label", "type": {"type_id": 17}}
        described = {"type_description": {"type_name": name, "fields": [label]}}
        reply({"successful": True, "type_description": described})

    def prepare(node: DdsNode) -> None:
        node.types = types_with(name, "label")
        service = "type_description_interfaces/srv/GetTypeDescription"
        node.serve("/robot/get_type_description", service, describe)
        node.publish_hashed("/secret", name, type_hash)

    async with open_both(prepare) as (node, connection):
        secrets = connection.subscribe("/secret")
        while secrets.n_received == 0:
            node.publish("/secret", {"label": "hush"})
            with anyio.move_on_after(0.05):
                await secrets.wait_for_more_than(0, timeout_s=5.0)
        assert await connection.fetch_definitions(name) == {"my_msgs/Secret": "string label"}
    assert secrets.latest == {"label": "hush"}
    assert asked == [(name, type_hash)]


async def test_a_type_that_its_node_did_not_tell_at_first_is_asked_for_again() -> None:
    name = "my_msgs/msg/Secret"
    answers: list[dict[str, Any]] = []
    label = {"name": "label", "type": {"type_id": 17}}
    described = {"type_description": {"type_name": name, "fields": [label]}}

    def describe(_: dict[str, Any], reply: Callable[[dict[str, Any]], None]) -> None:
        answers.append({"successful": bool(answers), "type_description": described})
        reply(answers[-1])

    def prepare(node: DdsNode) -> None:
        node.types = types_with(name, "label")
        service = "type_description_interfaces/srv/GetTypeDescription"
        node.serve("/robot/get_type_description", service, describe)
        node.publish_hashed("/secret", name, "RIHS01_0123abcd")

    async with open_both(prepare) as (node, connection):
        secrets = connection.subscribe("/secret")
        while secrets.n_received == 0:
            node.publish("/secret", {"label": "hush"})
            with anyio.move_on_after(0.05):
                await secrets.wait_for_more_than(0, timeout_s=5.0)
    assert [each["successful"] for each in answers] == [False, True]


async def test_a_type_that_we_know_in_another_version_is_asked_of_its_node() -> None:
    name, theirs = "std_msgs/msg/String", {"name": "text", "type": {"type_id": 17}}

    def describe(_request: dict[str, Any], reply: Callable[[dict[str, Any]], None]) -> None:
        described = {"type_description": {"type_name": name, "fields": [theirs, LATER]}}
        reply({"successful": True, "type_description": described})

    def prepare(node: DdsNode) -> None:
        node.types = types_with(name, "text", "more")
        service = "type_description_interfaces/srv/GetTypeDescription"
        node.serve("/robot/get_type_description", service, describe)
        node.publish_hashed("/said", name, "RIHS01_0123abcd")

    async with open_both(prepare) as (node, connection):
        said = connection.subscribe("/said")
        while said.n_received == 0:
            node.publish("/said", {"text": "hello", "more": "there"})
            with anyio.move_on_after(0.05):
                await said.wait_for_more_than(0, timeout_s=5.0)
    assert said.latest == {"text": "hello", "more": "there"}


async def test_a_robot_on_humble_is_known_by_its_longer_ids() -> None:
    name = "rmw_dds_common/LongParticipantEntitiesInfo"

    def prepare(node: DdsNode) -> None:
        info = {"node_namespace": "/", "node_name": "old"}
        gid = {"data": node.participant.key.ljust(24, b"\x00")}
        message = {"gid": gid, "node_entities_info_seq": [info]}
        node._introduction.write(node.types.encode(name, message))

    async with open_both(prepare) as (_, connection):
        await until(lambda: connection.discovery.nodes)
        assert await connection.fetch_nodes() == ("/old",)
        assert (await connection.fetch_graph()).distro == "humble"
        texts = await connection.fetch_definitions("nav2_msgs/action/NavigateToPose")
    assert texts["nav2_msgs/NavigateToPose_Result"] == "std_msgs/Empty result"


async def test_an_empty_domain_is_an_error_that_names_it() -> None:
    network = some_network()
    with pytest.raises(LinkError, match=f"domain {network.domain_id} "):
        async with open_dds_connection(network):
            pass


async def test_a_node_that_goes_is_noticed_and_one_that_comes_too() -> None:
    network = some_network()
    async with open_dds_node(network, name="/first") as node:
        node.advertise("/said", "std_msgs/msg/String")
        async with open_here(network) as connection:
            assert connection.is_open
            assert connection.connected_for_s is not None
            async with open_dds_node(network, name="/second") as second:
                second.advertise("/said", "std_msgs/msg/String")
                await until(lambda: len(connection.discovery.nodes) == 2)
            await until(lambda: len(connection.discovery.nodes) == 1)


async def test_closing_leaves_nothing_in_the_domain() -> None:
    network = some_network()
    async with open_dds_node(network) as node:
        node.advertise("/said", "std_msgs/msg/String")
        async with open_here(network) as watcher:
            async with open_here(network) as connection:
                connection.advertise("/heard", type_name="std_msgs/msg/String")
                connection.subscribe("/said")
                await until(lambda: "/heard" in watcher.discovery.topics)
            await until(lambda: "/heard" not in watcher.discovery.topics)


async def test_a_domain_can_be_left_and_entered_again() -> None:
    network: DdsNetwork = some_network()
    for _ in range(3):
        async with open_dds_node(network) as node:
            node.introduce()
            async with open_here(network) as connection:
                assert connection.is_open


async def test_markers_reach_who_subscribes_later() -> None:
    topic, kind = "/mapspeak/markers", "visualization_msgs/msg/MarkerArray"
    mark = Marker(
        group="rooms", shape=MarkShape.TEXT, size_m=0.2, colour=(1.0, 0.0, 0.0, 1.0), text="R1"
    )
    async with open_both() as (node, connection):
        connection.advertise(topic, type_name=kind, is_latched=True)
        message = write_markers([mark], frame_id="map", dialect=Dialect.ROS2)
        await connection.publish(topic, message)
        node.listen(topic, kind, quality=LATCHED)
        await until(lambda: node.heard[topic])
    erase, text = node.heard[topic][0]["markers"]
    assert erase["action"] == 3
    assert (text["ns"], text["text"], text["header"]["frame_id"]) == ("rooms", "R1", "map")
