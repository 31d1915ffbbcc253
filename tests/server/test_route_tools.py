from pathlib import Path

import pytest
from mcp.client import Client

from fakes import SPEED_MPS, FakeRobot, two_rooms
from guarding import make_guard
from mapspeak.geometry import Pose
from mapspeak.robot import GoalState
from served import connect, pictures_of, report_of, text_of

pytestmark = pytest.mark.anyio

TOOLSETS = ("routes", "drive", "places", "paper")


async def _remember(client: Client, name: str, x: float, label: str) -> None:
    record = {"name": name, "description": "", "safety_landmarks": [label], "x": x, "y": 1.4}
    await client.call_tool("write_semantic_data", record)


async def test_a_route_is_followed_to_its_end_stop_by_stop(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        answer = report_of(await client.call_tool("follow_route", {"stops": ["D1", "6, 1.4, 90"]}))
    assert answer["state"] == "done"
    assert answer["done"] == ["D1", "(6.00, 1.40)"]
    assert answer["legs_m"] == pytest.approx([1.9, 2.6], abs=0.3)
    assert answer["greedy_m"] is None
    assert answer["robot"] == {"x": 6.0, "y": 1.4, "yaw_deg": 90.0}


async def test_a_stop_without_a_heading_is_come_to_straight_from_the_stop_before(
    tmp_path: Path,
) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=TOOLSETS) as client:
        stops = ["6.0, 1.4", "2.6, 1.4"]
        answer = report_of(await client.call_tool("follow_route", {"stops": stops}))
    assert answer["state"] == "done"
    assert abs(answer["robot"]["yaw_deg"]) == pytest.approx(180, abs=30)


async def test_a_long_route_goes_on_with_the_next_call(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    stops = ["3.0, 1.4", "6, 1.4", "2.0, 1.4"]
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        first = report_of(await client.call_tool("follow_route", {"stops": stops, "wait_s": 2.0}))
        assert first["state"] == "driving"
        assert (len(first["done"]), len(first["remaining"])) == (1, 1)
        assert first["next"] == "(6.00, 1.40)"
        assert "without stops" in first["next_step"]
        last = report_of(await client.call_tool("follow_route", {"wait_s": 25.0}))
    assert last["state"] == "done"
    assert last["robot"]["x"] == 2.0


async def test_the_answer_tells_what_the_nearest_choice_would_have_cost(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms(), pose=Pose(3.0, 1.4))
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        await _remember(client, "west", 2.0, "extinguisher")
        await _remember(client, "east", 5.0, "extinguisher")
        await _remember(client, "door", 6.5, "exit")
        answer = report_of(
            await client.call_tool("follow_route", {"stops": ["extinguisher", "exit"]})
        )
    assert [each.split(",")[0] for each in answer["done"]] == ["extinguisher (T2)", "exit"]
    assert answer["greedy_m"] > answer["total_m"] + 1.0


async def test_a_route_is_only_planned_where_asked_and_the_one_under_way_goes_on(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        first = {"stops": ["6, 1.4"], "wait_s": 1.0}
        under_way = report_of(await client.call_tool("follow_route", first))
        asked = {"stops": ["R1", "R2", "D1"], "order": "shortest", "drive": False}
        plan = report_of(await client.call_tool("follow_route", asked))
        assert len(robot.goals) == 1
        last = report_of(await client.call_tool("follow_route", {"wait_s": 25.0}))
        driven = report_of(await client.call_tool("follow_route", {**asked, "drive": True}))
        again = report_of(await client.call_tool("follow_route", {**asked, "pause_s": 10.0}))
    assert under_way["state"] == "driving"
    assert (plan["state"], plan["done"], plan["total_s"]) == ("planned", [], None)
    assert [plan["next"], *plan["remaining"]] != ["R1", "R2", "D1"]
    assert plan["total_m"] == pytest.approx(sum(plan["legs_m"]), abs=0.2)
    assert (last["state"], last["done"]) == ("done", ["(6.00, 1.40)"])
    assert driven["state"] == "done"
    assert again["total_s"] >= 30.0 + again["total_m"] / SPEED_MPS - 1.0


async def test_a_plan_without_stops_is_refused(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=TOOLSETS) as client:
        refused = await client.call_tool("follow_route", {"drive": False})
    assert refused.is_error
    assert "stops" in text_of(refused)


async def test_a_look_at_each_stop_comes_with_a_picture_and_pauses_the_route(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms())
    request = {"stops": ["D1", "R1"], "look": True}
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        first = await client.call_tool("follow_route", request)
        second = await client.call_tool("follow_route", {})
        third = await client.call_tool("follow_route", {})
    assert [report_of(each)["state"] for each in (first, second, third)] == [
        "at_stop",
        "at_stop",
        "done",
    ]
    assert [len(pictures_of(each)) for each in (first, second, third)] == [1, 1, 0]


async def test_the_robot_stands_at_a_stop_as_long_as_was_asked_for(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    request = {"stops": ["2.5, 1.4", "1.5, 1.4"], "pause_s": 30.0, "wait_s": 20.0}
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        first = report_of(await client.call_tool("follow_route", request))
        assert first["reason"] == "The robot pauses at a stop."
        assert first["robot"]["x"] == 2.5
        await client.call_tool("follow_route", {"wait_s": 15.0})
        last = report_of(await client.call_tool("follow_route", {"wait_s": 25.0}))
        assert last["state"] == "driving"
        last = report_of(await client.call_tool("follow_route", {"wait_s": 25.0}))
    assert last["state"] == "done"
    assert robot.now_s >= 60.0


async def test_a_route_goes_on_after_the_robot_was_stopped(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        await client.call_tool("follow_route", {"stops": ["6, 1.4"], "wait_s": 1.0})
        await client.call_tool("cancel_goal", {})
        answer = report_of(await client.call_tool("follow_route", {}))
    assert answer["state"] == "done"
    assert len(robot.goals) == 2


class DistractedRobot(FakeRobot):
    """Is sent elsewhere by somebody else during its first drive."""

    async def sleep(self, duration_s: float) -> None:
        await super().sleep(duration_s)
        if len(self.goals) == 1 and not self.ended:
            self._end(GoalState.PREEMPTED)


async def test_a_goal_from_elsewhere_interrupts_the_route_until_the_next_call(
    tmp_path: Path,
) -> None:
    async with connect(DistractedRobot(two_rooms()), tmp_path, toolsets=TOOLSETS) as client:
        answer = report_of(await client.call_tool("follow_route", {"stops": ["6, 1.4"]}))
        resumed = report_of(await client.call_tool("follow_route", {}))
    assert answer["state"] == "interrupted"
    assert "preempted" in answer["reason"]
    assert resumed["state"] == "done"


class StubbornRobot(FakeRobot):
    """Cannot get to places east of 5 m."""

    async def send_goal(self, goal: Pose) -> str:
        goal_id = await super().send_goal(goal)
        if goal.x > 5.0:
            self._end(GoalState.BLOCKED)
        return goal_id


@pytest.mark.parametrize(
    ("when_blocked", "state", "next_stop"),
    [("wait", "blocked", "(6.00, 1.40)"), ("skip", "done", "")],
)
async def test_a_blocked_stop_says_so_and_waits_or_is_left_out(
    tmp_path: Path, when_blocked: str, state: str, next_stop: str
) -> None:
    robot = StubbornRobot(two_rooms())
    request = {"stops": ["6, 1.4", "2.0, 1.4"], "when_blocked": when_blocked}
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        answer = report_of(await client.call_tool("follow_route", request))
    assert answer["state"] == state
    assert answer["next"] == next_stop
    assert len(answer["skipped"]) == (when_blocked == "skip")
    assert "blocked" in answer["reason"] + "".join(answer["skipped"])


async def test_a_stop_that_waits_may_be_left_out_with_the_next_call(tmp_path: Path) -> None:
    robot = StubbornRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        await client.call_tool("follow_route", {"stops": ["6, 1.4", "2.0, 1.4"]})
        answer = report_of(await client.call_tool("follow_route", {"when_blocked": "skip"}))
    assert answer["state"] == "done"
    assert answer["done"] == ["(2.00, 1.40)"]


async def test_new_stops_take_the_place_of_the_route_before(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        await client.call_tool("follow_route", {"stops": ["6, 1.4", "D1"], "wait_s": 0.5})
        answer = report_of(await client.call_tool("follow_route", {"stops": ["2, 1.4"]}))
    assert answer["state"] == "done"
    assert answer["done"] == ["(2.00, 1.40)"]


@pytest.mark.parametrize(
    ("request_", "says"),
    [
        ({}, "no route to continue"),
        ({"stops": []}, "1 to 20 stops"),
        ({"stops": ["D1", "the moon"]}, "Stop 2: There is no place called"),
    ],
)
async def test_a_route_that_makes_no_sense_moves_nothing(
    tmp_path: Path, request_: dict[str, object], says: str
) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        result = await client.call_tool("follow_route", request_)
    assert result.is_error
    assert says in text_of(result)
    assert not robot.goals


async def test_a_phrase_goes_into_every_tool_that_takes_a_place_and_comes_with_its_reason(
    tmp_path: Path,
) -> None:
    words, reason = "right of D1", "right of D1 as seen from the robot in R2"
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=TOOLSETS) as client:
        checked = report_of(await client.call_tool("check_goal", {"place": words}))
        described = text_of(await client.call_tool("describe_place", {"place": words}))
        measured = text_of(await client.call_tool("measure", {"places": [words]}))
        driven = report_of(await client.call_tool("navigate_to", {"place": words}))
    assert checked["verdict"] == "ok"
    assert reason in checked["reason"]
    assert reason in described
    assert reason in measured
    assert driven["place"].startswith(f"{words}: ")
    assert reason in driven["place"]
    assert driven["robot"] == checked["pose"]


async def test_a_thing_found_by_a_phrase_drives_under_its_own_id(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=TOOLSETS) as client:
        answer = report_of(await client.call_tool("navigate_to", {"place": "the nearest door"}))
        asked = report_of(await client.call_tool("wait_for_goal", {}))
    assert answer["place"].startswith("D1: the nearest door, ")
    assert asked["place"] == "D1"


async def test_an_ambiguous_phrase_is_answered_with_the_candidates(tmp_path: Path) -> None:
    seen = {"label": "chair", "bearing_deg": 0, "range_m": 0.5}
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=TOOLSETS) as client:
        for name, x in (("west", 1.5), ("east", 5.0)):
            record = {"name": name, "description": "", "functional_landmarks": [seen]}
            await client.call_tool("write_semantic_data", {**record, "x": x, "y": 1.4})
        result = await client.call_tool("navigate_to", {"place": "next to the chair"})
    assert result.is_error
    assert "T1 at " in text_of(result)
    assert "T2 at " in text_of(result)


async def test_stops_are_driven_past_on_the_shortest_way_where_asked(tmp_path: Path) -> None:
    stops = ["6, 1.4", "2.0, 1.4", "4.5, 1.4"]
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=TOOLSETS) as client:
        given = {"stops": stops, "order": "shortest"}
        answer = report_of(await client.call_tool("follow_route", given))
    assert answer["done"] == ["(2.00, 1.40)", "(4.50, 1.40)", "(6.00, 1.40)"]
    assert answer["total_m"] == pytest.approx(4.5, abs=0.3)
    assert answer["as_given_m"] > answer["total_m"] + 4.0


async def test_a_route_ends_where_it_is_wanted_to_whatever_the_order(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        given = {"stops": ["6, 1.4", "2.5, 1.4"], "order": "shortest", "end_at": "start"}
        answer = report_of(await client.call_tool("follow_route", given))
    assert answer["done"][-1] == "start"
    assert (answer["robot"]["x"], answer["robot"]["yaw_deg"]) == (1.5, 0.0)
    assert len(robot.goals) == 3


async def test_all_rooms_are_driven_past_and_looked_around_in(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    n_pictures, done = [], []
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        given = {"stops": ["all rooms"], "order": "shortest", "look_around": True}
        result = await client.call_tool("follow_route", given)
        while report_of(result)["state"] == "at_stop":
            n_pictures.append(len(pictures_of(result)))
            result = await client.call_tool("follow_route", {})
        done = report_of(result)["done"]
    assert n_pictures == [5, 5], "of 90 degrees each, overlapping"
    assert sorted(done) == ["R1", "R2"]


async def test_a_stop_while_it_looks_around_ends_it_there(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        given = {"stops": ["R1", "R2"], "look_around": True}
        await client.call_tool("follow_route", given)
        n_goals = len(robot.goals)
        await client.call_tool("stop_robot", {})
        assert len(robot.goals) == n_goals
        waited = report_of(await client.call_tool("wait_for_goal", {"wait_s": 1}))
    assert waited["state"] != "driving"


async def test_an_end_that_nobody_knows_is_an_error_before_anything_moves(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, toolsets=TOOLSETS) as client:
        result = await client.call_tool("follow_route", {"stops": ["R2"], "end_at": "R77"})
    assert result.is_error
    assert "R77" in text_of(result)
    assert not robot.goals


@pytest.mark.parametrize("drive", [True, False])
async def test_a_stop_behind_a_closure_is_skipped_from_the_plan_on(
    tmp_path: Path,
    drive: bool,  # noqa: FBT001 - a parameter of pytest
) -> None:
    robot, toolsets = FakeRobot(two_rooms()), (*TOOLSETS, "memory")
    async with connect(robot, tmp_path, toolsets=toolsets, guard=make_guard(tmp_path)) as client:
        shut = {"text": "locked", "place": "D1", "effect": "closed"}
        await client.call_tool("note_event", shut)
        call = {"stops": ["1.2, 1.4", "R1", "R2"], "when_blocked": "skip", "drive": drive}
        answer = report_of(await client.call_tool("follow_route", call))
        none = await client.call_tool("follow_route", {**call, "stops": ["R1"]})
        unknown = await client.call_tool("follow_route", {**call, "stops": ["kitchen", "R2"]})
        waits = await client.call_tool("follow_route", {**call, "when_blocked": "wait"})
    assert answer["state"] == ("done" if drive else "planned")
    assert len(answer["skipped"]) == 1
    assert answer["skipped"][0].startswith("R1")
    assert "closed by event E1" in answer["skipped"][0]
    assert "No stop can be reached" in text_of(none)
    assert "Stop 1" in text_of(unknown)
    assert "Stop 2" in text_of(waits)
