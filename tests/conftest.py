"""What all tests share."""

import time
from collections.abc import Iterator

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


@pytest.fixture
def central_european_time(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Lets this machine's zone have a summer time, from the last Sundays of March to October."""
    monkeypatch.setenv("TZ", "CET-1CEST,M3.5.0,M10.5.0/3")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()
