"""Planned path, footprint and costmaps of a robot's own navigation, on both ROS."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mapspeak.geometry import Point, Pose
from mapspeak.robot import NavigationLook, NavigationPart
from mapspeak.ros.link import Patience
from mapspeak.ros.messages.fields import Dialect, write_header
from mapspeak.ros.messages.grids import write_grid
from mapspeak.ros.messages.poses import FrameTransform, write_pose, write_transforms
from mapspeak.ros.robot.plans import find_navigation_topics
from mapspeak.spatial import OccupancyGrid
from rosbridge_robot import ScriptedRobot, connect_scripted, eventually

pytestmark = pytest.mark.anyio

QUICK = Patience(first_pause_s=0.001, longest_pause_s=0.01, linger_s=0.0, goodbye_s=1.0)
PATIENCE = replace(QUICK, settling_s=0.0)
STAMP_S = 98.0
"""Two seconds before the scripted robot's time."""
NAMES = {
    1: ("/move_base/NavfnROS/plan", "/move_base/local_costmap/footprint", "/move_base"),
    2: ("/plan", "/local_costmap/published_footprint", ""),
}
both = pytest.mark.parametrize("ros", [1, 2])


def costs(*, origin: Pose) -> OccupancyGrid:
    """A costmap of 2 x 2 m with a lethal block of 0.5 x 0.5 m in its middle."""
    cells = np.zeros((40, 40), dtype=np.int8)
    cells[12:28, 12:28] = 60
    cells[15:25, 15:25] = 99
    return OccupancyGrid(cells=cells, resolution_m=0.05, origin=origin, stamp_s=STAMP_S)


def with_navigation(ros: int) -> ScriptedRobot:
    scripted = ScriptedRobot(ros=ros)
    plan, footprint, node = NAMES[ros]
    offer = scripted.dialect
    path = [{"header": head("map", offer), "pose": write_pose(Pose(x, 2.0))} for x in (1.0, 2, 4)]
    corners = [{"x": x, "y": y, "z": 0.0} for x, y in ((0.2, 0.1), (-0.2, 0.1), (-0.2, -0.1))]
    costmap = {**write_grid(costs(origin=Pose(-1.0, -1.0)), dialect=offer)}
    told: dict[str, tuple[str, Mapping[str, Any]]] = {
        plan: ("nav_msgs/Path", {"header": head("map", offer), "poses": path}),
        footprint: (
            "geometry_msgs/PolygonStamped",
            {"header": head("odom", offer), "polygon": {"points": corners}},
        ),
        f"{node}/local_costmap/costmap": (
            "nav_msgs/OccupancyGrid",
            {**costmap, "header": head("odom", offer), "data": costmap["data"].tolist()},
        ),
    }
    for topic, (kind, message) in told.items():
        scripted.topics[topic] = offer.type_name(kind)
        scripted.latched[topic] = message
    place(scripted, map_from_odom=Pose(10.0, 0.0))
    return scripted


def head(frame: str, dialect: Dialect) -> dict[str, Any]:
    return write_header(frame, STAMP_S, dialect=dialect)


def place(scripted: ScriptedRobot, *, map_from_odom: Pose | None) -> None:
    frames = [("map", "odom", map_from_odom), ("odom", "base_link", Pose(0.0, 0.0))]
    told = [
        FrameTransform(parent_from_child=pose, parent=parent, child=child, stamp_s=100.0)
        for parent, child, pose in frames
        if pose is not None
    ]
    scripted.latched["/tf"] = write_transforms(told, dialect=scripted.dialect)


async def looks_of(scripted: ScriptedRobot) -> dict[NavigationPart, NavigationLook]:
    async with connect_scripted(scripted, patience=PATIENCE) as robot:
        return {each.part: each for each in await robot.fetch_navigation()}


@both
async def test_path_footprint_and_costmap_are_told_in_the_map_with_their_age(ros: int) -> None:
    looks = await looks_of(with_navigation(ros))
    assert set(looks) == {*NavigationPart} - {NavigationPart.GLOBAL_COSTMAP}
    plan, footprint = looks[NavigationPart.PLAN], looks[NavigationPart.FOOTPRINT]
    assert plan.lines == ((Point(1.0, 2.0), Point(2.0, 2.0), Point(4.0, 2.0)),)
    (ring,) = footprint.lines
    assert ring[0] == ring[-1]
    assert [ring[0].x, ring[0].y] == pytest.approx([10.2, 0.1])
    (around,) = looks[NavigationPart.LOCAL_COSTMAP].lines
    xs = [point.x for point in around]
    # Through the middles of the outermost cells: 0.45 m across the block of half a metre.
    assert [min(xs), max(xs)] == pytest.approx([9.775, 10.225])
    assert all(1.0 < (each.age_s or 0.0) < 60.0 for each in looks.values())


@both
async def test_a_frame_that_is_not_joined_to_the_map_is_named_and_nothing_is_drawn(
    ros: int,
) -> None:
    scripted = with_navigation(ros)
    place(scripted, map_from_odom=None)
    looks = await looks_of(scripted)
    assert looks[NavigationPart.FOOTPRINT].unplaced_frame == "odom"
    assert looks[NavigationPart.FOOTPRINT].lines == ()
    assert looks[NavigationPart.PLAN].lines


@both
async def test_a_navigation_that_publishes_none_of_it_is_told_as_such(ros: int) -> None:
    assert await looks_of(ScriptedRobot(ros=ros)) == {}


async def test_what_has_not_been_published_or_is_no_message_of_the_kind_has_no_age() -> None:
    scripted = with_navigation(2)
    del scripted.latched["/plan"]
    scripted.latched["/local_costmap/costmap"] = {"header": {}, "data": "x"}
    looks = await looks_of(scripted)
    assert looks[NavigationPart.PLAN].age_s is None
    assert looks[NavigationPart.LOCAL_COSTMAP].age_s is None


async def test_a_costmap_is_kept_up_to_date_by_its_updates() -> None:
    scripted = with_navigation(2)
    update = "/local_costmap/costmap_updates"
    scripted.topics[update] = "map_msgs/msg/OccupancyGridUpdate"
    async with connect_scripted(scripted, patience=PATIENCE) as robot:
        assert (await robot.fetch_navigation())[-1].lines
        cleared = {"x": 0, "y": 0, "width": 40, "height": 40, "data": [0] * 1600}
        await scripted.publish(update, {"header": head("odom", scripted.dialect), **cleared})

        async def is_clear() -> bool:
            looks = {each.part: each for each in await robot.fetch_navigation()}
            return looks[NavigationPart.LOCAL_COSTMAP].lines == ()

        await eventually(is_clear)


def test_of_several_robots_the_topics_of_the_chosen_one_are_taken() -> None:
    types = {"/ada/plan": "nav_msgs/Path", "/ben/plan": "nav_msgs/Path", "/plan": "x/Other"}
    assert find_navigation_topics(types, namespace="/ben") == {NavigationPart.PLAN: "/ben/plan"}
    assert find_navigation_topics({}, namespace="") == {}


@both
async def test_no_whole_costmap_is_left_out_since_the_next_may_be_a_part(ros: int) -> None:
    scripted = with_navigation(ros)
    await looks_of(scripted)
    topic = f"{NAMES[ros][2]}/local_costmap/costmap"
    asked = [each for each in scripted.server.asked("subscribe") if each["topic"] == topic]
    assert [each.get("throttle_rate") for each in asked] == [None]
