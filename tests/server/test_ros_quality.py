"""How much comes on a topic, and in which quality of service, as far as a connection tells it."""

import re
from pathlib import Path

import pytest

from fakes import FakeRobot, two_rooms
from mapspeak.ros.messages.fields import Dialect, write_header
from rosbridge_robot import ScriptedRobot
from rosserved import on_script, publishing, served

pytestmark = pytest.mark.anyio
N_BYTES = {1: 1498, 2: 1494}
"""Of the scan below, by the version of ROS: a header of ROS 1 has a number more."""


def scan_of(ros: int) -> dict[str, object]:
    dialect = Dialect.ROS1 if ros == 1 else Dialect.ROS2
    return {
        "header": write_header("laser", 1.0, dialect=dialect),
        "angle_min": 0.0, "angle_increment": 0.1, "range_min": 0.1, "range_max": 9.0,
        "ranges": [2.0] * 360,
    }  # fmt: skip


@pytest.mark.parametrize("ros", [1, 2])
async def test_the_bandwidth_of_a_topic_is_told_with_its_rate(tmp_path: Path, ros: int) -> None:
    scripted = ScriptedRobot(ros=ros)
    scripted.topics["/scan"] = "sensor_msgs/LaserScan" if ros == 1 else "sensor_msgs/msg/LaserScan"
    async with (
        on_script(scripted, tmp_path) as caller,
        publishing(scripted, "/scan", scan_of(ros)),
    ):
        text = await caller.ask("ros_rates", topics=["/scan"], duration_s=0.4)
    told = re.search(r"/scan: ([\d.]+) Hz, [\d,]+ messages, about ([\d.]+) (k|M)B/s; stamp", text)
    assert told, text
    n_kb = float(told[2]) * (1000.0 if told[3] == "M" else 1.0)
    assert n_kb == pytest.approx(float(told[1]) * N_BYTES[ros] / 1000.0, rel=0.02)


@pytest.mark.parametrize("ros", [1, 2])
async def test_the_bandwidth_of_a_type_that_nobody_describes_is_called_unknown(
    tmp_path: Path, ros: int
) -> None:
    scripted = ScriptedRobot(ros=ros)
    scripted.topics["/odd"] = "no_msgs/Odd" if ros == 1 else "no_msgs/msg/Odd"
    async with (
        on_script(scripted, tmp_path) as caller,
        publishing(scripted, "/odd", {"data": 1}),
    ):
        text = await caller.ask("ros_rates", topics=["/odd"], duration_s=0.3)
    assert "bandwidth not known: the type is not described" in text


@pytest.mark.parametrize(
    ("ros", "said"), [(1, "QoS: ROS 1 has none"), (2, "QoS: not known: rosbridge does not tell it")]
)
async def test_over_rosbridge_the_quality_of_service_is_called_unknown(
    tmp_path: Path, ros: int, said: str
) -> None:
    scripted = ScriptedRobot(ros=ros)
    scripted.services["/rosapi/publishers"] = lambda _: {"publishers": []}
    scripted.services["/rosapi/subscribers"] = lambda _: {"subscribers": []}
    async with on_script(scripted, tmp_path) as caller:
        text = await caller.ask("ros_topic", topic="/map")
    assert said in text.splitlines()


async def test_over_dds_a_subscriber_that_wants_more_than_is_offered_is_told(
    tmp_path: Path,
) -> None:
    pytest.importorskip("cyclonedds", reason="has no wheel for this Python")
    from dds_node import BEST_EFFORT, LATCHED, DdsNode, open_both, until  # noqa: PLC0415

    kind = "std_msgs/msg/String"

    def prepare(node: DdsNode) -> None:
        node.advertise("/said", kind, quality=BEST_EFFORT)
        node.listen("/said", kind, quality=LATCHED)
        node.listen("/said", kind)

    async with (
        open_both(prepare) as (_, connection),
        served(FakeRobot(two_rooms()), connection, tmp_path) as caller,
    ):
        await until(lambda: len(connection.find_quality("/said").subscribers) == 2)
        text = await caller.ask("ros_topic", topic="/said")
    quality, *mismatches = text.splitlines()[3:6]
    assert quality == (
        "QoS: published best effort, volatile; "
        "heard reliable, transient local (1) and reliable, volatile (1)"
    )
    assert [each.partition(":")[0] for each in mismatches] == ["MISMATCH", "MISMATCH"]
