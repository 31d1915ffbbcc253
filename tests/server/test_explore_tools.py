import math
import re
from pathlib import Path

import pytest
from mcp.client import Client

from fakes import FakeRobot, two_rooms
from mapspeak.driving.drivereport import DriveReport
from mapspeak.driving.exploration.explorer import Explorer
from mapspeak.driving.exploration.progress import Bounds
from mapspeak.errors import LinkError
from mapspeak.evaluation.agents.driver import read_map_text
from mapspeak.geometry import Pose
from mapspeak.robot import CameraPicture, Detection
from mapspeak.server.reports.exploring import ExploreAnswer
from mapspeak.spatial import OccupancyGrid
from roaming import RoamingRobot, session_of, world_from_text
from served import connect, pictures_of, report_of, text_of

pytestmark = pytest.mark.anyio

TOOLSETS = ("explore", "drive")

HALL_AND_ROOM = """
########################
#..........#...........#
#..........#...........#
#..........#...........#
#..........#...........#
#......................#
#......................#
#......................#
#......................#
#..........#...........#
#..........#...........#
########################
"""


THREE_ROOMS = """
################################################
#...............#...............#..............#
#...............#...............#..............#
#...............#...............#..............#
#...............#...............#..............#
#...............#...............#..............#
#...............#...............#..............#
#...............#...............#..............#
#..............................................#
#..............................................#
#..............................................#
#..............................................#
#...............#...............#..............#
################################################
"""


def _robot() -> RoamingRobot:
    return RoamingRobot(world_from_text(HALL_AND_ROOM, start=(1.0, 1.4)), has_detector=True)


async def test_exploring_goes_on_from_call_to_call_until_nothing_is_left(tmp_path: Path) -> None:
    async with connect(_robot(), tmp_path, toolsets=TOOLSETS) as client:
        answer = report_of(await client.call_tool("explore", {"wait_s": 2.0}))
        assert answer["state"] == "driving"
        assert answer["goal_id"] == "G1"
        assert "explore again" in answer["next_step"]
        for _ in range(20):
            if answer["state"] != "driving":
                break
            answer = report_of(await client.call_tool("explore", {"wait_s": 5.0}))
    assert answer["state"] == "nothing_left"
    assert answer["known_area_m2"] > 11.0
    assert answer["frontiers"] == []
    assert answer["driven_m"] > 1.0


async def test_the_frontier_under_way_comes_first(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=(5.0, 1.4)))
    explorer = Explorer(session_of(robot, tmp_path), pick=lambda frontiers, _: frontiers[-1])
    progress = await explorer.advance(Bounds(), wait_s=0.1, on_trip=_no_news)
    answer = ExploreAnswer.of(progress)
    assert len(answer.frontiers) > 1
    assert answer.frontiers[0] == answer.next.split(":")[0] != progress.frontiers[0].id


async def _no_news(_report: DriveReport) -> None:
    """Take no news."""


async def test_a_wait_that_was_cut_is_told(tmp_path: Path) -> None:
    async with connect(_robot(), tmp_path, toolsets=TOOLSETS) as client:
        await client.call_tool("turn", {"by_deg": 5})
        asked = await client.call_tool("wait_for_goal", {"wait_s": 60})
        within = await client.call_tool("wait_for_goal", {"wait_s": 25})
    assert "wait_s was cut to 25" in text_of(asked)
    assert "was cut" not in text_of(within)


async def test_sizes_mark_what_is_not_all_seen_yet_as_the_map_does(tmp_path: Path) -> None:
    async with connect(_robot(), tmp_path, toolsets=("look", "places")) as client:
        await client.call_tool("look_at_map", {})
        told = text_of(await client.call_tool("measure", {}))
        drawn = text_of(await client.call_tool("look_at_map", {"full": True}))
    assert set(re.findall(r"^(\w\d+) \| [\d.]+\+ ", told.split("## Sizes")[1], re.MULTILINE)) == {
        *re.findall(r"^(\w\d+) \| [\d.]+\+ ", drawn, re.MULTILINE)
    }
    assert "+ | " in told


async def test_a_picture_comes_with_every_pause_at_a_goal(tmp_path: Path) -> None:
    arguments = {"stops_at_goals": True, "n_goals": 1, "wait_s": 25.0}
    async with connect(_robot(), tmp_path, toolsets=TOOLSETS) as client:
        result = await client.call_tool("explore", arguments)
    assert report_of(result)["state"] == "at_goal"
    assert len(pictures_of(result)) == 1
    assert "simulated detector" in text_of(result)


async def test_a_map_without_frontiers_is_answered_at_once(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        answer = report_of(await client.call_tool("explore", {}))
    assert answer["state"] == "nothing_left"
    assert robot.goals == {}


async def test_a_room_that_turned_out_to_be_none_is_not_named_after_an_exploration(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=(*TOOLSETS, "look")) as client:
        earlier = report_of(await client.call_tool("get_robot_pose", {}))["place"]
        cells = two_rooms().cells.copy()
        cells[1:-1, 13] = 0
        robot.grid = OccupancyGrid(cells=cells, resolution_m=0.25)
        await client.call_tool("explore", {})
        told = report_of(await client.call_tool("get_robot_pose", {}))["place"]
        text = text_of(await client.call_tool("look_at_map", {}))
    assert earlier == "R2"
    reading = read_map_text(text)
    assert [told] == [row.id for title in ("Rooms", "Corridors") for row in reading.rows(title)]


async def test_stop_robot_ends_an_exploration(tmp_path: Path) -> None:
    async with connect(_robot(), tmp_path, toolsets=TOOLSETS) as client:
        await client.call_tool("explore", {"wait_s": 1.0})
        await client.call_tool("stop_robot", {})
        answer = report_of(await client.call_tool("explore", {"wait_s": 1.0}))
    assert answer["state"] == "interrupted"


async def test_a_turn_is_a_drive_in_place(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        by = report_of(await client.call_tool("turn", {"by_deg": -90}))
        to = report_of(await client.call_tool("turn", {"to_yaw_deg": 180}))
    assert by["robot"] == {"x": 1.5, "y": 1.4, "yaw_deg": -90.0}
    assert to["robot"]["yaw_deg"] == 180.0
    assert to["goal_id"] == "G2"


@pytest.mark.parametrize(
    "arguments", [{}, {"by_deg": 90, "to_yaw_deg": 0}, {"by_deg": 270}, {"by_deg": -181}]
)
async def test_a_turn_is_by_an_angle_or_to_a_heading(
    tmp_path: Path, arguments: dict[str, object]
) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        result = await client.call_tool("turn", arguments)
    assert result.is_error
    assert "by_deg" in text_of(result)
    assert robot.goals == {}


async def test_looking_around_gives_a_picture_at_each_heading(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        result = await client.call_tool("look_around", {"n_pictures": 3})
    assert len(pictures_of(result)) == 3
    assert [round(goal.yaw_deg) for goal in robot.goals.values()] == [120, -120]


async def test_looking_around_with_another_camera_turns_the_robot_the_same_way(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms())
    robot.cameras = ("front", "rear")
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        asked = {"n_pictures": 3, "camera": "rear"}
        result = await client.call_tool("look_around", asked)
    assert text_of(result).count("camera 'rear'") == 3
    assert [round(goal.yaw_deg) for goal in robot.goals.values()] == [120, -120]


async def test_looking_around_leaves_no_gap_between_pictures(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        result = await client.call_tool("look_around", {})
    fov_rad = (await robot.fetch_picture()).horizontal_fov_rad
    assert fov_rad is not None
    assert len(pictures_of(result)) * fov_rad > math.tau


async def test_looking_around_without_a_camera_moves_nothing(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms(), has_camera=False)
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        result = await client.call_tool("look_around", {})
    assert result.is_error
    assert robot.goals == {}


class StoppedRobot(FakeRobot):
    """A robot that somebody stops whenever it sets out."""

    async def send_goal(self, goal: Pose) -> str:
        goal_id = await super().send_goal(goal)
        await self.stop()
        return goal_id


async def test_looking_around_ends_when_the_robot_is_stopped(tmp_path: Path) -> None:
    robot = StoppedRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        result = await client.call_tool("look_around", {"n_pictures": 4})
    assert len(pictures_of(result)) == 1
    assert "No picture at 90 deg and beyond" in text_of(result)
    assert ".." not in text_of(result)
    assert len(robot.goals) == 1


async def test_looking_around_shows_the_pictures_taken_before_the_camera_failed(
    tmp_path: Path,
) -> None:
    class TiredRobot(FakeRobot):
        """A robot whose camera takes two pictures and no more."""

        n_pictures = 0

        async def fetch_picture(self, camera: str | None = None) -> CameraPicture:
            self.n_pictures += 1
            if self.n_pictures > 2:
                raise LinkError("No picture has come within 5 s.", hint="Check the camera.")
            return await super().fetch_picture(camera)

    robot = TiredRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        result = await client.call_tool("look_around", {"n_pictures": 4})
    assert not result.is_error
    assert len(pictures_of(result)) == 2
    assert "No picture at 180 deg and beyond: No picture has come" in text_of(result)


async def test_a_search_shows_a_picture_and_goes_on_by_what_was_seen(tmp_path: Path) -> None:
    async with connect(_robot(), tmp_path, toolsets=TOOLSETS) as client:
        first = await client.call_tool("search_for", {"thing": "sofa", "wait_s": 25.0})
        assert report_of(first)["state"] == "look"
        assert len(pictures_of(first)) == 1
        answer = {"thing": "sofa", "seen": False, "likely": 0.2, "scores": {"F1": 0.9}}
        second = report_of(await client.call_tool("search_for", answer))
        assert second["n_looks"] >= 1
        found = await client.call_tool("search_for", {"thing": "sofa", "seen": True})
    assert report_of(found)["state"] == "found"
    assert pictures_of(found) == []


async def test_a_search_in_vain_says_which_places_were_seen(tmp_path: Path) -> None:
    asked = {"thing": "sofa", "seen": False, "wait_s": 25.0}
    async with connect(_robot(), tmp_path, toolsets=TOOLSETS) as client:
        answer = report_of(await client.call_tool("search_for", {"thing": "sofa"}))
        for _ in range(40):
            if answer["state"] not in ("look", "driving", "reported"):
                break
            answer = report_of(await client.call_tool("search_for", asked))
    assert answer["state"] == "not_found"
    assert answer["places_seen"]
    assert answer["seen_percent"] > 70


async def test_a_robot_without_a_camera_searches_for_nothing(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms(), has_camera=False)
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        result = await client.call_tool("search_for", {"thing": "sofa"})
    assert result.is_error
    assert "no camera" in text_of(result)


async def _look_everywhere(client: Client) -> int:
    """Explores with a picture all around at every pause; gives how many pictures were taken."""
    n_pictures = 0
    for _ in range(20):
        answer = await client.call_tool("explore", {"stops_at_goals": True, "wait_s": 25.0})
        around = await client.call_tool("look_around", {})
        n_pictures += len(pictures_of(answer)) + len(pictures_of(around))
        if report_of(answer)["state"] not in ("driving", "at_goal"):
            break
    return n_pictures


async def test_a_search_begins_from_what_the_detector_has_read_already(tmp_path: Path) -> None:
    asked = {"thing": "sofa", "seen": False, "wait_s": 25.0}
    robot = RoamingRobot(world_from_text(THREE_ROOMS, start=(1.0, 2.2)), has_detector=True)
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        n_pictures = len(pictures_of(await client.call_tool("look_around", {})))
        first = report_of(await client.call_tool("search_for", {**asked, "seen": None}))
        answers = [first]
        while answers[-1]["state"] in ("look", "driving") and len(answers) < 40:
            answers.append(report_of(await client.call_tool("search_for", asked)))
    assert first["n_earlier"] == n_pictures
    assert f"{n_pictures} earlier pictures count as looked at, and had none" in first["reason"]
    assert first["seen_percent"] > 20
    assert "earlier" not in answers[1]["reason"]
    last = answers[-1]
    assert (last["state"], last["n_earlier"]) == ("not_found", 0)
    assert last["seen_percent"] > 70


async def test_a_picture_in_which_the_thing_was_written_down_does_not_count_as_without_it(
    tmp_path: Path,
) -> None:
    robot = RoamingRobot(world_from_text(HALL_AND_ROOM, start=(1.0, 1.4)), has_detector=True)
    async with connect(robot, tmp_path, toolsets=(*TOOLSETS, "look", "paper")) as client:
        await client.call_tool("look_through_camera", {})
        bench = {"label": "bench", "bearing_deg": 5, "picture": "P1"}
        note = {"name": "hall", "description": "A hall.", "functional_landmarks": [bench]}
        report_of(await client.call_tool("write_semantic_data", note))
        of_bench = report_of(await client.call_tool("search_for", {"thing": "bench"}))
        of_sofa = report_of(await client.call_tool("search_for", {"thing": "sofa"}))
    # For the sofa counts the picture of the first search, too.
    assert of_bench["n_earlier"] == 0
    assert "2 earlier pictures count as looked at, and had none" in of_sofa["reason"]
    assert "had none" not in of_bench["reason"]
    # The detector looks on the way, too: nothing is left to look at anew.
    assert (of_sofa["state"], of_sofa["n_looks"], of_sofa["n_earlier"]) == ("not_found", 0, 0)
    assert of_sofa["seen_percent"] > 95


async def test_pictures_that_nobody_read_for_the_thing_do_not_count(tmp_path: Path) -> None:
    robot = RoamingRobot(world_from_text(HALL_AND_ROOM, start=(1.0, 1.4)))
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        n_pictures = await _look_everywhere(client)
        asked = {"thing": "sofa", "max_looks": 2}
        first = report_of(await client.call_tool("search_for", asked))
        answer = first
        while answer["state"] != "budget_spent":
            answer = report_of(await client.call_tool("search_for", {**asked, "seen": False}))
        again = report_of(await client.call_tool("search_for", asked))
        other = report_of(await client.call_tool("search_for", {"thing": "lamp"}))
    assert first["n_earlier"] == 0
    assert f"{n_pictures} earlier pictures do not count" in first["reason"]
    assert first["seen_percent"] < 60
    assert again["n_earlier"] == 2
    assert again["seen_percent"] >= answer["seen_percent"]
    assert other["n_earlier"] == 0


async def test_pictures_of_a_map_that_was_left_do_not_count_in_a_later_search(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms())
    asked = {"thing": "sofa", "max_looks": 2, "wait_s": 25.0}
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        answer = report_of(await client.call_tool("search_for", asked))
        while answer["state"] != "budget_spent":
            answer = report_of(await client.call_tool("search_for", {**asked, "seen": False}))
        same_map = report_of(await client.call_tool("search_for", asked))
        await client.call_tool("search_for", {**asked, "seen": True})
        robot.grid = two_rooms().crop(slice(0, 6), slice(0, 12))
        new_map = report_of(await client.call_tool("search_for", asked))
    assert same_map["n_earlier"] == 2
    assert new_map["n_earlier"] == 0


class SofaSeeingRobot(FakeRobot):
    """A robot whose detector reports a sofa wherever it looks east of x = 5 m."""

    async def fetch_detections(self) -> tuple[Detection, ...]:
        label = "red sofa" if self.pose.x > 5.0 else "plant"
        return (Detection(label=label, confidence_ratio=0.9, bearing_rad=0.0, range_m=None),)


async def test_a_search_begins_where_the_detector_has_reported_the_thing(tmp_path: Path) -> None:
    robot = SofaSeeingRobot(two_rooms())
    robot.detections = (
        Detection(label="plant", confidence_ratio=0.9, bearing_rad=0.0, range_m=None),
    )
    async with connect(robot, tmp_path, toolsets=(*TOOLSETS, "look")) as client:
        await client.call_tool("look_through_camera", {})
        robot.pose = Pose(6.0, 1.4, 0.0)
        await client.call_tool("look_through_camera", {})
        robot.pose = Pose(1.5, 1.4, 0.0)
        answer = report_of(await client.call_tool("search_for", {"thing": "sofa"}))
    assert "reported it in 1 earlier picture: look again from P2" in answer["reason"]
    assert answer["looks_at"].startswith("P2: the detector reported it in this picture, taken ")
    assert answer["state"] == "reported"
    assert robot.pose.x > 5.0


async def test_a_search_where_all_was_looked_at_already_says_so_and_looks_anew(
    tmp_path: Path,
) -> None:
    async with connect(_robot(), tmp_path, toolsets=TOOLSETS) as client:
        await _look_everywhere(client)
        first = report_of(await client.call_tool("search_for", {"thing": "sofa"}))
    assert re.search(r"\d+ earlier pictures count .* Nothing new is left", first["reason"])
    assert first["state"] == "look"
