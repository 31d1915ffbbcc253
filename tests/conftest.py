"""What all tests share."""

import pytest


@pytest.fixture
def anyio_backend() -> str:
    """Runs asynchronous tests on asyncio, as the server does."""
    return "asyncio"
