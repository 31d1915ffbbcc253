"""The lease of a drive: how long clients may be silent before the robot is stopped."""

from collections.abc import Generator
from contextlib import contextmanager

import anyio

from mapspeak.errors import ConfigError


class Lease:
    """Knows since when no client has been heard. Wall time: it is about clients, not the robot.

    Raises:
        ConfigError: The duration is not above zero.
    """

    def __init__(self, duration_s: float) -> None:
        if not duration_s > 0:
            raise ConfigError(
                f"A lease of {duration_s} s is not valid.",
                hint="Give a positive number of seconds.",
            )
        self.duration_s = duration_s
        self._n_calls = 0
        self._last_heard_s = float("-inf")

    @contextmanager
    def call(self) -> Generator[None]:
        """Mark a client's call: heard when it begins and when it ends."""
        self._n_calls += 1
        try:
            yield
        finally:
            self._n_calls -= 1
            self._last_heard_s = anyio.current_time()

    @property
    def is_over(self) -> bool:
        """True when no call is under way and the last one is too long ago."""
        return self._silence_s > self.duration_s

    async def wait_for_silence(self, duration_s: float) -> None:
        """Wait until no call is under way and the last one is so long ago."""
        while (left_s := duration_s - self._silence_s) > 0:  # noqa: ASYNC110 - each call puts it off
            await anyio.sleep(left_s)

    @property
    def _silence_s(self) -> float:
        return 0.0 if self._n_calls else anyio.current_time() - self._last_heard_s
