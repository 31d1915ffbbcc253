import math

import anyio
import pytest

from mapspeak.driving.lease import Lease
from mapspeak.errors import ConfigError

pytestmark = pytest.mark.anyio


async def test_a_lease_is_over_before_anyone_was_heard() -> None:
    assert Lease(10.0).is_over


async def test_a_call_under_way_keeps_the_lease_however_long_it_takes() -> None:
    lease = Lease(1e-9)
    with lease.call():
        await anyio.lowlevel.checkpoint()
        assert not lease.is_over


async def test_a_client_heard_just_now_keeps_the_lease() -> None:
    lease = Lease(10.0)
    with lease.call():
        pass
    assert not lease.is_over


async def test_a_lease_is_over_when_the_last_call_is_too_long_ago() -> None:
    lease = Lease(1e-9)
    with lease.call():
        pass
    begun_s = anyio.current_time()
    while anyio.current_time() == begun_s:
        await anyio.lowlevel.checkpoint()
    assert lease.is_over


async def test_work_that_can_wait_begins_when_no_call_is_under_way() -> None:
    lease, began = Lease(10.0), anyio.Event()
    await lease.wait_for_silence(10.0)

    async def work() -> None:
        await lease.wait_for_silence(1e-3)
        began.set()

    async with anyio.create_task_group() as tasks:
        with lease.call():
            tasks.start_soon(work)
            await anyio.wait_all_tasks_blocked()
            assert not began.is_set()
        with anyio.fail_after(10):
            await began.wait()


@pytest.mark.parametrize("duration_s", [0.0, -5.0, math.nan])
async def test_a_lease_that_never_ends_or_never_begins_is_refused(duration_s: float) -> None:
    with pytest.raises(ConfigError, match="is not valid"):
        Lease(duration_s)
