"""What all tests share."""

import pytest
from hypothesis import HealthCheck, settings

# How fast an example is depends on what else the machine does.
settings.register_profile("untimed", deadline=None, suppress_health_check=(HealthCheck.too_slow,))
settings.load_profile("untimed")
# The gate judges a change, not the luck of its examples: `--hypothesis-profile=gate`.
settings.register_profile("gate", settings.get_profile("untimed"), derandomize=True)
# For a search at leisure: `--hypothesis-profile=thorough`.
settings.register_profile("thorough", settings.get_profile("untimed"), max_examples=2000)


@pytest.fixture
def anyio_backend() -> str:
    """Runs asynchronous tests on asyncio, as the server does."""
    return "asyncio"
