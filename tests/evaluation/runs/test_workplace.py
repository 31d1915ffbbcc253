"""The robot and the server of a trial, as they are set and looked at."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from mapspeak.evaluation.agent import ServerAccess
from mapspeak.evaluation.runs.workplace import TrialSetup, open_workplace
from mapspeak.evaluation.scores.judging import NOWHERE
from mapspeak.evaluation.trials import Setting
from mapspeak.simulator import World
from sites import make_flat
from trialworks import make_trial


def setup_in(folder: Path, world: World, **otherwise: object) -> TrialSetup:
    """Gives the setup of a trial that starts where the world says."""
    setting = Setting(prompt="", start=world.start, is_known=False, **otherwise)  # type: ignore[arg-type]  # as the test says
    return TrialSetup(
        trial=make_trial(1),
        setting=setting,
        world=world,
        known_map=None,
        folder=folder,
        control=folder / "control",
    )


@pytest.mark.anyio
async def test_however_much_a_robot_has_done_its_state_is_read(tmp_path: Path) -> None:
    setup = setup_in(tmp_path, make_flat(tmp_path))
    deeds = tuple(f"speak: This is sentence number {number}." for number in range(200))
    states = [replace(NOWHERE, time_s=0.2 * nth, deeds=deeds) for nth in range(3)]
    async with open_workplace(setup, ServerAccess.COMMAND) as place:
        assert place.look() == NOWHERE
        lines = [json.dumps(asdict(state)) for state in states]
        (tmp_path / "state.jsonl").write_text("\n".join([*lines, lines[0][:40]]))
        assert place.look() == states[-1]


def test_what_a_world_file_says_of_doors_battery_and_faults_holds_in_trials(
    tmp_path: Path,
) -> None:
    flat = make_flat(tmp_path)
    own, *others = flat.doors
    shut = replace(own, is_shut=True)
    world = replace(flat, doors=(shut, *others), battery_ratio=0.4, n_faults={"speak": 1})
    assert setup_in(tmp_path, world).played == world
    otherwise = setup_in(tmp_path, world, shut=(others[0].name,), battery_ratio=0.9).played
    assert [door.is_shut for door in otherwise.doors] == [True, True, False]
    assert otherwise.battery_ratio == 0.9
