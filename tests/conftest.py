"""What all tests share."""

import pytest
from hypothesis import HealthCheck, settings

# How fast an example is depends on what else the machine does.
settings.register_profile("untimed", deadline=None, suppress_health_check=(HealthCheck.too_slow,))
settings.load_profile("untimed")


@pytest.fixture
def anyio_backend() -> str:
    """Runs asynchronous tests on asyncio, as the server does."""
    return "asyncio"
