import anyio
import pytest

from mapspeak.navigation.lease import Lease

pytestmark = pytest.mark.anyio


async def test_a_lease_is_over_before_anyone_was_heard() -> None:
    assert Lease(10.0).is_over


async def test_a_call_under_way_keeps_the_lease_however_long_it_takes() -> None:
    lease = Lease(0.0)
    with lease.call():
        await anyio.lowlevel.checkpoint()
        assert not lease.is_over


async def test_a_client_heard_just_now_keeps_the_lease() -> None:
    lease = Lease(10.0)
    with lease.call():
        pass
    assert not lease.is_over


async def test_a_lease_of_no_length_is_over_once_the_call_has_ended() -> None:
    lease = Lease(-1.0)
    with lease.call():
        pass
    assert lease.is_over
