from pathlib import Path

import numpy as np
import pytest

from drawing import grid_from_text
from fakes import FakeRobot, two_rooms
from mapspeak.evaluation.agents.driver import read_map_text
from mapspeak.geometry import Pose
from mapspeak.spatial import OccupancyGrid
from served import connect, pictures_of, report_of, text_of

pytestmark = pytest.mark.anyio


def _filled(value: int, n_cells: int = 40) -> OccupancyGrid:
    return OccupancyGrid(cells=np.full((n_cells, n_cells), value, dtype=np.int8), resolution_m=0.25)


MOST_CHARACTERS = 20_000
EMPTY = OccupancyGrid(cells=np.zeros((0, 0), dtype=np.int8), resolution_m=0.05)
ODD_MAPS = {
    "all unknown": _filled(-1),
    "all free": _filled(0),
    "all occupied": _filled(100),
    "one free cell": _filled(0, 1),
    "one unknown cell": _filled(-1, 1),
    "one row": grid_from_text("#....?....#", resolution_m=0.25),
}
CALLS: tuple[tuple[str, dict[str, object]], ...] = (
    ("look_at_map", {}),
    ("look_at_map", {"around": "robot", "radius_m": 2.0, "up": "robot"}),
    ("describe_place", {"place": "robot"}),
    ("describe_place", {"place": "1, 1"}),
    ("check_goal", {"place": "1, 1"}),
    ("measure", {"places": ["1, 1", "2, 2"]}),
    ("get_robot_pose", {}),
)


@pytest.mark.parametrize("name", ODD_MAPS)
@pytest.mark.parametrize(("tool", "arguments"), CALLS)
async def test_every_look_at_an_odd_map_is_answered(
    tmp_path: Path, name: str, tool: str, arguments: dict[str, object]
) -> None:
    robot = FakeRobot(ODD_MAPS[name], pose=Pose(0.1, 0.1, 0.3))
    async with connect(robot, tmp_path) as client:
        answer = await client.call_tool(tool, arguments)
    assert not answer.is_error, text_of(answer)


@pytest.mark.parametrize(("tool", "arguments"), CALLS)
async def test_a_map_without_cells_is_refused_with_what_to_do(
    tmp_path: Path, tool: str, arguments: dict[str, object]
) -> None:
    async with connect(FakeRobot(EMPTY), tmp_path) as client:
        answer = await client.call_tool(tool, arguments)
    if tool == "get_robot_pose":
        assert report_of(answer)["place"] == "no map yet"
        return
    assert answer.is_error
    assert "Wait until SLAM" in text_of(answer)


@pytest.mark.parametrize(
    ("pose", "where"),
    [
        (Pose(3.3, 0.3, 0.0), "in no room"),
        (Pose(-40.0, 50.0, 0.0), "in no room"),
        (Pose(0.1, 0.1, 0.0), "in no room"),
    ],
)
async def test_a_robot_in_a_wall_or_off_the_map_still_sees_the_map(
    tmp_path: Path, pose: Pose, where: str
) -> None:
    async with connect(FakeRobot(two_rooms(), pose=pose), tmp_path) as client:
        answer = await client.call_tool("look_at_map", {})
    assert not answer.is_error, text_of(answer)
    assert where in text_of(answer)
    assert "\nR1 | " in text_of(answer)
    assert pictures_of(answer)


async def test_an_id_that_is_gone_says_what_became_of_it(tmp_path: Path) -> None:
    open_plan = grid_from_text(
        "\n".join(["#" * 30] + ["#" + "." * 28 + "#"] * 9 + ["#" * 30]),
        resolution_m=0.25,
    )
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        before = text_of(await client.call_tool("look_at_map", {}))
        robot.grid = open_plan
        after = text_of(await client.call_tool("look_at_map", {}))
        answers = [
            text_of(await client.call_tool("describe_place", {"place": place}))
            for place in ("R1", "R2", "D1")
        ]
    assert "\nR1 | " in before
    assert "\nR2 | " in before
    gone = [text for text in answers if "no longer found" in text]
    assert len(gone) == 2, (after, answers)
    assert "No longer there: D1, R1, R2 (now C1)." in after


async def test_the_text_about_a_building_of_hundreds_of_rooms_stays_short(tmp_path: Path) -> None:
    room = ["#" + "." * 5] * 5
    aisle = ["." * 6] * 5
    floor = ["######", *room, "##..##", *aisle, "##..##", *room]
    grid = grid_from_text("\n".join(line * 40 for line in floor * 8), resolution_m=0.4)
    async with connect(FakeRobot(grid, pose=Pose(49.4, 28.4)), tmp_path) as client:
        text = text_of(await client.call_tool("look_at_map", {}))
        measured = text_of(await client.call_tool("measure", {}))
    assert "## Rooms, smallest first (showing 4" in text
    ways_m = [row.number("path m") for row in read_map_text(text).rows("Rooms")]
    assert min(ways_m) < 5.0
    assert "more, in between, left out" in text
    assert len(text) <= MOST_CHARACTERS
    assert len(measured) <= MOST_CHARACTERS
