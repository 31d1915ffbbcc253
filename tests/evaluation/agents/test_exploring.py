from pathlib import Path

import pytest

from drawing import grid_from_text
from fakes import FakeRobot
from hearing import Hearing
from mapspeak.evaluation.agent import AgentEnd, Assignment, ToolClient, Work
from mapspeak.evaluation.agents.baselines import explore_nearest_frontiers, follow_paper
from mapspeak.evaluation.trials import Limits, TrialState
from mapspeak.geometry import Pose
from served import connect

pytestmark = pytest.mark.anyio

HALF_SEEN = """
########################????
#..........................?
#..........................?
#......#####...............?
#......#...#...............?
#..........#...............?
#......#...#...............?
############################
"""
UNSEEN_M = 13.5
"""The unknown begins so far to the right."""


async def run(agent: Work, prompt: str, folder: Path) -> tuple[AgentEnd, Hearing]:
    """Lets an agent work in a building whose right end nobody has seen."""
    robot = FakeRobot(grid_from_text(HALF_SEEN, resolution_m=0.5), pose=Pose(1.8, 1.8))
    task = Assignment(prompt=prompt, system="", limits=Limits(), seed=0, server=(), folder=folder)
    async with connect(robot, folder) as client:
        ledger = Hearing()
        return await agent(task, ToolClient(client, ledger)), ledger


def goals_of(ledger: Hearing) -> list[dict[str, object]]:
    return [call.arguments for call in ledger.made if call.tool == "navigate_to"]


async def test_the_nearest_frontier_is_driven_to_by_its_id(tmp_path: Path) -> None:
    _, ledger = await run(explore_nearest_frontiers, "Update the map while moving.", tmp_path)
    assert str(goals_of(ledger)[0]["place"]).startswith("F")
    assert {"look_through_camera", "write_semantic_data"} <= {call.tool for call in ledger.made}


async def test_the_nearest_frontier_gives_up_on_what_is_no_exploration(tmp_path: Path) -> None:
    end, ledger = await run(explore_nearest_frontiers, "Go to the smallest room.", tmp_path)
    assert end.state is TrialState.GAVE_UP
    assert ledger.calls == []


async def test_the_papers_loop_goes_toward_the_unknown_by_the_picture_alone(
    tmp_path: Path,
) -> None:
    end, ledger = await run(follow_paper, "Update the map while moving.", tmp_path)
    first = goals_of(ledger)[0]
    assert isinstance(first["x"], float)
    assert first["x"] > UNSEEN_M - 4.5
    assert end.answer == "No unexplored area is left."
    assert "look_at_map" not in {call.tool for call in ledger.made}


async def test_the_papers_loop_takes_the_smallest_patch_of_floor_for_a_room(
    tmp_path: Path,
) -> None:
    _, ledger = await run(follow_paper, "Go to the smallest room.", tmp_path)
    assert len(goals_of(ledger)) >= 1


async def test_the_papers_loop_gives_up_on_what_the_paper_does_not_ask(tmp_path: Path) -> None:
    end, _ = await run(follow_paper, "Say something.", tmp_path)
    assert end.state is TrialState.GAVE_UP
