import math
from pathlib import Path

import anyio
import numpy as np
import pytest
from mcp_types import CallToolResult

from drawing import grid_from_text
from failing_robot import FailingRobot
from fakes import FakeRobot, two_rooms
from mapspeak.driving.drivereport import DriveReport
from mapspeak.geometry import Point, Pose
from mapspeak.memory import SemanticMapStore
from mapspeak.robot import GoalState, StampedPose
from mapspeak.server.app import DEFAULT_TOOLSETS
from mapspeak.session import Session
from mapspeak.spatial import OccupancyGrid
from served import MODES, connect, report_of, text_of

pytestmark = pytest.mark.anyio

ONE_ROOM = """
##############################
#################............#
#################............#
#################............#
#################............#
#################............#
#################............#
##############################
"""


@pytest.mark.parametrize("mode", MODES)
async def test_a_short_drive_is_answered_with_arrived(tmp_path: Path, mode: str) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, mode=mode) as client:
        result = await client.call_tool("navigate_to", {"x": 2.0, "y": 1.4, "yaw_deg": 90})
    answer = report_of(result)
    assert answer["state"] == "arrived"
    assert answer["robot"] == {"x": 2.0, "y": 1.4, "yaw_deg": 90.0}


async def test_a_long_drive_is_a_job_that_can_be_asked_about(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        begun = report_of(
            await client.call_tool("navigate_to", {"x": 6.0, "y": 1.4, "wait_s": 1.0})
        )
        assert begun["state"] == "driving"
        assert begun["distance_left_m"] == pytest.approx(3.5, abs=0.3)
        ended = report_of(await client.call_tool("wait_for_goal", {"goal_id": begun["goal_id"]}))
    assert ended["state"] == "arrived"


async def test_the_id_of_a_room_is_a_goal(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        answer = report_of(await client.call_tool("navigate_to", {"place": "r2"}))
        pose = report_of(await client.call_tool("get_robot_pose", {}))
    assert answer["place"] == "R2"
    assert pose["place"] == "R2"


async def test_a_remembered_name_is_a_goal(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        await client.call_tool(
            "write_semantic_data", {"name": "Dock corner", "description": "a dock"}
        )
        await client.call_tool("navigate_to", {"x": 6.0, "y": 1.4})
        answer = report_of(await client.call_tool("navigate_to", {"place": "dock  CORNER"}))
    assert answer["robot"] == {"x": 1.5, "y": 1.4, "yaw_deg": 0.0}


async def test_what_is_like_the_words_only_in_meaning_is_named_and_not_driven_to(
    tmp_path: Path,
) -> None:
    record = {"name": "west", "description": "by the sink", "safety_landmarks": ["extinguisher"]}
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        await client.call_tool("write_semantic_data", record)
        result = await client.call_tool("navigate_to", {"place": "extinguisher for paper"})
    assert result.is_error
    assert "use T1" in text_of(result)
    assert robot.goals == {}


@pytest.mark.parametrize(
    ("goal", "says"),
    [
        ({"x": 3.3, "y": 0.7}, "nearest pose that works"),
        ({"x": 40.0, "y": 40.0}, "map"),
        ({"place": "R9"}, "R1"),
        ({"x": 1.0}, "both x and y"),
        ({}, "both x and y"),
        ({"place": "R1", "x": 1.0, "y": 1.0}, "either a place or both"),
        ({"x": "nan", "y": 0.0}, "finite"),
        ({"x": "inf", "y": 0.0}, "finite"),
    ],
)
async def test_a_goal_that_makes_no_sense_is_refused_with_the_next_step(
    tmp_path: Path, goal: dict[str, object], says: str
) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        result = await client.call_tool("navigate_to", goal)
    assert result.is_error
    assert says in text_of(result)
    assert not robot.goals


async def test_a_remembered_place_that_a_new_map_draws_a_cell_off_is_driven_to(
    tmp_path: Path,
) -> None:
    fine = np.kron(two_rooms().cells, np.ones((5, 5), dtype=np.int8))
    robot = FakeRobot(OccupancyGrid(cells=fine, resolution_m=0.05))
    async with connect(robot, tmp_path) as client:
        bench = {"name": "bench", "description": "", "x": 6.02, "y": 1.02}
        await client.call_tool("write_semantic_data", bench)
        cells = fine.copy()
        cells[:, round(6.0 / 0.05) :] = -1
        robot.grid = OccupancyGrid(cells=cells, resolution_m=0.05)
        blocked = text_of(await client.call_tool("what_is_blocked", {}))
        result = await client.call_tool("navigate_to", {"place": "bench"})
    assert "bench" not in blocked
    assert not result.is_error, text_of(result)
    (goal,) = robot.goals.values()
    assert goal.point.distance_to(Point(6.02, 1.02)) < 0.1


async def test_a_newer_goal_replaces_the_older_one(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        first = report_of(await client.call_tool("navigate_to", {"place": "R2", "wait_s": 0}))
        await client.call_tool("navigate_to", {"x": 2.0, "y": 1.4})
        asked = await client.call_tool("wait_for_goal", {"goal_id": first["goal_id"]})
    assert report_of(asked)["state"] == "preempted"


async def test_a_cancelled_drive_is_cancelled(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        await client.call_tool("navigate_to", {"place": "R2", "wait_s": 0})
        answer = text_of(await client.call_tool("cancel_goal", {}))
    assert "G1 to R2: cancelled" in answer


async def test_stopping_ends_every_drive(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        await client.call_tool("navigate_to", {"place": "R2", "wait_s": 0})
        await client.call_tool("stop_robot", {})
        answer = report_of(await client.call_tool("wait_for_goal", {"wait_s": 0}))
    assert robot.n_stops == 1
    assert answer["state"] == "cancelled"


async def test_a_stop_holds_for_a_goal_that_is_still_being_checked(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    answers: dict[str, CallToolResult] = {}
    async with connect(robot, tmp_path) as client, anyio.create_task_group() as tasks:

        async def navigate() -> None:
            answers["drive"] = await client.call_tool("navigate_to", {"place": "R2"})

        async def stop_when_asked_for_the_map() -> None:
            await robot.map_was_asked_for.wait()
            await client.call_tool("stop_robot", {})
            robot.may_give_map.set()

        robot.may_give_map = anyio.Event()
        tasks.start_soon(navigate)
        tasks.start_soon(stop_when_asked_for_the_map)
    assert answers["drive"].is_error
    assert "stopped" in text_of(answers["drive"])
    assert not robot.goals


async def test_who_gives_up_waiting_for_a_drive_gives_up_the_drive(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    session = Session(robot, SemanticMapStore(tmp_path / "m.yaml"), lease_s=60.0)
    with session.drives.preparing() as ticket:
        drive = await session.drives.start(Pose(6.0, 1.4), place="there", ticket=ticket)
    with anyio.CancelScope() as scope:

        async def give_up(_report: DriveReport) -> None:
            scope.cancel()
            await anyio.lowlevel.checkpoint()

        await session.drives.wait(drive.goal_id, wait_s=20.0, on_progress=give_up)
    assert (await session.drives.report()).status.state is GoalState.CANCELLED


async def test_an_argument_that_does_not_exist_is_not_dropped_without_a_word(
    tmp_path: Path,
) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        result = await client.call_tool("navigate_to", {"place": "R2", "yaw": 90})
    assert result.is_error
    assert "no argument yaw; it has: as_near, place, wait_s, x, y, yaw_deg" in text_of(result)


async def test_a_goal_id_that_nobody_gave_is_an_error(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        nothing_yet = await client.call_tool("wait_for_goal", {})
        await client.call_tool("navigate_to", {"x": 2.0, "y": 1.4})
        unknown = await client.call_tool("cancel_goal", {"goal_id": "G77"})
    assert "navigate_to" in text_of(nothing_yet)
    assert unknown.is_error
    assert "G1" in text_of(unknown)


async def test_true_is_no_number_of_metres(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        drive = await client.call_tool("navigate_to", {"x": True, "y": 1.0})
        look = await client.call_tool("look_at_map", {"radius_m": True})
    assert drive.is_error
    assert "wants a number for x" in text_of(drive)
    assert look.is_error
    assert robot.goals == {}


async def test_a_drive_that_somebody_else_has_begun_is_told(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    robot.foreign_goals = (GoalState.DRIVING,)
    async with connect(robot, tmp_path) as client:
        answer = await client.call_tool("wait_for_goal", {"wait_s": 0})
    assert answer.is_error
    assert "follows a goal that was not sent from here: driving" in text_of(answer)


async def test_a_robot_that_another_client_drives_on_does_not_stand_at_the_goal(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        arrived = report_of(await client.call_tool("navigate_to", {"x": 2.0, "y": 1.4}))
        robot.foreign_goals = (GoalState.DRIVING,)
        later = report_of(await client.call_tool("wait_for_goal", {}))
    assert arrived["next_step"] == ""
    assert later["state"] == "arrived"
    assert "Another client's goal drives the robot now" in later["next_step"]


async def test_a_pose_that_is_old_by_robot_time_is_doubted(tmp_path: Path) -> None:
    class Forgetful(FakeRobot):
        async def fetch_pose(self) -> StampedPose:
            return StampedPose(self.pose, 0.0)

    robot = Forgetful(two_rooms())
    async with connect(robot, tmp_path) as client:
        fresh = report_of(await client.call_tool("get_robot_pose", {}))
        await robot.sleep(12.0)
        old = report_of(await client.call_tool("get_robot_pose", {}))
    assert fresh["pose_uncertain"] == ""
    assert old["age_s"] == 12.0
    assert old["pose_uncertain"].startswith("old_pose: the pose is 12 s old")


async def test_a_robot_that_was_moved_after_it_arrived_does_not_stand_at_the_goal(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        await client.call_tool("navigate_to", {"x": 2.0, "y": 1.4})
        robot.pose = Pose(2.0, 0.6)
        later = report_of(await client.call_tool("wait_for_goal", {}))
    assert later["distance_left_m"] == 0.8
    assert "0.80 m from the goal now" in later["next_step"]


async def test_a_goal_in_a_wall_is_taken_as_near_as_possible_where_that_is_asked_for(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        refused = await client.call_tool("navigate_to", {"x": 0.0, "y": 0.0})
        near = report_of(
            await client.call_tool("navigate_to", {"x": 0.0, "y": 0.0, "as_near": True})
        )
    assert refused.is_error
    assert near["state"] == "arrived"
    assert near["place"] == "as near to (0.00, 0.00) as possible"
    assert math.hypot(near["robot"]["x"], near["robot"]["y"]) < 1.0


async def test_a_wait_that_is_too_long_is_shortened(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        answer = report_of(await client.call_tool("navigate_to", {"place": "R2", "wait_s": 3600}))
        waited = await client.call_tool("wait_for_goal", {"wait_s": 30})
        wrong = await client.call_tool("wait_for_goal", {"wait_s": "long"})
    assert answer["state"] == "arrived"
    assert not waited.is_error
    assert wrong.is_error


async def test_a_drive_whose_robot_falls_silent_is_told_with_its_id_and_why(
    tmp_path: Path,
) -> None:
    robot = FailingRobot()
    async with connect(robot, tmp_path) as client:
        begun = report_of(await client.call_tool("navigate_to", {"place": "R2", "wait_s": 2}))
        robot.tells_pose = False
        blind = report_of(await client.call_tool("wait_for_goal", {"wait_s": 1}))
        robot.is_reachable = False
        away = report_of(await client.call_tool("wait_for_goal", {"wait_s": 1}))
    assert (begun["pose_uncertain"], begun["pose_age_s"]) == ("", None)
    for answer, code in ((blind, "no_pose: "), (away, "no_answer: ")):
        assert (answer["goal_id"], answer["state"]) == ("G1", "driving")
        assert answer["pose_uncertain"].startswith(code)
    assert "No transform has come." in blind["pose_uncertain"]
    assert away["pose_age_s"] == 2.0


async def test_a_robot_that_has_to_be_stopped_and_cannot_be_is_told_so(tmp_path: Path) -> None:
    robot = FailingRobot()
    async with connect(robot, tmp_path) as client:
        await client.call_tool("navigate_to", {"place": "R2", "wait_s": 0})
        robot.is_reachable = False
        stopped = await client.call_tool("stop_robot", {})
        answer = report_of(await client.call_tool("wait_for_goal", {"wait_s": 0}))
    assert "NOT STOPPED" in text_of(stopped)
    assert "NOT STOPPED" in answer["next_step"]


async def test_odometry_for_want_of_a_pose_is_told_wherever_the_pose_is(tmp_path: Path) -> None:
    robot = FailingRobot()
    robot.has_map_pose = False
    async with connect(robot, tmp_path, toolsets=(*DEFAULT_TOOLSETS, "explore")) as client:
        looked = text_of(await client.call_tool("look_at_map", {}))
        pose = report_of(await client.call_tool("get_robot_pose", {}))
        drive = report_of(await client.call_tool("navigate_to", {"place": "R2", "wait_s": 0}))
        cancelled = text_of(await client.call_tool("cancel_goal", {}))
        explored = report_of(await client.call_tool("explore", {"wait_s": 1}))
        written = report_of(
            await client.call_tool("write_semantic_data", {"name": "Dock", "description": "a dock"})
        )
        drawn = text_of(await client.call_tool("draw_robot_pose", {}))
    for told in (pose, drive, explored):
        assert told["pose_uncertain"].startswith("odometry: ")
    for text in (looked, cancelled, *written["warnings"], drawn):
        assert "odometry: it is odometry, which drifts" in text


async def test_arriving_is_not_told_as_standing_there_while_the_pose_is_uncertain(
    tmp_path: Path,
) -> None:
    robot = FailingRobot()
    async with connect(robot, tmp_path) as client:
        begun = report_of(await client.call_tool("navigate_to", {"x": 2.0, "y": 1.4, "wait_s": 0}))
        robot.freeze_pose()
        await robot.sleep(15.0)
        ended = report_of(await client.call_tool("wait_for_goal", {}))
    assert begun["state"] == "driving"
    assert ended["state"] == "arrived"
    assert ended["pose_uncertain"].startswith("old_pose: the pose is 15 s old")
    assert "the pose is uncertain" in ended["next_step"]


async def test_the_room_is_that_of_the_new_world_after_a_simulation_was_begun_anew(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms())
    await robot.sleep(100.0)
    async with connect(robot, tmp_path) as client:
        before = report_of(await client.call_tool("get_robot_pose", {}))
        robot.grid = grid_from_text(ONE_ROOM, resolution_m=0.25)
        robot.set_clock(1.0)
        after = report_of(await client.call_tool("get_robot_pose", {}))
    assert before["place"] == "R2"
    assert after["place"] == "no room"


@pytest.mark.parametrize("ending", ["cancel_goal", "navigate_to"])
async def test_a_drive_that_has_ended_says_nothing_of_the_robot_that_a_later_drive_makes_false(
    tmp_path: Path, ending: str
) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        far = {"x": 6.0, "y": 1.4, "wait_s": 0}
        await client.call_tool("navigate_to", far)
        if ending == "cancel_goal":
            await client.call_tool("cancel_goal", {})
        await client.call_tool("navigate_to", far | {"y": 1.5})
        cancelled = report_of(
            await client.call_tool("wait_for_goal", {"goal_id": "G1", "wait_s": 0})
        )
        await client.call_tool("stop_robot", {})
        replaced = report_of(
            await client.call_tool("wait_for_goal", {"goal_id": "G1", "wait_s": 0})
        )
    assert "stands still" not in cancelled["next_step"]
    assert "under way" not in replaced["next_step"]


async def test_a_stop_with_words_beside_it_is_a_stop(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        answer = await client.call_tool("stop_robot", {"reason": "a person stands in the way"})
    assert not answer.is_error
    assert robot.n_stops == 1
