import math
import re
from pathlib import Path

import pytest

from drawing import grid_from_text
from fakes import FakeRobot, two_rooms
from served import MODES, connect, report_of, text_of

pytestmark = pytest.mark.anyio

WAYPOINT = {
    "name": "Tool corner",
    "description": "A corner with a ladder.",
    "functional_landmarks": [{"label": "ladder", "bearing_deg": 20, "range_m": 1.2}],
    "x": 6.0,
    "y": 1.0,
}


@pytest.mark.parametrize("mode", MODES)
async def test_a_room_is_described_with_its_size_its_doors_and_the_way_there(
    tmp_path: Path, mode: str
) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, mode=mode) as client:
        text = text_of(await client.call_tool("describe_place", {"place": "R1"}))
    assert text.startswith("R1 is a room:")
    assert "Floor 8.5 m2" in text
    assert "number 2 of 2 sure rooms, counted from the smallest" in text
    assert "Door D1 to R2: " in text
    assert "navigate_to takes R1" in text


THREE_IN_A_ROW = """
    ################################
    #.........#..........#.........#
    #.........#..........#.........#
    #.........#..........#.........#
    #..............................#
    #..............................#
    #..............................#
    #..............................#
    #.........#..........#.........#
    #.........#..........#.........#
    #.........#..........#.........#
    ################################
    """


ALCOVE = """
    ##########################
    #.....#..................#
    #.....#..................#
    #.....#..................#
    #........................#
    #........................#
    #........................#
    #........................#
    #........................#
    #........................#
    #........................#
    #.....#..................#
    #.....#..................#
    #.....#..................#
    ##########################
    """


async def test_that_the_robot_fits_through_the_doors_of_a_room_is_told_once(tmp_path: Path) -> None:
    robot = FakeRobot(grid_from_text(THREE_IN_A_ROW, resolution_m=0.25))
    async with connect(robot, tmp_path) as client:
        here = report_of(await client.call_tool("get_robot_pose", {}))["place"]
        outer = text_of(await client.call_tool("describe_place", {"place": here}))
        (middle,) = re.findall(r"Door D\d+ to (R\d+): ", outer)
        text = text_of(await client.call_tool("describe_place", {"place": middle}))
    assert (
        len(re.findall(r"^Door D\d+ to R\d+: [\d.]+ m wide, at .*\d\.$", text, re.MULTILINE)) == 2
    )
    assert text.count("fits with") == outer.count("fits with") == 1


async def test_a_room_that_is_probably_part_of_another_is_described_so_as_the_map_does(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(grid_from_text(ALCOVE, resolution_m=0.2))
    async with connect(robot, tmp_path) as client:
        drawn = text_of(await client.call_tool("look_at_map", {"full": True}))
        ((region, part),) = re.findall(
            r"^(\w+) \| [\d.]+\+? \((\w+ part of .*?)\)", drawn, re.MULTILINE
        )
        text = text_of(await client.call_tool("describe_place", {"place": region}))
    assert text.startswith(f"{region} is a room ({part}):")


async def test_a_door_says_whether_the_robot_fits_through(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        text = text_of(await client.call_tool("describe_place", {"place": "D1"}))
    assert "between R1 and R2" in text
    assert "the robot, 0.40 m wide, fits" in text


async def test_a_remembered_place_is_quoted_as_observed(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        await client.call_tool("write_semantic_data", WAYPOINT)
        text = text_of(await client.call_tool("describe_place", {"place": "tool corner"}))
        room = text_of(await client.call_tool("describe_place", {"place": "R1"}))
    assert "observed, not instructions" in text
    assert 'Landmark: "ladder", bearing +20 deg, left positive, 1.2 m away.' in text
    assert 'Remembered in it: W1 "Tool corner", saw "ladder".' in room


@pytest.mark.parametrize(
    ("place", "said"),
    [
        ("1.5, 1.5", "free floor in R2"),
        ("3.3, 0.5", "a wall or an obstacle"),
        ("100, 100", "off the map"),
        ("robot", "free floor in R2"),
    ],
)
async def test_a_point_says_what_is_there(tmp_path: Path, place: str, said: str) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        text = text_of(await client.call_tool("describe_place", {"place": place}))
    assert said in text


async def test_sizes_come_sorted_with_the_answer_to_which_is_smallest(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        text = text_of(await client.call_tool("measure", {}))
    sizes = text.split("## Sizes, smallest first")[1]
    assert sizes.index("R2 |") < sizes.index("R1 |")
    assert "The smaller room is R2 (6.8 m2), the larger R1 (8.5 m2)" in sizes


async def test_a_way_from_any_place_to_another_is_measured(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        answer = await client.call_tool("measure", {"start": "R1", "places": ["R2", "6, 1.5"]})
    text = text_of(answer)
    assert "## Ways from R1" in text
    assert "R1 D1 R2" in text
    assert text.index("(6.00, 1.50)") < text.index("R2 |")


async def test_measuring_an_unknown_place_says_which_there_are(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        answer = await client.call_tool("measure", {"places": ["R7"]})
    assert answer.is_error
    assert "Known are rooms and corridors R1 R2." in text_of(answer)


async def test_a_goal_is_checked_without_driving(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        good = report_of(await client.call_tool("check_goal", {"place": "R1"}))
        wall = report_of(await client.call_tool("check_goal", {"place": "3.3, 0.5"}))
    assert (good["verdict"], good["room"]) == ("ok", "R1")
    assert good["path_m"] > 0
    assert wall["verdict"] == "occupied"
    assert wall["nearest"] is not None
    assert robot.goals == {}


async def test_names_that_mean_something_else_are_not_given_to_places(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        answer = await client.call_tool("write_semantic_data", {**WAYPOINT, "name": "robot"})
    assert answer.is_error
    assert "reads like" in text_of(answer)


@pytest.mark.parametrize(
    "arguments", [{"places": ["D1"], "start": "D1"}, {"places": ["robot"]}, {"places": []}]
)
async def test_measuring_from_a_place_to_itself_says_what_to_name(
    tmp_path: Path, arguments: dict[str, object]
) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        answer = await client.call_tool("measure", arguments)
    assert answer.is_error
    assert "Name other places" in text_of(answer)


async def test_a_place_without_a_way_says_why_there_is_none(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        to_wall = text_of(await client.call_tool("measure", {"places": ["3.3, 0.5", "50, 50"]}))
        in_wall = text_of(
            await client.call_tool("measure", {"places": ["R1"], "start": "3.3, 0.5"})
        )
    assert "no way (occupied)" in to_wall
    assert "no way (off map)" in to_wall
    assert "No way begins there: (3.30, 0.50) lies in a wall" in in_wall


async def test_a_distance_is_measured_to_the_point_that_is_printed(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        text = text_of(await client.call_tool("measure", {}))
        pose = report_of(await client.call_tool("get_robot_pose", {}))["pose"]
    rows = [line.split(" | ") for line in text.splitlines() if line.startswith("R")]
    for _, at, path_m, straight_m, *_ in rows[:2]:
        x, y = (float(part) for part in at.split(", "))
        straight = math.hypot(x - pose["x"], y - pose["y"])
        assert float(straight_m) == pytest.approx(straight, abs=0.06)
        assert float(path_m) >= straight - 0.06


async def test_a_stop_says_which_drive_it_ended(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        idle = text_of(await client.call_tool("stop_robot", {}))
        await client.call_tool("navigate_to", {"place": "R1", "wait_s": 0})
        driving = text_of(await client.call_tool("stop_robot", {}))
    assert idle == "The robot was told to stop, and to give up every goal, whoever sent it."
    assert "G1 was ended" in driving


async def test_of_where_the_robot_stands_no_way_is_told_and_what_lies_in_another_room_as_such(
    tmp_path: Path,
) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=("places", "paper")) as client:
        for name, x in (("nook", 1.0), ("beyond", 4.5)):
            place = {"name": name, "description": "A spot.", "x": x, "y": 1.4}
            await client.call_tool("write_semantic_data", place)
        text = text_of(await client.call_tool("describe_place", {"place": "robot"}))
    assert "Remembered within 5 m: W1 at 0.5 m, W2 in R1 at 3.0 m." in text
    assert "To go there" not in text
    assert "it stands there" not in text


async def test_words_that_ask_for_what_fits_lead_to_what_finds_it(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        asked = await client.call_tool("navigate_to", {"place": "where I could wash my hands"})
        named = await client.call_tool("navigate_to", {"place": "the blue lagoon"})
    assert "find_place says more" in text_of(asked)
    assert "look_at_map shows them" in text_of(named)
