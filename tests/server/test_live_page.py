"""The live page: what a browser is told, and what a person may do from it."""

import io
import json
import math
import re
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Never

import anyio
import numpy as np
import pytest
from PIL import Image

from fakes import FakeRobot, two_rooms
from guarding import audit_of, make_guard
from livepage import next_of, serve_live
from mapspeak.errors import ConfigError, LinkError, MapError
from mapspeak.geometry import Point
from mapspeak.robot import (
    CameraPicture,
    NavigationLook,
    NavigationPart,
    RobotDescription,
    StampedPose,
)
from mapspeak.safety import Approval, CommandKind, Otherwise, Policy
from mapspeak.safety.approvals import VALID_S
from mapspeak.server.view.keys import PageKeys
from mapspeak.server.view.site import serve_view
from mapspeak.session import Session

pytestmark = pytest.mark.anyio

HOSTILE = "<script>alert(1)</script> \u202e fire \x07"


# --- what a page is told ---------------------------------------------------------------------


async def test_a_page_is_told_first_how_everything_stands(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live:
        await live.client.call_tool("look_at_map", {})
        calls, grid = await live.wait_for("calls"), await live.wait_for("map")
        overlay, robot = await live.wait_for("overlay", "doors"), await live.wait_for("robot")
    assert [call["tool"] for call in calls] == ["look_at_map"]
    assert (grid["n_rows"], grid["n_cols"], grid["resolution_m"]) == (11, 30, 0.25)
    assert {region["id"] for region in overlay["regions"]} == {"R1", "R2"}
    assert [door["id"] for door in overlay["doors"]] == ["D1"]
    assert robot["pose"] == {"x": 1.5, "y": 1.4, "yaw_deg": 0.0}


async def test_the_tiles_show_the_map_with_its_upper_edge_on_top(tmp_path: Path) -> None:
    grid = two_rooms()
    async with serve_live(tmp_path) as live:
        (name,) = (await live.wait_for("map"))["tiles"][0]
        png = (await live.http.get(f"/robots/robot/tiles/0/0/{name}.png")).content
    grey = np.asarray(Image.open(io.BytesIO(png)).convert("L"))
    assert grey.shape == grid.cells.shape
    assert ((grey == 0) == grid.occupied[::-1]).all()


async def test_of_a_map_that_grows_only_the_tiles_that_changed_have_new_names(
    tmp_path: Path,
) -> None:
    cells = np.full((600, 600), -1, dtype=np.int8)
    cells[:250, :] = 0
    big = type(two_rooms())(cells=cells, resolution_m=0.05, origin=two_rooms().origin)
    grown = cells.copy()
    grown[300:310, 20:40] = 100
    robot = FakeRobot(big)
    async with serve_live(tmp_path, robot) as live, live.hear() as events:
        before = (await next_of(events, "map"))["tiles"]
        robot.grid = type(big)(cells=grown, resolution_m=0.05, origin=big.origin)
        after = (await next_of(events, "map"))["tiles"]
    changed = [(r, c) for r in range(3) for c in range(3) if before[r][c] != after[r][c]]
    assert changed == [(1, 0)]
    assert before[2] == ["", "", ""]


async def test_a_call_is_told_when_it_begins_and_with_its_answer_and_pictures(
    tmp_path: Path,
) -> None:
    async with serve_live(tmp_path) as live, live.hear() as events:
        await next_of(events, "robot")
        result = await live.client.call_tool("look_through_camera", {})
        begun, ended = await next_of(events, "call"), await next_of(events, "call")
        picture = await live.http.get("/robots/robot/calls/1/0")
        missing = await live.http.get("/robots/robot/calls/1/1")
    assert (begun["is_over"], ended["is_over"], ended["is_error"]) == (False, True, False)
    assert ended["text"] in str(result.content)
    assert ended["pictures"] == ["calls/1/0"]
    assert picture.headers["content-type"] == "image/jpeg"
    assert missing.status_code == 404


async def test_a_refused_call_is_told_as_refused(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live:
        await live.client.call_tool("navigate_to", {"place": "R77"})
        (call,) = await live.wait_for("calls")
    assert call["is_error"]
    assert "There is no place called 'R77'" in call["text"]


async def test_a_drive_is_told_with_its_way(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live, live.hear() as events:
        await live.client.call_tool("navigate_to", {"place": "R2", "wait_s": 0})
        drive = None
        while not drive or not drive["path"]:
            drive = (await next_of(events, "robot"))["drive"]
    assert (drive["id"], drive["place"]) == ("G1", "R2")
    assert drive["path"][0] == [pytest.approx(1.5, abs=0.3), pytest.approx(1.4, abs=0.3)]


async def test_a_drive_to_a_thing_that_has_arrived_tells_how_far_that_is(tmp_path: Path) -> None:
    seen = {"label": "fridge", "bearing_deg": 0, "range_m": 5.9}
    record = {"name": "kitchenette", "description": "A room.", "functional_landmarks": [seen]}
    async with serve_live(tmp_path, toolsets=("drive", "paper")) as live, live.hear() as events:
        await live.client.call_tool("write_semantic_data", record)
        await live.client.call_tool("navigate_to", {"place": "T1"})
        drive = None
        while not drive or drive["state"] != "arrived":
            drive = (await next_of(events, "robot"))["drive"]
    assert "T1 is " in drive["reason"]


async def test_a_robot_without_a_map_yet_is_shown_by_its_pose(tmp_path: Path) -> None:
    async with serve_live(tmp_path, FakeRobot(None)) as live:
        assert (await live.wait_for("robot", "pose"))["pose"]["x"] == 1.5


async def test_a_robot_that_is_lost_is_told_with_why(tmp_path: Path) -> None:
    class Lost(FakeRobot):
        async def fetch_pose(self) -> StampedPose:
            raise LinkError("The robot does not answer.", hint="Look at its network.")

    async with serve_live(tmp_path, Lost(two_rooms())) as live:
        assert "does not answer" in (await live.wait_for("robot", "fault"))["fault"]


async def test_a_robot_that_is_not_there_yet_has_a_page_that_says_so(tmp_path: Path) -> None:
    class Absent(FakeRobot):
        is_there = True

        @property
        def description(self) -> RobotDescription:
            return super().description if self.is_there else self._refuse()

        async def fetch_pose(self) -> StampedPose:
            return await super().fetch_pose() if self.is_there else self._refuse()

        async def stop(self) -> None:
            self._refuse()

        def _refuse(self) -> Never:
            raise LinkError("There is no robot yet.", hint="Start it.")

    robot = Absent(two_rooms())
    async with serve_live(tmp_path, robot) as live:
        robot.is_there = False
        assert "no robot yet" in (await live.wait_for("robot", "fault"))["fault"]
        assert (await live.http.get("/robots/robot/camera")).status_code == 503
        answer = await live.command("stop")
        assert (answer.status_code, "NOT STOPPED" in answer.text) == (409, True)
        await live.unlock()
        assert (await live.command("drive", x=1.0, y=1.0)).status_code == 409


async def test_many_pages_are_given_the_same_picture_of_the_camera(tmp_path: Path) -> None:
    class Slow(FakeRobot):
        n_pictures = 0

        async def fetch_picture(self, camera: str | None = None) -> CameraPicture:
            self.n_pictures += 1
            await may_come.wait()
            return await super().fetch_picture(camera)

    may_come, robot = anyio.Event(), Slow(two_rooms())
    async with serve_live(tmp_path, robot) as live, anyio.create_task_group() as tasks:
        for _ in range(10):
            tasks.start_soon(live.http.get, "/robots/robot/camera")
        await live.wait_for("alive")
        may_come.set()
    assert robot.n_pictures <= 2


async def test_a_person_chooses_among_the_cameras(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    robot.cameras = ("front", "rear")
    async with serve_live(tmp_path, robot) as live:
        told = await live.wait_for("robot")
        for camera, status in (("rear", 200), ("left", 503)):
            answer = await live.http.get("/robots/robot/camera", params={"camera": camera})
            assert answer.status_code == status
        assert (await live.wait_for("robot"))["camera_fov_deg"] is None
    assert told["cameras"] == ["front", "rear"]


async def test_a_mission_is_drawn_with_the_state_of_each_step_and_what_it_asks(
    tmp_path: Path,
) -> None:
    tree = "- wait: 1\n- ask: Is it open?\n  answers: ['yes', 'no']\n- wait: 2\n"
    async with serve_live(tmp_path, toolsets=("drive", "missions")) as live:
        await live.client.call_tool("save_mission", {"name": "patrol", "tree": tree})
        await live.client.call_tool("run_mission", {"name": "patrol"})
        asking = await live.wait_for("missions", "questions")
        await live.client.call_tool("answer_mission", {"answer": "yes"})
        await live.client.call_tool("skill_status", {"wait_s": 20})
        ended = await live.wait_for("missions", "is_over")
    assert asking["latest"]["tree"]["steps"][0]["said"] == "wait 1"
    assert asking["states"] == {"2": "succeeded", "3": "running"}
    assert "Is it open?" in asking["questions"][0]["said"]
    assert ended["states"] == {"2": "succeeded", "3": "succeeded", "4": "succeeded"}
    assert [each["name"] for each in ended["saved"]] == ["patrol"]


async def test_a_person_answers_what_a_mission_asks_in_their_own_name(tmp_path: Path) -> None:
    guard = make_guard(tmp_path)
    tree = "- look\n- ask: Is it open?\n  answers: [open, shut]\n"
    async with serve_live(tmp_path, guard=guard, toolsets=("drive", "missions")) as live:
        await live.client.call_tool("run_mission", {"tree": tree, "wait_s": 1})
        (asked,) = (await live.wait_for("missions", "questions"))["questions"]
        picture = await live.http.get(f"/robots/robot/{asked['picture']}")
        answers = {"question": asked["id"], "answer": "open"}
        locked = await live.command("answer", **answers)
        await live.unlock("Ada")
        wrong = await live.command("answer", **{**answers, "answer": "perhaps"})
        taken = await live.command("answer", **answers)
        again = await live.command("answer", **answers)
        ended = await live.wait_for("missions", "is_over")
        gone = await live.http.get(f"/robots/robot/{asked['picture']}")
    assert (asked["answers"], picture.headers["content-type"]) == (["open", "shut"], "image/jpeg")
    assert [each.status_code for each in (locked, wrong, taken, again)] == [403, 409, 200, 409]
    assert taken.text == "Q1 is answered: open."
    assert ended["questions"] == []
    assert gone.status_code == 404
    (line,) = (each for each in audit_of(tmp_path) if each.event == "answer")
    assert line.client == "Ada at the live page"


async def test_what_no_mission_asks_is_not_answered(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live:
        await live.unlock()
        answer = await live.command("answer", question="Q7", answer="yes")
        assert (answer.status_code, "No mission waits" in answer.text) == (409, True)
        assert (await live.command("answer", question="Q7", answer="")).status_code == 422


async def test_a_page_draws_what_the_robots_navigation_tells(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    path = (Point(1.5, 1.5), Point(3.0, 1.5))
    robot.navigation = (NavigationLook(part=NavigationPart.PLAN, age_s=0.4, lines=(path,)),)
    async with serve_live(tmp_path, robot) as live:
        told = (await live.http.get("/robots/robot/navigation")).json()
    (plan,) = told["parts"]
    assert (plan["part"], plan["lines"]) == ("plan", [[[1.5, 1.5], [3.0, 1.5]]])
    assert plan["said"].endswith("0.4 s old")
    assert "publishes no footprint" in told["said"]


async def test_the_camera_is_shown_where_there_is_one(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with serve_live(tmp_path, robot) as live:
        assert (await live.http.get("/robots/robot/camera")).status_code == 200
        robot.cameras = ()
        assert (await live.http.get("/robots/robot/camera")).status_code == 404


@pytest.mark.parametrize(
    "error", [MapError("There is no frame.", hint="Look at TF."), RuntimeError("a bug of ours")]
)
async def test_an_error_while_a_page_is_told_of_the_robot_does_not_end_its_server(
    tmp_path: Path, error: Exception
) -> None:
    class Odd(FakeRobot):
        n_looks = 0

        async def fetch_pose(self) -> StampedPose:
            self.n_looks += 1
            if 1 < self.n_looks < 4:
                raise error
            return await super().fetch_pose()

    async with serve_live(tmp_path, robot := Odd(two_rooms())) as live, live.hear() as events:
        while robot.n_looks < 4:
            await next_of(events, "alive")
        assert (await live.command("stop")).status_code == 200


async def test_calls_with_long_arguments_and_answers_are_kept_within_bounds(
    tmp_path: Path,
) -> None:
    async with serve_live(tmp_path) as live:
        for _ in range(30):
            long = {"name": "x", "description": "y" * 100_000, "geometric_features": ["z"] * 9000}
            await live.client.call_tool("write_semantic_data", long)
        calls = await live.wait_for("calls")
    assert [call["number"] for call in calls][-1] == 30
    assert len(json.dumps(calls)) <= 250_000


# --- what a person may do --------------------------------------------------------------------


async def test_a_stop_needs_no_key(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live:
        await live.client.call_tool("navigate_to", {"place": "R2", "wait_s": 0})
        said = await live.command("stop")
    assert said.status_code == 200
    assert live.robot.n_stops == 1
    assert live.session.drives.under_way is None


@pytest.mark.parametrize("body", [b"", b"[]", b"{", b'{"why": "x"}', b"x" * 5000])
async def test_a_stop_is_never_refused_for_what_comes_with_it(tmp_path: Path, body: bytes) -> None:
    async with serve_live(tmp_path) as live:
        said = await live.http.post("/robots/robot/stop", content=body)
    assert said.status_code == 200
    assert live.robot.n_stops == 1


async def test_a_stop_that_does_not_reach_the_robot_is_told_as_such(tmp_path: Path) -> None:
    class Deaf(FakeRobot):
        async def stop(self) -> None:
            raise LinkError("The robot does not answer.", hint="Look at its network.")

    async with serve_live(tmp_path, Deaf(two_rooms())) as live:
        for command in ("stop", "hold"):
            said = await live.command(command)
            assert said.status_code == 409
            assert "NOT STOPPED" in said.text


async def test_a_hold_that_cannot_be_written_stops_the_robot_all_the_same(tmp_path: Path) -> None:
    (tmp_path / "control").write_text("a file where a folder should be")
    async with serve_live(tmp_path) as live:
        said = await live.command("hold")
    assert said.status_code == 409
    assert "told to stop. It is NOT HELD" in said.text
    assert live.robot.n_stops == 1


async def test_the_log_says_who_stopped_held_and_released(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live:
        await live.unlock()
        for command in ("stop", "hold", "release"):
            await live.command(command)
    noted = [(line.event, line.client) for line in audit_of(tmp_path)]
    person = "a person at the live page"
    assert noted.count(("stop", person)) >= 2
    assert noted[-1] == ("release", person)


async def test_a_hold_needs_no_key_and_a_release_does(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live:
        assert (await live.command("hold")).status_code == 200
        refused = await live.client.call_tool("navigate_to", {"place": "R2"})
        assert refused.is_error
        assert "live page" in (await live.wait_for("robot", "held_by"))["held_by"]
        assert (await live.command("release")).status_code == 403
        await live.unlock()
        assert (await live.command("release")).text == "Released."
        driven = await live.client.call_tool("navigate_to", {"place": "R2"})
    assert not driven.is_error


async def test_a_person_with_the_token_drives_and_the_log_says_who(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live:
        assert (await live.command("drive", x=3.0, y=1.0)).status_code == 403
        assert not live.robot.goals
        await live.unlock()
        assert (await live.command("drive", x=3.0, y=1.0)).status_code == 200
        (goal,) = live.robot.goals.values()
    assert (goal.x, goal.y) == (3.0, 1.0)
    assert {line.client for line in audit_of(tmp_path)} == {"a person at the live page"}


class Listening(Session):
    """Counts how often somebody is heard."""

    n_heard = 0

    def client_is_heard(self) -> AbstractContextManager[None]:
        self.n_heard += 1
        return super().client_is_heard()


async def test_an_open_page_is_somebody_who_is_there_for_its_own_drive_alone(
    tmp_path: Path,
) -> None:
    async with serve_live(tmp_path, session_type=Listening) as live, live.hear() as events:
        assert isinstance(live.session, Listening)
        await live.client.call_tool("navigate_to", {"x": 3.0, "y": 1.0, "wait_s": 0})
        n_before = live.session.n_heard
        for _ in range(3):
            await next_of(events, "alive")
        assert live.session.n_heard == n_before
        await live.unlock()
        await live.command("drive", x=2.0, y=1.0)
        n_before = live.session.n_heard
        await next_of(events, "alive")
        await next_of(events, "alive")
        assert live.session.n_heard >= n_before + 3


async def test_a_click_into_a_wall_is_answered_with_why_and_with_what_works(
    tmp_path: Path,
) -> None:
    async with serve_live(tmp_path) as live:
        checked = await live.command("check", x=3.4, y=2.4)
        await live.unlock()
        driven = await live.command("drive", x=3.4, y=2.4)
    assert "lies in a wall" in checked.text
    assert "The nearest that works is" in checked.text
    assert driven.status_code == 409
    assert not live.robot.goals


async def test_a_waiting_command_is_shown_and_approved_once(tmp_path: Path) -> None:
    approval = Approval(kinds=frozenset({CommandKind.DRIVE}), otherwise=Otherwise.QUEUE)
    guard = make_guard(tmp_path, Policy(approval=approval))
    async with serve_live(tmp_path, guard=guard) as live:
        await live.client.call_tool("navigate_to", {"x": 3.0, "y": 1.0})
        ((request, _),) = (await live.wait_for("robot", "waiting"))["waiting"].items()
        assert (await live.command("approve", id=request)).status_code == 403
        await live.unlock()
        assert "Approved: drive to" in (await live.command("approve", id=request)).text
        assert (await live.command("approve", id=request)).status_code == 409
        (word,) = [line for line in audit_of(tmp_path) if line.event == "approval"]
        assert word.client == "a person at the live page"
        assert word.said.startswith(f"approved {request}: drive to")
        driven = await live.client.call_tool("navigate_to", {"x": 3.0, "y": 1.0})
    assert not driven.is_error
    assert len(live.robot.goals) == 1


async def test_an_approval_that_has_run_out_is_neither_shown_nor_given(tmp_path: Path) -> None:
    approval = Approval(kinds=frozenset({CommandKind.DRIVE}), otherwise=Otherwise.QUEUE)
    guard = make_guard(tmp_path, Policy(approval=approval))
    async with serve_live(tmp_path, guard=guard) as live:
        await live.unlock()
        await live.client.call_tool("navigate_to", {"x": 3.0, "y": 1.0})
        ((request, _),) = (await live.wait_for("robot", "waiting"))["waiting"].items()
        guard.approvals.now_s = lambda: VALID_S + 60.0
        answer = await live.command("approve", id=request)
        async with live.hear() as events:
            while (await next_of(events, "robot"))["waiting"]:
                pass
    assert (answer.status_code, "Nothing waits" in answer.text) == (409, True)


async def test_a_refused_command_no_longer_waits(tmp_path: Path) -> None:
    approval = Approval(kinds=frozenset({CommandKind.DRIVE}), otherwise=Otherwise.QUEUE)
    guard = make_guard(tmp_path, Policy(approval=approval))
    async with serve_live(tmp_path, guard=guard) as live:
        await live.client.call_tool("navigate_to", {"x": 3.0, "y": 1.0})
        ((request, _),) = (await live.wait_for("robot", "waiting"))["waiting"].items()
        await live.unlock()
        assert "Refused: drive to" in (await live.command("refuse", id=request)).text
        assert not guard.approvals.room.list_waiting()
        again = await live.client.call_tool("navigate_to", {"x": 3.0, "y": 1.0})
    assert again.is_error
    assert not live.robot.goals


async def test_a_person_closes_a_door_until_a_time_and_opens_it_again(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live:
        await live.client.call_tool("look_at_map", {})
        assert (await live.command("close", place="D1")).status_code == 403
        await live.unlock(name="Ada")
        said = await live.command("close", place="D1", until="in 2h")
        assert said.text.startswith("Noted as E1")
        ways = await live.client.call_tool("navigate_to", {"place": "R1", "wait_s": 0})
        assert ways.is_error
        assert (await live.command("end", event="E1")).status_code == 200
        driven = await live.client.call_tool("navigate_to", {"place": "R1", "wait_s": 0})
    assert not driven.is_error
    noted = [line for line in audit_of(tmp_path) if line.event == "memory"]
    assert {line.client for line in noted} == {"Ada at the live page"}


async def test_a_person_notes_renames_and_forgets_a_place(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live:
        await live.client.call_tool("look_at_map", {})
        await live.unlock()
        assert (await live.command("note", x=2.0, y=1.0, name="spill")).status_code == 200
        assert (await live.command("rename", place="W1", name="old spill")).status_code == 200
        (place,) = (await live.wait_for("overlay", "places"))["places"]
        assert (place["name"], place["at"]) == ("old spill", [2.0, 1.0])
        taken = await live.command("rename", place="W1", name="R2")
        unknown = await live.command("rename", place="W9", name="other")
        assert (taken.status_code, unknown.status_code) == (409, 409)
        assert (await live.command("forget", what="W1")).status_code == 200
        remembered = await live.client.call_tool("get_semantic_data", {})
    assert remembered.structured_content["waypoints"] == []


async def test_a_policy_that_lets_nothing_change_holds_for_people_too(tmp_path: Path) -> None:
    guard = make_guard(tmp_path, Policy(is_read_only=True))
    async with serve_live(tmp_path, guard=guard) as live:
        await live.unlock()
        said = await live.command("note", x=2.0, y=1.0, name="spill")
    assert said.status_code == 409


async def test_what_a_person_does_is_told_at_every_page(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live, live.hear() as one, live.hear() as other:
        await live.unlock(name="Ada\n<b>")
        await live.command("hold")
        words = [await next_of(page, "word") for page in (one, other)]
    assert [word["said"] for word in words] == [
        "Ada <b>: The robot was told to stop, and is held."
    ] * 2


async def test_two_people_command_each_in_their_own_name(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live:
        await live.unlock(name="Ada")
        ada = live.keys
        await live.unlock(name="Ben")
        await live.command("hold")
        live.keys = ada
        await live.command("release")
    clients = [line.client for line in audit_of(tmp_path) if line.event in ("stop", "release")]
    assert clients[0] == "Ben at the live page"
    assert clients[-1] == "Ada at the live page"


async def test_the_cone_of_the_camera_is_as_wide_as_its_picture_told(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live:
        assert (await live.wait_for("robot", "pose"))["camera_fov_deg"] is None
        await live.http.get("/robots/robot/camera")
        told = await live.wait_for("robot", "camera_fov_deg")
    picture = await live.robot.fetch_picture()
    assert told["camera_fov_deg"] == round(math.degrees(picture.horizontal_fov_rad), 1)


# --- who must be kept out --------------------------------------------------------------------


async def test_a_token_is_good_once(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live:
        first = live.tokens[-1]
        await live.unlock()
        again = await live.http.post("/unlock", json={"token": first})
    assert again.status_code == 403
    assert len(live.tokens) == 2


async def test_wrong_tokens_lock_nobody_out(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live:
        for guess in range(40):
            wrong = await live.http.post("/unlock", json={"token": f"{guess:012d}"})
            assert wrong.status_code == 403
        await live.unlock()
        assert (await live.command("release")).status_code == 200


async def test_a_token_is_too_long_to_guess_and_is_typed_with_or_without_dashes(
    tmp_path: Path,
) -> None:
    async with serve_live(tmp_path) as live:
        token = live.tokens[-1]
        assert re.fullmatch(r"([2-9a-z]{4}-){2}[2-9a-z]{4}", token)
        typed = {"token": f" {token.replace('-', '').upper()} "}
        answer = await live.http.post("/unlock", json=typed)
    assert answer.status_code == 200


@pytest.mark.parametrize("token", ["wrong", "\ud800"])
async def test_the_answer_to_a_wrong_token_is_slow(token: str) -> None:
    keys = PageKeys(lambda _: None, wrong_s=3600.0)
    with anyio.move_on_after(0.05) as waiting:
        await keys.unlock(token)
    assert waiting.cancelled_caught


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"origin": "http://elsewhere.example"}, 403),
        ({"host": "rebound.example"}, 421),
    ],
)
async def test_pages_of_others_command_nothing_not_even_a_stop(
    tmp_path: Path, headers: dict[str, str], status: int
) -> None:
    async with serve_live(tmp_path) as live:
        answer = await live.http.post("/robots/robot/stop", json={}, headers=headers)
    assert answer.status_code == status
    assert live.robot.n_stops == 0


async def test_no_other_page_frames_this_one_and_no_foreign_script_runs_in_it(
    tmp_path: Path,
) -> None:
    async with serve_live(tmp_path) as live:
        page = await live.http.get("/")
    policy = page.headers["content-security-policy"]
    assert "default-src 'self'" in policy
    assert "frame-ancestors 'none'" in policy
    assert page.headers["x-content-type-options"] == "nosniff"


@pytest.mark.parametrize(
    "path",
    [
        "/page/..%2f..%2fapp.py",
        "/page/../site.py",
        "/leaflet/..%2f__init__.py",
        "/page/nothing.js",
        "/robots/other/events",
        "/robots/robot/tiles/0/99/x.png",
        "/robots/robot/tiles/0/0/another.png",
    ],
)
async def test_only_the_files_of_the_page_are_given_out(tmp_path: Path, path: str) -> None:
    async with serve_live(tmp_path) as live:
        await live.wait_for("map")
        assert (await live.http.get(path)).status_code == 404


@pytest.mark.parametrize("body", [b"[]", b"{", b"x" * 5000])
async def test_a_body_that_is_no_command_is_refused(tmp_path: Path, body: bytes) -> None:
    async with serve_live(tmp_path) as live:
        json_type = {"content-type": "application/json"}
        answer = await live.http.post("/robots/robot/check", content=body, headers=json_type)
    assert answer.status_code in (400, 413)


@pytest.mark.parametrize("x", ["here", None, 1e300, True])
async def test_a_place_that_is_no_place_is_refused(tmp_path: Path, x: object) -> None:
    async with serve_live(tmp_path) as live:
        await live.unlock()
        answer = await live.command("drive", x=x, y=0.0)
    assert answer.status_code == 422
    assert not live.robot.goals


async def test_hostile_names_come_as_data(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live:
        noted = {"name": HOSTILE, "description": HOSTILE}
        await live.client.call_tool("write_semantic_data", noted)
        await live.client.call_tool("look_at_map", {})
        overlay = await live.wait_for("overlay", "places")
        page = (await live.http.get("/page/map.js")).text
    assert "<script>" in overlay["places"][0]["name"]
    assert "textContent" in page


@pytest.mark.parametrize("address", ["0.0.0.0:8767", "192.0.2.7:80", "[::]:8767"])
async def test_the_page_is_for_this_machine_alone(address: str) -> None:
    with pytest.raises(ConfigError, match="SSH tunnel"):
        await serve_view({}, address, keys=PageKeys(lambda _: None))


async def test_a_page_that_reads_nothing_costs_the_others_nothing(tmp_path: Path) -> None:
    async with serve_live(tmp_path) as live, live.hear(), live.hear() as events:
        for _ in range(400):
            await live.client.call_tool("get_robot_pose", {})
        numbers = [(await next_of(events, "call"))["number"] for _ in range(400)]
    assert max(numbers) >= 200


def test_the_viewer_is_small() -> None:
    page = Path(__file__).parents[2] / "src" / "mapspeak" / "server" / "view" / "page"
    assert sum(file.stat().st_size for file in page.iterdir()) <= 120_000
