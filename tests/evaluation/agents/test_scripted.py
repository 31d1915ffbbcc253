import math
from functools import partial
from pathlib import Path

import pytest

from drawing import grid_from_text
from fakes import FakeRobot, two_rooms
from hearing import Hearing
from mapspeak.evaluation.agent import AgentEnd, Assignment, ToolClient
from mapspeak.evaluation.agents.catalogue import SCRIPTS
from mapspeak.evaluation.agents.driver import ToolDriver
from mapspeak.evaluation.agents.scripted import follow_script
from mapspeak.evaluation.trials import Limits, TrialState
from mapspeak.geometry import Pose
from mapspeak.robot import Detection
from served import connect

pytestmark = pytest.mark.anyio

ROOM = """
##############
#............#
#............#
#............#
##############
"""
PROMPT = "Fire detected nearby. Navigate to the tool used for it."


@pytest.mark.parametrize(("script", "n_seen"), [("scripted", 2), ("near-sighted", 1), ("blind", 0)])
def test_eyes_that_are_not_sharp_note_what_is_near(script: str, n_seen: int) -> None:
    work = SCRIPTS[script]
    sight_m = work.keywords["sight_m"] if isinstance(work, partial) else math.inf
    told = "- desk, +3 deg, 1.2 m\n- fridge, -3 deg, 4.0 m"
    assert len(ToolDriver(ToolClient(None), sight_m=sight_m).note(told)) == n_seen


async def run(folder: Path, *tools: str) -> tuple[AgentEnd, Hearing]:
    """Lets the policy look for what nobody remembers, with some tools besides the usual ones."""
    robot = FakeRobot(grid_from_text(ROOM, resolution_m=0.5), pose=Pose(1.8, 1.2))
    task = Assignment(prompt=PROMPT, system="", limits=Limits(), seed=0, server=(), folder=folder)
    async with connect(robot, folder, tools=tools) as client:
        ledger = Hearing()
        return await follow_script(task, ToolClient(client, ledger)), ledger


async def test_a_search_is_not_begun_where_none_is_offered(tmp_path: Path) -> None:
    end, ledger = await run(tmp_path)
    assert end.state is TrialState.GAVE_UP
    assert "search_for" not in {call.tool for call in ledger.made}
    assert not any(answer.is_error for answer in ledger.answers)
    assert end.answer == "I know no way to a fire extinguisher, and am offered no search."


async def test_a_search_is_begun_where_one_is_offered(tmp_path: Path) -> None:
    _, ledger = await run(tmp_path, "search_for")
    assert "search_for" in {call.tool for call in ledger.made}


async def test_a_script_without_ranges_notes_directions_alone(tmp_path: Path) -> None:
    robot = FakeRobot(grid_from_text(ROOM, resolution_m=0.5), pose=Pose(1.8, 1.2))
    async with connect(robot, tmp_path) as client:
        ledger = Hearing()
        driver = ToolDriver(ToolClient(client, ledger), tells_ranges=False)
        await driver.record(driver.note("- fire extinguisher, +3 deg, 1.2 m"))
    (written,) = [call for call in ledger.made if call.tool == "write_semantic_data"]
    (landmark,) = written.arguments["safety_landmarks"]
    assert landmark == {"label": "fire extinguisher", "bearing_deg": 3.0}


FRIDGE = Detection(label="fridge", confidence_ratio=0.9, bearing_rad=0.0, range_m=2.0)


async def do(prompt: str, robot: FakeRobot, folder: Path, *tools: str) -> tuple[AgentEnd, Hearing]:
    task = Assignment(prompt=prompt, system="", limits=Limits(), seed=0, server=(), folder=folder)
    async with connect(robot, folder, tools=tools) as client:
        ledger = Hearing()
        return await follow_script(task, ToolClient(client, ledger)), ledger


async def test_what_an_exploration_reports_of_its_way_is_noted_too(tmp_path: Path) -> None:
    class Passing(FakeRobot):
        async def fetch_detections(self) -> tuple[Detection, ...]:
            return (FRIDGE,) if 1.6 < self.pose.x < 4.4 else ()

    robot = Passing(two_rooms())
    robot.detections = (FRIDGE,)
    _, ledger = await do("Update the map while moving.", robot, tmp_path, "explore", "look_around")
    written = [call.arguments for call in ledger.made if call.tool == "write_semantic_data"]
    (passed,) = [each for each in written if each["functional_landmarks"]]
    assert passed["x"] > 1.6


async def test_a_thing_that_one_look_has_shown_is_looked_at_before_an_errand(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(two_rooms())
    robot.detections = (FRIDGE,)
    async with connect(robot, tmp_path) as client:
        driver = ToolDriver(ToolClient(client, Hearing()))
        await driver.record(await driver.see())
        errand = 'Errand, all at once. Go to the nearest fridge and say "It is here." there.'
        _, ledger = await do(errand, robot, tmp_path, "search_for")
        assert "look_at" in ledger.calls
        assert "search_for" not in ledger.calls
        (thing,) = await driver.find_things("fridge")
    assert len(thing["seen_from"]) == 2


async def test_a_look_is_taken_where_its_drive_ends(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path) as client:
        driver = ToolDriver(ToolClient(client, Hearing()))
        views = await driver.look_with("look_at", place="R1", wait_s=0.1)
    (at,) = [pose.point for pose, _ in views]
    assert (at.x, at.y) == pytest.approx((robot.pose.x, robot.pose.y), abs=0.01)
