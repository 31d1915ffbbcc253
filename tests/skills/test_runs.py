"""Runs of skills in the background, and whose they are."""

import anyio
import pytest

from mapspeak.skill import SkillState
from mapspeak.skills.runs import SkillRuns
from skillmaking import FakeSkill, never, spec

pytestmark = pytest.mark.anyio


async def test_a_run_that_is_nobodys_goes_on_when_clients_without_a_session_hang_up() -> None:
    runs = SkillRuns()
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(runs.keep_going, anyio.sleep_forever)
        await anyio.wait_all_tasks_blocked()
        mission = await runs.begin(FakeSkill(spec("mission"), do=never), {}, wait_s=0.0)
        own = await runs.begin(FakeSkill(spec(), do=never), {}, client="", wait_s=0.0)
        await runs.client_is_gone("")
        assert own.state is SkillState.CANCELLED
        assert mission.state is SkillState.RUNNING
        tasks.cancel_scope.cancel()
