"""Messages of the wrong kind here and there: the rest of them is told all the same."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mapspeak.ros.messages.fields import Dialect, write_header
from rosbridge_robot import ScriptedRobot
from rosserved import on_script

pytestmark = pytest.mark.anyio
SCAN = {
    "header": write_header("laser", 1.0, dialect=Dialect.ROS2),
    "angle_min": 0.0, "angle_increment": 0.1, "range_min": 0.1, "range_max": 10.0,
    "ranges": [3.0, 2.5, 4.0],
}  # fmt: skip


async def read(folder: Path, type_name: str, message: dict[str, Any]) -> str:
    scripted = ScriptedRobot()
    scripted.topics["/seen"] = type_name
    scripted.latched["/seen"] = message
    async with on_script(scripted, folder) as caller:
        return await caller.ask("ros_read", topic="/seen")


@pytest.mark.parametrize(
    ("wrong", "fault", "rest"),
    [
        ({"angle_min": None}, "field 'angle_min' is None", "Nearest: 2.50 m, beam 1."),
        ({"range_max": "far"}, "field 'range_max' is 'far'", "Nearest: 2.50 m at +6 deg."),
        ({"header": 7}, "field 'header' is 7", "3 beams, 3 met something"),
        ({"ranges": [3.0, "x", True]}, "field 'ranges[1]' is 'x'", "Nearest: 3.00 m at +0 deg."),
    ],
)
async def test_a_scan_with_one_wrong_field_is_told_without_it(
    tmp_path: Path, wrong: dict[str, Any], fault: str, rest: str
) -> None:
    text = await read(tmp_path, "sensor_msgs/msg/LaserScan", {**SCAN, **wrong})
    assert fault in text
    assert rest in text


async def test_beams_of_a_ros1_laser_that_end_at_its_range_met_nothing(tmp_path: Path) -> None:
    scripted = ScriptedRobot(ros=1)
    scripted.topics["/base_scan"] = "sensor_msgs/LaserScan"
    header = write_header("laser", 1.0, dialect=Dialect.ROS1)
    scripted.latched["/base_scan"] = {**SCAN, "header": header, "ranges": [10.0, 10.0, 4.0]}
    async with on_script(scripted, tmp_path) as caller:
        text = await caller.ask("ros_read", topic="/base_scan")
    assert "3 beams, 1 met something" in text
    assert "Nearest: 4.00 m" in text


async def test_a_path_without_a_frame_is_said_to_have_none(tmp_path: Path) -> None:
    message = {"header": write_header("", 1.0, dialect=Dialect.ROS2), "poses": []}
    text = await read(tmp_path, "nav_msgs/msg/Path", message)
    assert "Path without a frame: no poses." in text


@pytest.mark.parametrize(("encoding", "kind"), [("rgb8", "u1"), ("16UC1", "<u2")])
async def test_only_of_depth_it_is_said_that_depth_is_shaded(
    tmp_path: Path, encoding: str, kind: str
) -> None:
    samples = 3 if encoding == "rgb8" else 1
    pixels = np.full((2, 2, samples), 9, dtype=kind)
    message = {
        "header": write_header("camera", 1.0, dialect=Dialect.ROS2),
        "height": 2, "width": 2, "encoding": encoding, "is_bigendian": 0,
        "step": 2 * samples * pixels.itemsize, "data": list(pixels.tobytes()),
    }  # fmt: skip
    text = await read(tmp_path, "sensor_msgs/msg/Image", message)
    assert ("Depth is shaded" in text) is (encoding == "16UC1")
