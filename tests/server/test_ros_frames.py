"""The tree of frames as a model reads it, with what is wrong with it."""

import math
import re
from pathlib import Path

import pytest

from mapspeak.geometry import Pose
from mapspeak.ros.listening import FrameLink
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.messages.poses import FrameTransform, write_transforms
from mapspeak.server.text.ros.frames import say_frames
from rosbridge_robot import ScriptedRobot
from rosserved import at_time, on_script, publishing

pytestmark = pytest.mark.anyio
STOPPED = " - STOPPED: the last came 3.0 s ago"


def link(parent: str, child: str, *, n: int = 30, lag_s: float = 0.0, is_static: bool = False,
         silent_s: float = 0.0) -> FrameLink:  # fmt: skip
    return FrameLink(
        parent=parent,
        child=child,
        is_static=is_static,
        stamp_s=100.0 - lag_s,
        first_s=50.0 - silent_s - (n - 1) * 0.1,
        last_s=50.0 - silent_s,
        n=n,
    )


def tree(*links: FrameLink) -> list[str]:
    return say_frames(links, now_s=100.0, heard_s=50.0).splitlines()


def test_frames_are_a_tree_with_rates_and_ages() -> None:
    assert tree(
        link("base", "laser", is_static=True),
        link("odom", "base", lag_s=0.05),
        link("map", "odom", lag_s=20.0),
        link("base", "arm", lag_s=3.0, silent_s=3.0),
    ) == [
        "5 frames, 4 transforms:",
        "map > odom: 10.0 Hz, stamp 20.00 s behind robot time - LATE",
        "  odom > base: 10.0 Hz, stamp 0.05 s behind robot time",
        f"    base > arm: 10.0 Hz, stamp 3.00 s behind robot time{STOPPED}",
        "    base > laser: static",
    ]


def test_two_parents_a_loop_and_a_gap_are_named() -> None:
    lines = tree(
        link("map", "odom"),
        link("base", "laser", is_static=True),
        link("body", "laser"),
        link("a", "b"),
        link("b", "c"),
        link("c", "a"),
        link("map", "odom", is_static=True),
    )
    assert (
        "NOT CONNECTED: 3 trees, from base, body, map: nothing leads from one to another" in lines
    )
    assert "TWO PARENTS: laser hangs on base and on body" in lines
    assert "TWICE: map > odom comes as static and as moving" in lines
    assert [each for each in lines if each.startswith("LOOP")] == ["LOOP: a > b > c > a"]
    assert sum(" > " in each for each in lines if ": " in each and each[0].islower()) == 7


def test_a_frame_that_is_its_own_parent_is_a_loop() -> None:
    assert "LOOP: base > base" in tree(link("base", "base"))


async def test_frames_are_heard_on_both_topics_with_who_sends_them(tmp_path: Path) -> None:
    scripted = ScriptedRobot()
    part = FrameTransform(
        parent_from_child=Pose(0.1, 0.0), parent="base_footprint", child="laser", stamp_s=1.0
    )
    scripted.latched["/tf_static"] = write_transforms([part], dialect=Dialect.ROS2)
    senders = {"/tf": ["/slam", "/base"], "/tf_static": ["/robot_state_publisher"]}
    scripted.services["/rosapi/publishers"] = lambda call: {
        "publishers": senders[call["args"]["topic"]]
    }
    moving = scripted.transforms(Pose(1.0, 2.0))
    async with at_time(scripted, tmp_path, 8.1) as (client, caller):
        # The server itself listens already: what is kept for latecomers has to come once more.
        for topic in senders:
            client.subscribe(topic)
        await scripted.until(lambda: len(scripted.server.asked("subscribe")) == len(senders))
        async with publishing(scripted, "/tf", moving):
            text = await caller.ask("ros_frames", duration_s=0.4)
    assert "/tf published by: /base, /slam (which of them sends which is not told)" in text
    assert "/tf_static published by: /robot_state_publisher\n" in text
    assert re.search(r"^map > odom: [\d.]+ Hz, stamp 1\.10 s behind", text, re.MULTILINE)
    assert re.search(r"^  odom > base_footprint: [\d.]+ Hz, stamp 0\.10 s", text, re.MULTILINE)
    assert "\n    base_footprint > laser: static" in text


async def test_frames_of_a_robot_without_any_are_refused_with_the_topics_there_are(
    tmp_path: Path,
) -> None:
    async with on_script(ScriptedRobot(), tmp_path) as caller:
        text = await caller.refuse("ros_frames", topic="/robot1/tf")
    assert "/tf" in text


async def test_the_transform_between_two_frames_is_told_with_the_way_between_them(
    tmp_path: Path,
) -> None:
    scripted = ScriptedRobot()
    turn = math.sqrt(0.5)  # A quarter turn about x: the laser's y looks up.
    laser = FrameTransform(
        parent_from_child=Pose(0.1, 0.0), parent="base_footprint", child="laser", stamp_s=1.0,
        height_m=0.3, rotation=(turn, 0.0, 0.0, turn),
    )  # fmt: skip
    camera = FrameTransform(
        parent_from_child=Pose(0.3, 0.0, math.pi / 2), parent="base_footprint", child="camera",
        stamp_s=1.0, height_m=0.5,
    )  # fmt: skip
    scripted.latched["/tf_static"] = write_transforms([laser, camera], dialect=Dialect.ROS2)
    async with on_script(scripted, tmp_path) as caller:
        text = await caller.ask("ros_frames", duration_s=0.4, frame="camera", in_frame="laser")
        mounted = await caller.ask(
            "ros_frames", duration_s=0.4, frame="laser", in_frame="base_footprint"
        )
        gap = await caller.refuse("ros_frames", duration_s=0.2, frame="arm", in_frame="laser")
    assert text == (
        "camera in laser: x 0.200, y 0.200, z 0.000 m; roll -90.0, pitch 90.0, yaw 0.0 deg\n"
        "way: laser > base_footprint > camera\noldest: all of it is static"
    )
    assert "x 0.100, y 0.000, z 0.300 m; roll 90.0, pitch 0.0, yaw 0.0 deg" in mounted
    assert "no frame 'arm'" in gap


@pytest.mark.parametrize("ros", [1, 2])
async def test_a_transform_is_told_with_the_age_of_its_oldest_part(
    tmp_path: Path, ros: int
) -> None:
    scripted = ScriptedRobot(ros=ros)
    moving = scripted.transforms(Pose(1.0, 2.0))
    async with (
        at_time(scripted, tmp_path, 21.0) as (_, caller),
        publishing(scripted, "/tf", moving),
    ):
        whole = await caller.ask("ros_frames", duration_s=0.4, frame="base_footprint")
        part = await caller.ask(
            "ros_frames", duration_s=0.4, frame="odom", in_frame="base_footprint"
        )
    aged = r"oldest: map > odom: [\d.]+ Hz, stamp 14\.00 s behind robot time - LATE"
    assert re.fullmatch(aged, whole.splitlines()[-1])
    assert "way: base_footprint > odom\noldest: odom > base_footprint: " in part
    assert part.endswith("stamp 13.00 s behind robot time - LATE")
