"""Runs of skills in the background, and whose they are."""

from collections.abc import Mapping

import anyio
import pytest

from mapspeak.skill import JsonValue, SkillOutcome, SkillState
from mapspeak.skills.runs import SkillRuns
from mapspeak.skills.steps import Mission, Step, StepKind
from skillmaking import FakeSkill, never, spec

pytestmark = pytest.mark.anyio


async def test_a_run_takes_as_long_as_by_the_clock_of_the_robot() -> None:
    now_s = 100.0

    async def work(_arguments: Mapping[str, JsonValue]) -> SkillOutcome:
        nonlocal now_s
        now_s += 600.0
        return SkillOutcome()

    runs = SkillRuns(read_clock_s=lambda: now_s)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(runs.keep_going, anyio.sleep_forever)
        await anyio.wait_all_tasks_blocked()
        run = await runs.begin(FakeSkill(spec(), do=work), {}, wait_s=1.0)
        now_s += 60.0
        assert run.passed_s == 600.0
        tasks.cancel_scope.cancel()


async def test_a_mission_goes_on_when_its_client_hangs_up_and_other_skills_end() -> None:
    runs = SkillRuns()
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(runs.keep_going, anyio.sleep_forever)
        await anyio.wait_all_tasks_blocked()
        hang = FakeSkill(spec(), do=never)
        leaf = Step(kind=StepKind.LEAF, number=1, skill="hang")
        mission = await runs.begin(Mission(hang.spec, hang.run, leaf), {}, wait_s=0.0)
        own = await runs.begin(hang, {}, wait_s=0.0)
        await runs.client_is_gone("")
        assert own.state is SkillState.CANCELLED
        assert mission.state is SkillState.RUNNING
        tasks.cancel_scope.cancel()
