"""Trials about a robot's ROS from their setting to their score."""

from pathlib import Path

import pytest

from mapspeak.evaluation.agent import ServerAccess
from mapspeak.evaluation.runs.attempt import attempt
from mapspeak.evaluation.runs.workplace import open_inspection
from mapspeak.evaluation.scores.groundtruth import GroundTruth
from mapspeak.evaluation.tasks.catalogue import find_task
from mapspeak.evaluation.trials import (
    Failure,
    Trial,
    TrialResult,
    TrialState,
    read_turns,
    trial_folder,
)
from sites import make_flat


def run_one(run: Path, task: str, *, agent: str) -> TrialResult:
    """Runs one trial in the flat, which nobody has explored."""
    world = make_flat(run)
    trial = Trial(
        task=task, world="flat", seed=4, agent=agent, representation="picture-table", number=1
    )
    return attempt(run, trial, world, None)


@pytest.mark.parametrize("agent", ["scripted", "oracle"])
def test_an_inspection_needs_no_exploration_and_no_robot(tmp_path: Path, agent: str) -> None:
    result = run_one(tmp_path, "inspect-battery", agent=agent)
    assert result.score.is_success, result.score.reason
    assert result.state is TrialState.FINISHED
    assert result.driven_m == 0
    assert result.shortest_m is None


def test_a_model_inspects_over_stdio_to_the_end_and_fails_honestly(tmp_path: Path) -> None:
    result = run_one(tmp_path, "inspect-fight", agent="mock")
    turns = read_turns(trial_folder(tmp_path, result.trial))
    heard = [turn for turn in turns if turn.role == "tool"]
    assert [turn.is_error for turn in heard] == [False, False, True]
    assert "ROS 2" in heard[0].text
    assert result.state is TrialState.FINISHED
    assert result.score.failure is Failure.WRONG_ANSWER


@pytest.mark.anyio
async def test_a_client_program_is_given_a_read_only_server_of_the_played_ros(
    tmp_path: Path,
) -> None:
    task = find_task("inspect-map")
    setting = task.make_setting(GroundTruth(make_flat(tmp_path)), seed=0, memory=None)
    assert setting.inspected is not None
    async with open_inspection(
        setting.inspected, ServerAccess.COMMAND, toolsets=("ros",), folder=tmp_path
    ) as opened:
        assert opened.client is None
        command = opened.command
        assert command[command.index("--robot") + 1].startswith("ws://127.0.0.1:")
        assert {"--read-only", "--audit"} <= set(command)
