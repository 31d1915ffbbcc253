import base64
import io
import math
import re
from pathlib import Path

import anyio
import numpy as np
import pytest
from mcp_types import CallToolResult
from PIL import Image

from drawing import grid_from_text
from fakes import FakeRobot, two_rooms
from mapspeak.evaluation.agents.driver import read_map_picture, read_map_text
from mapspeak.geometry import Point, Pose
from mapspeak.memory import SemanticMapStore
from mapspeak.memory.pictures import PictureBook, TakenPicture
from mapspeak.robot import Detection, GoalState, NavigationLook, NavigationPart
from mapspeak.spatial import OccupancyGrid
from rosbridge_script import PATIENCE_S
from served import MODES, connect, pictures_of, report_of, text_of

pytestmark = pytest.mark.anyio


@pytest.mark.parametrize("mode", MODES)
async def test_one_look_gives_a_picture_and_every_fact_of_it_as_text(
    tmp_path: Path, mode: str
) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, mode=mode) as client:
        result = await client.call_tool("look_at_map", {})
    reading = read_map_text(text_of(result))
    assert [row.id for row in reading.rows("Rooms")] == ["R2", "R1"]
    assert reading.rows("Doors")[0].cells["joins"] == "R1 R2"
    assert (reading.pose.x, reading.pose.y) == (1.5, 1.4)
    picture = Image.open(io.BytesIO(base64.b64decode(pictures_of(result)[0].data)))
    assert max(picture.size) <= 1000
    assert result.structured_content is None


async def test_only_the_layers_asked_for_are_listed(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        result = await client.call_tool("look_at_map", {"layers": ["doors"]})
    assert read_map_text(text_of(result)).tables.keys() == {"Doors"}


async def test_who_asks_is_shown_the_walls_that_no_picture_shows_and_their_share(
    tmp_path: Path,
) -> None:
    asked = {"layers": ["rooms", "unseen"], "full": True}
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        usual = await client.call_tool("look_at_map", {"full": True})
        before = await client.call_tool("look_at_map", asked)
        await client.call_tool("look_around", {})
        after = await client.call_tool("look_at_map", asked)
    assert "walls in sight" not in text_of(usual)
    assert "Pictures show 0% of the walls in sight." in text_of(before)
    (percent,) = re.findall(r"Pictures show (\d+)% of the walls in sight", text_of(after))
    assert 20 <= int(percent) < 90
    assert _count_purple(before) > _count_purple(after) > _count_purple(usual) == 0


def _count_purple(result: CallToolResult) -> int:
    picture = Image.open(io.BytesIO(base64.b64decode(pictures_of(result)[0].data)))
    pixels = np.asarray(picture.convert("RGB"))
    return int((pixels == (204, 121, 167)).all(axis=2).sum())


async def test_a_robot_without_a_map_yet_says_what_to_start(tmp_path: Path) -> None:
    async with connect(FakeRobot(None), tmp_path) as client:
        result = await client.call_tool("look_at_map", {})
        pose = await client.call_tool("get_robot_pose", {})
    assert result.is_error
    assert "Start SLAM" in text_of(result)
    assert report_of(pose)["place"] == "no map yet"


async def test_a_picture_does_not_wait_for_a_map_that_does_not_come(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    robot.may_give_map = anyio.Event()
    async with connect(robot, tmp_path) as client:
        with anyio.fail_after(PATIENCE_S):
            picture = await client.call_tool("look_through_camera", {})
    assert pictures_of(picture)


async def test_a_picture_on_the_way_says_that_its_drive_has_not_ended(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        await client.call_tool("navigate_to", {"place": "R1", "wait_s": 0})
        under_way = text_of(await client.call_tool("look_through_camera", {}))
        robot.end_goal(GoalState.ARRIVED)
        ended = text_of(await client.call_tool("look_through_camera", {}))
    assert "Taken on the way: G1 to R1 has not ended. Call wait_for_goal." in under_way
    assert "on the way" not in ended


async def test_an_assumed_size_of_the_robot_is_said(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        told = await client.call_tool("look_at_map", {})
    robot.is_radius_assumed = True
    async with connect(robot, tmp_path) as client:
        assumed = await client.call_tool("look_at_map", {})
    assert "is assumed" not in text_of(told)
    assert "A radius of 0.20 m is assumed" in text_of(assumed)


async def test_a_robot_without_a_camera_says_what_to_use_instead(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms(), has_camera=False), tmp_path) as client:
        result = await client.call_tool("look_through_camera", {})
    assert result.is_error
    assert "look_at_map" in text_of(result)


async def test_another_camera_is_named_and_its_picture_is_remembered_with_its_own_heading(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms())
    robot.cameras = ("front", "rear")
    async with connect(robot, tmp_path) as client:
        ahead = text_of(await client.call_tool("look_through_camera", {}))
        behind = text_of(await client.call_tool("look_through_camera", {"camera": "Rear"}))
        wrong = await client.call_tool("look_through_camera", {"camera": "left"})
        seen = {"label": "sink", "image_column_px": 32, "range_m": 1, "picture": "P2"}
        record = {"name": "back", "description": "a sink", "functional_landmarks": [seen]}
        await client.call_tool("write_semantic_data", record)
    assert ahead.endswith("Other cameras: rear.")
    assert "Picture P2, camera 'rear'" in behind
    assert "yaw 180 deg" in behind
    assert wrong.is_error
    assert "front, rear" in text_of(wrong)
    (waypoint,) = SemanticMapStore(tmp_path / "semantic_map.yaml").read().waypoints
    assert waypoint.pose.point == robot.pose.point
    assert abs(waypoint.pose.yaw_deg) == pytest.approx(180)


async def test_a_later_caption_leaves_out_what_stays_the_same(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    robot.cameras = ("front", "rear")
    async with connect(robot, tmp_path) as client:
        first = text_of(await client.call_tool("look_through_camera", {}))
        again = text_of(await client.call_tool("look_through_camera", {}))
        behind = text_of(await client.call_tool("look_through_camera", {"camera": "rear"}))
    assert " px" in first
    assert " px" not in again
    assert "Other cameras" not in again
    assert "taken at x" in again
    assert " px" in behind


def test_the_robot_is_aimed_by_the_camera_ahead_however_wide_another_one_is() -> None:
    book = PictureBook()
    for half_deg, is_ahead in ((40, True), (20, False)):
        taken = TakenPicture(
            pose=Pose(0.0, 0.0),
            stamp_s=float(half_deg),
            width_px=64,
            horizontal_fov_rad=math.radians(2 * half_deg),
            is_ahead=is_ahead,
        )
        book.add(taken, b"", media_type="image/jpeg")
    assert book.half_view_rad == pytest.approx(math.radians(40))
    assert len(book.views) == 2


async def test_what_the_robots_navigation_plans_is_drawn_on_request_with_its_age(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms())
    path = (Point(1.5, 1.5), Point(1.5, 2.0), Point(3.0, 2.0))
    robot.navigation = (
        NavigationLook(part=NavigationPart.PLAN, age_s=0.4, lines=(path,)),
        NavigationLook(part=NavigationPart.FOOTPRINT, age_s=None),
        NavigationLook(part=NavigationPart.LOCAL_COSTMAP, age_s=2.0, unplaced_frame="odom"),
    )
    asked = {"layers": ["navigation"], "full": True}
    async with connect(robot, tmp_path) as client:
        usual = await client.call_tool("look_at_map", {"layers": ["rooms"], "full": True})
        shown = await client.call_tool("look_at_map", asked)
        robot.navigation = ()
        nothing = await client.call_tool("look_at_map", asked)
    assert "navigation" not in text_of(usual)
    told = text_of(shown)
    assert "planned path 2.0 m long, ends at x 3.00, y 2.00, 0.4 s old" in told
    assert "footprint has told nothing yet" in told
    assert "in the frame 'odom', which TF does not join to the map" in told
    assert "it publishes no global costmap." in told
    assert "publishes no planned path, no footprint" in text_of(nothing)
    green = (0, 158, 115)
    assert (n_pixels(shown, green) > 0, n_pixels(nothing, green)) == (True, 0)


async def test_the_robots_arrow_does_not_hide_its_footprint(tmp_path: Path) -> None:
    robot, vermilion = FakeRobot(two_rooms()), (213, 94, 0)
    across = (Point(1.3, 1.4), Point(1.7, 1.4))
    async with connect(robot, tmp_path) as client:
        bare = await client.call_tool("look_at_map", {"layers": ["navigation"]})
        robot.navigation = (
            NavigationLook(part=NavigationPart.FOOTPRINT, age_s=0.1, lines=(across,)),
        )
        shown = await client.call_tool("look_at_map", {"layers": ["navigation"], "full": True})
    assert n_pixels(shown, vermilion) < n_pixels(bare, vermilion)


def n_pixels(result: CallToolResult, colour: tuple[int, int, int]) -> int:
    png = base64.b64decode(pictures_of(result)[0].data)
    pixels = np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))
    return int((pixels == colour).all(axis=2).sum())


async def test_what_the_robots_detector_reports_stands_beside_the_picture(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    robot.detections = (
        Detection(label="ladder", confidence_ratio=0.9, bearing_rad=-0.5, range_m=2.0),
    )
    async with connect(robot, tmp_path) as client:
        result = await client.call_tool("look_through_camera", {})
    assert "- ladder, -29 deg, 2.0 m, 0.90" in text_of(result)
    assert pictures_of(result)[0].mime_type == "image/jpeg"


async def test_the_papers_picture_gives_the_grid_back_cell_by_cell(tmp_path: Path) -> None:
    grid = two_rooms()
    async with connect(FakeRobot(grid), tmp_path) as client:
        result = await client.call_tool("subscribe_map_as_image", {})
    picture = base64.b64decode(pictures_of(result)[0].data)
    read_back = read_map_picture(text_of(result), picture)
    assert (read_back.cells == grid.cells).all()
    assert (read_back.origin, read_back.resolution_m) == (grid.origin, grid.resolution_m)


@pytest.mark.parametrize("tool", ["draw_map_axis", "draw_robot_pose"])
async def test_each_of_the_papers_drawings_works_alone(tmp_path: Path, tool: str) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        result = await client.call_tool(tool, {})
    assert len(pictures_of(result)) == 1
    assert "A grid line every" in text_of(result)


async def test_a_closer_look_lists_only_what_it_shows_under_the_same_ids(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        whole = read_map_text(text_of(await client.call_tool("look_at_map", {})))
        near = await client.call_tool("look_at_map", {"around": "robot", "radius_m": 1.0})
        room = await client.call_tool("look_at_map", {"around": "R1"})
    assert {row.id for row in read_map_text(text_of(near)).rows("Rooms")} == {"R2"}
    assert "only what lies around robot" in text_of(near)
    rows = read_map_text(text_of(room)).rows("Rooms")
    assert {row.id: row.cells["stand at x, y"] for row in rows}["R1"] == {
        row.id: row.cells["stand at x, y"] for row in whole.rows("Rooms")
    }["R1"]


async def test_with_the_robots_heading_up_the_picture_is_turned_and_the_text_says_so(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms(), pose=Pose(1.5, 1.4, math.pi))
    async with connect(robot, tmp_path) as client:
        north = await client.call_tool("look_at_map", {})
        turned = await client.call_tool("look_at_map", {"up": "robot"})
    assert "Up in the picture is yaw 180 deg" in text_of(turned)
    assert pictures_of(turned)[0].data != pictures_of(north)[0].data
    assert read_map_text(text_of(turned)).tables == read_map_text(text_of(north)).tables


async def test_a_look_around_what_is_not_there_names_what_is(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        answer = await client.call_tool("look_at_map", {"around": "R8"})
    assert answer.is_error
    assert "rooms and corridors R1 R2" in text_of(answer)


async def test_a_room_that_nobody_can_get_to_is_not_offered_as_the_smallest_to_go_to(
    tmp_path: Path,
) -> None:
    grid = grid_from_text(
        """
        ########################
        #......#.........#.....#
        #......#.........#.....#
        #......#.........#.....#
        #................#.....#
        #................#.....#
        #......#.........#.....#
        #......#.........#.....#
        ########################
        """,
        resolution_m=0.4,
    )
    async with connect(FakeRobot(grid, pose=Pose(1.5, 1.5)), tmp_path) as client:
        text = text_of(await client.call_tool("look_at_map", {}))
    rows = {row.id: row for row in read_map_text(text).rows("Rooms")}
    closed = next(id_ for id_, row in rows.items() if row.cells["path m"] == "no way")
    assert f"the smallest is {closed} " in text
    (told,) = re.findall(r"Of those with a way for the robot the smallest is (R\d+)", text)
    assert told != closed
    assert rows[told].number("floor m2") < max(row.number("floor m2") for row in rows.values())


async def test_a_room_that_borders_on_the_unknown_is_said_to_be_not_all_seen(
    tmp_path: Path,
) -> None:
    grid = grid_from_text(
        """
        ########################
        #......#...............?
        #......#...............?
        #......#...............?
        #......................?
        #......................?
        #......#...............?
        #......#...............?
        ########################
        """,
        resolution_m=0.4,
    )
    async with connect(FakeRobot(grid, pose=Pose(1.5, 1.5)), tmp_path) as client:
        text = text_of(await client.call_tool("look_at_map", {}))
    sizes = {row.id: row.cells["floor m2"] for row in read_map_text(text).rows("Rooms")}
    assert [size.endswith("+") for size in sizes.values()] == [False, True]


async def test_a_bay_that_may_be_part_of_a_room_is_named_apart_from_the_smallest(
    tmp_path: Path,
) -> None:
    cells = np.full((30, 40), 100, np.int8)
    left, right, bay = np.s_[1:21, 1:25], np.s_[1:21, 26:39], np.s_[22:29, 4:12]
    door, mouth = np.s_[8:13, 25], np.s_[21, 5:11]
    for floor in (left, right, bay, door, mouth):
        cells[floor] = 0
    grid = OccupancyGrid(cells=cells, resolution_m=0.2)
    async with connect(FakeRobot(grid, pose=Pose(1.5, 1.5)), tmp_path) as client:
        text = text_of(await client.call_tool("look_at_map", {}))
    assert "The smaller sure room is R2 (10.5 m2), the larger R1 (19.5 m2)." in text
    assert "Probably parts of others: R3 (3.3 m2, smaller than R2)." in text


async def test_rooms_without_a_note_are_listed_from_the_first_note_on(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        before = text_of(await client.call_tool("look_at_map", {}))
        for name, x in (("west", 1.5), ("east", 6.0)):
            await client.call_tool(
                "write_semantic_data", {"name": name, "description": "", "x": x, "y": 1.4}
            )
            text = text_of(await client.call_tool("look_at_map", {}))
            if name == "west":
                assert "Rooms without a note: R1." in text
    assert "note" not in before
    assert "Every room has a note." in text


async def test_a_map_with_a_frontier_is_never_called_known_as_a_whole(tmp_path: Path) -> None:
    cells = np.full((302, 302), 100, np.int8)
    cells[1:-1, 1:-1], cells[150:155, -1] = 0, -1
    cells = np.hstack([cells, np.full((302, 4), -1, np.int8)])
    robot = FakeRobot(OccupancyGrid(cells=cells, resolution_m=0.5), pose=Pose(125.0, 75.0))
    async with connect(robot, tmp_path) as client:
        text = text_of(await client.call_tool("look_at_map", {}))
    ((known_m2, percent, promised_m2),) = re.findall(
        r"Explored: ([\d.]+) m2 of free floor, (\d+) %: about (\d+) m2 more are expected", text
    )
    assert "1 frontier" in text
    assert 0 < float(promised_m2) < 0.005 * float(known_m2)
    assert percent == "99"


async def test_unsure_rooms_that_would_change_the_ranks_say_so(tmp_path: Path) -> None:
    cells = np.full((34, 60), 100, np.int8)
    west, east, opening = np.s_[1:21, 1:25], np.s_[1:21, 26:46], np.s_[8:21, 25]
    north, south = np.s_[1:11, 47:58], np.s_[12:21, 47:58]
    for floor in (west, east, north, south, opening, np.s_[4:8, 46], np.s_[14:18, 46]):
        cells[floor] = 0
    grid = OccupancyGrid(cells=cells, resolution_m=0.2)
    async with connect(FakeRobot(grid, pose=Pose(1.5, 1.5)), tmp_path) as client:
        text = text_of(await client.call_tool("look_at_map", {}))
        largest = text_of(await client.call_tool("describe_place", {"place": "largest room"}))
    assert "The smaller sure room is R4 (4.0 m2), the larger R3 (4.5 m2)." in text
    assert "R2 (16.4 m2, larger than R3), R1 (19.5 m2, larger than R3)." in text
    assert "unsure ones are left out: R1 (19.5 m2), R2 (16.4 m2)" in largest


async def test_a_corridor_that_bends_has_one_size_in_the_table_and_where_it_is_described(
    tmp_path: Path,
) -> None:
    grid = grid_from_text(
        """
        ########################################
        #..........#############################
        #..........#############################
        #..........#...........................#
        #......................................#
        #......................................#
        #......................................#
        #..........#...........................#
        #..........#######################.....#
        #..........#######################.....#
        ##################################.....#
                                         #.....#
                                         #.....#
                                         #.....#
                                         #.....#
                                         #.....#
                                         #.....#
                                         #.....#
                                         #.....#
                                         #.....#
                                         #.....#
                                         #.....#
                                         #.....#
                                         #######
        """,
        resolution_m=0.25,
    )
    async with connect(FakeRobot(grid, pose=Pose(5.0, 4.4)), tmp_path) as client:
        table = read_map_text(text_of(await client.call_tool("look_at_map", {})))
        text = text_of(await client.call_tool("describe_place", {"place": "C1"}))
    (corridor,) = table.rows("Corridors")
    assert f"C1 is a corridor: {corridor.cells['size m']} m, 1 door." in text
    along_m, across_m = map(float, corridor.cells["size m"].split(" x "))
    assert along_m == pytest.approx(10.5, abs=1.0)
    assert across_m == pytest.approx(1.25, abs=0.1)


async def test_who_looks_again_is_told_what_is_new_alone(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        first = text_of(await client.call_tool("look_at_map", {}))
        robot.pose = Pose(1.0, 1.0)
        again = text_of(await client.call_tool("look_at_map", {}))
        full = text_of(await client.call_tool("look_at_map", {"full": True}))
    assert read_map_text(first).rows("Rooms")
    assert "Rooms" not in read_map_text(again).tables
    assert "The smaller room is" in again
    assert len(again) < len(first) / 2
    assert [row.id for row in read_map_text(full).rows("Rooms")] == ["R2", "R1"]


async def test_what_has_changed_since_the_last_look_is_told_and_what_is_gone_is_named(
    tmp_path: Path,
) -> None:
    grid = two_rooms()
    robot = FakeRobot(grid)
    async with connect(robot, tmp_path) as client:
        await client.call_tool("look_at_map", {})
        cells = grid.cells.copy()
        cells[:, cells.shape[1] // 2 :] = -1
        robot.grid = OccupancyGrid(cells=cells, resolution_m=grid.resolution_m)
        again = text_of(await client.call_tool("look_at_map", {}))
    assert "No longer there: D1" in again
    assert "Rooms" in {name.split(",")[0] for name in read_map_text(again).tables}


async def test_each_client_is_told_what_it_has_not_read(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    for _ in range(2):
        async with connect(robot, tmp_path) as client:
            assert read_map_text(text_of(await client.call_tool("look_at_map", {}))).rows("Rooms")


async def test_a_look_at_a_part_or_at_a_layer_tells_all_of_it(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        await client.call_tool("look_at_map", {})
        near = await client.call_tool("look_at_map", {"around": "R1"})
        doors = await client.call_tool("look_at_map", {"layers": ["doors"]})
    assert read_map_text(text_of(near)).rows("Rooms")
    assert read_map_text(text_of(doors)).rows("Doors")
