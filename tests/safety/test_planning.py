"""Goals of actions that hold poses are held to the map as the goals of drives are."""

import math
from pathlib import Path
from typing import Any

import pytest

from drawing import grid_from_text
from fakes import FakeRobot
from guarding import audit_of, make_guard, rectangle
from mapspeak.errors import GoalError, LinkError, PolicyError
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMapStore
from mapspeak.ros.port import RosConnection
from mapspeak.safety import AreaRule, Policy
from mapspeak.safety.planning import NO_FRAME, find_poses
from mapspeak.session import Session
from mapspeak.spatial import OccupancyGrid

pytestmark = pytest.mark.anyio

HALL = grid_from_text("\n".join("." * 120 for _ in range(80)), resolution_m=0.1)
START = Pose(2.0, 4.0)
PIT = rectangle("pit", (5.0, 3.0), (7.0, 5.0))
TYPE = "demo_msgs/action/Inspect"


def stamped(x: float, y: float, frame: str | None = "map") -> dict[str, Any]:
    pose = {"position": {"x": x, "y": y, "z": 0.0}, "orientation": {"w": 1.0}}
    return {"header": {} if frame is None else {"frame_id": frame}, "pose": pose}


class Actions:
    """The connection by which goals reach that robot."""

    def __init__(self) -> None:
        self.goals: list[Any] = []

    async def fetch_action_type(self, action: str) -> str:
        raise LinkError(f"Nothing tells the type of {action}.", hint="Give it.")

    async def send_goal(self, action: str, arguments: Any, *, type_name: str) -> None:  # noqa: ANN401
        assert action
        assert type_name
        self.goals.append(arguments)


class Site:
    """A guarded session over a robot in a hall."""

    def __init__(self, folder: Path, *areas: AreaRule, policy: Policy | None = None) -> None:
        self.actions = Actions()
        self.robot = FakeRobot(HALL, pose=START)
        self.session = session = Session(
            self.robot,
            SemanticMapStore(folder / "m.yaml"),
            lease_s=60.0,
            guard=make_guard(folder, policy or Policy(areas=areas)),
            ros=self.actions,  # type: ignore[arg-type]
        )
        assert session.ros is not None
        self.ros: RosConnection = session.ros

    async def send(self, goal: dict[str, Any]) -> None:
        await self.ros.send_goal("/inspect", goal, type_name=TYPE)


@pytest.mark.parametrize(
    "goal",
    [
        {"pose": stamped(6.0, 4.0)},
        {"pose": stamped(6.0, 4.0, "/map")},
        {"stops": [stamped(3.0, 4.0), stamped(6.0, 4.0)]},
        {"pose": {"position": {"x": 6.0, "y": 4.0}}},
        {"place": {"x": 6.0, "y": 4.0, "theta": 1.0}},
        {"spot": {"header": {"frame_id": "map"}, "point": {"x": 6.0, "y": 4.0, "z": 1.0}}},
        {"deep": [{"deeper": {"pose": stamped(5.1, 4.9)}}]},
    ],
)
async def test_a_goal_with_a_pose_in_a_closed_area_is_refused_by_its_name(
    tmp_path: Path, goal: dict[str, Any]
) -> None:
    site = Site(tmp_path, PIT)
    with pytest.raises(GoalError, match="the keep-out area 'pit'"):
        await site.send(goal)
    assert site.actions.goals == []
    assert audit_of(tmp_path)[-1].verdict == "refused"


async def test_a_goal_whose_poses_are_all_open_is_sent(tmp_path: Path) -> None:
    site = Site(tmp_path, PIT)
    goal = {"stops": [stamped(3.0, 4.0), stamped(9.0, 4.0)]}
    await site.send(goal)
    assert site.actions.goals == [goal]


async def test_a_goal_without_poses_asks_for_no_map(tmp_path: Path) -> None:
    site = Site(tmp_path, PIT)
    site.robot.grid = None
    await site.send({"times": 3})
    assert site.actions.goals == [{"times": 3}]


@pytest.mark.parametrize("frame", ["odom", "base_link", None, ""])
async def test_a_pose_in_a_frame_that_is_not_the_maps_is_refused_while_areas_exist(
    tmp_path: Path, frame: str | None
) -> None:
    site = Site(tmp_path, PIT)
    with pytest.raises(PolicyError, match="cannot be known"):
        await site.send({"pose": stamped(1.0, 0.0, frame)})
    open_site = Site(tmp_path)
    await open_site.send({"pose": stamped(1.0, 0.0, frame)})
    assert (len(site.actions.goals), len(open_site.actions.goals)) == (0, 1)


async def test_a_place_on_the_globe_is_refused_while_areas_exist(tmp_path: Path) -> None:
    globe = {"position": {"latitude": 52.0, "longitude": 13.0, "altitude": 40.0}}
    with pytest.raises(PolicyError, match="cannot be known"):
        await Site(tmp_path, PIT).send({"gps_poses": [globe]})


@pytest.mark.parametrize(
    ("pose", "says"),
    [
        (stamped(50.0, 4.0), "off the map|outside"),
        (stamped(math.inf, 4.0), "cannot be known"),
        ({"position": {"x": "6"}}, "cannot be known"),
    ],
)
async def test_a_pose_that_is_no_place_on_the_map_is_refused(
    tmp_path: Path, pose: dict[str, Any], says: str
) -> None:
    with pytest.raises((GoalError, PolicyError), match=says):
        await Site(tmp_path, PIT).send({"pose": pose})


async def test_a_pose_that_is_too_far_is_refused_as_a_drive_is(tmp_path: Path) -> None:
    with pytest.raises(GoalError, match=r"the policy allows 2\.0 m"):
        await Site(tmp_path, policy=Policy(farthest_m=2.0)).send({"pose": stamped(9.0, 4.0)})


async def test_a_message_with_more_poses_than_are_checked_is_refused(tmp_path: Path) -> None:
    with pytest.raises(GoalError, match="at most"):
        await Site(tmp_path).send({"poses": [stamped(3.0, 4.0)] * 201})


def test_poses_are_found_with_their_frames_and_headings() -> None:
    quarter = {"z": math.sin(math.pi / 4), "w": math.cos(math.pi / 4)}
    message = {
        "header": {"frame_id": "odom"},
        "poses": [{"position": {"x": 1.0}, "orientation": quarter}, stamped(2.0, 3.0)],
        "speed": {"x": 1.0, "y": 2.0},
    }
    (odom, first), (own, second) = find_poses(message)
    assert (odom, own) == ("odom", "map")
    assert (first.x, first.y) == (1.0, 0.0)
    assert first.yaw_rad == pytest.approx(math.pi / 2)
    assert second == Pose(2.0, 3.0)


def test_a_message_that_is_nested_too_deep_counts_as_one_with_a_strange_pose() -> None:
    message: dict[str, Any] = {"pose": stamped(6.0, 4.0)}
    for _ in range(50):
        message = {"inner": message}
    assert [frame for frame, _ in find_poses(message)] == [NO_FRAME]


async def test_a_drive_is_checked_on_the_map_that_was_surveyed_to_find_its_goal(
    tmp_path: Path,
) -> None:
    site = Site(tmp_path, PIT, policy=Policy(areas=(PIT,), clearance_m=0.1))
    goal = await site.session.find_goal(place=None, x=9.0, y=2.0, yaw_deg=0.0)
    surveyed = (await site.session.fetch_world_model()).map

    await site.session.robot.send_goal(goal.pose)

    assert (await site.session.fetch_world_model()).map is surveyed


@pytest.mark.parametrize(
    ("turn", "yaw_rad"),
    [
        ({"z": math.sin(1.0), "w": math.cos(1.0)}, 2.0),
        ({"x": math.sin(0.2), "w": math.cos(0.2)}, 0.0),
        ({"y": math.sin(0.2), "w": math.cos(0.2)}, 0.0),
        ({"x": 1.0, "w": 0.0}, 0.0),
        ({"y": 1.0, "w": 0.0}, math.pi),
    ],
)
def test_of_a_turn_in_space_the_heading_is_read(turn: dict[str, float], yaw_rad: float) -> None:
    ((_, pose),) = find_poses({"position": {"x": 1.0}, "orientation": turn})
    assert math.cos(pose.yaw_rad - yaw_rad) == pytest.approx(1.0)


async def test_a_turn_where_the_robot_stands_is_allowed_though_the_map_shows_no_room(
    tmp_path: Path,
) -> None:
    site = Site(tmp_path)
    site.robot.grid = grid_from_text("###\n#.#\n###", resolution_m=0.3)
    site.robot.pose = Pose(0.45, 0.45)
    await site.send({"place": {"x": 0.47, "y": 0.45, "theta": 1.0}})
    with pytest.raises(GoalError):
        await site.send({"place": {"x": 0.75, "y": 0.45, "theta": 1.0}})
    assert len(site.actions.goals) == 1


@pytest.mark.parametrize(("clearance_m", "is_open"), [(0.0, True), (0.15, False)])
async def test_a_goal_of_an_action_leaves_the_clearance_of_the_policy(
    tmp_path: Path, clearance_m: float, *, is_open: bool
) -> None:
    site = Site(tmp_path, policy=Policy(clearance_m=clearance_m))
    cells = HALL.cells.copy()
    cells[:, 60], cells[38:43, 60] = 100, 0
    site.robot.grid = OccupancyGrid(cells=cells, resolution_m=0.1, origin=HALL.origin)
    if is_open:
        await site.send({"pose": stamped(9.0, 4.0)})
    else:
        with pytest.raises(GoalError):
            await site.send({"pose": stamped(9.0, 4.0)})
