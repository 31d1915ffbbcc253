"""A stop that is still owed to a robot out of reach, and the lease that every drive needs."""

import logging
from collections.abc import Callable, Generator
from contextlib import contextmanager

import anyio

from mapspeak.driving.drivereport import Drive
from mapspeak.errors import ConfigError, LinkError, MapspeakError
from mapspeak.robot import GoalState, GoalStatus, Robot
from mapspeak.safety import NOBODY, calling

NEWS_S = 0.5
"""Wall time from the robot's return until its navigation has told how goals stand."""
NEEDS_NO_STOP = (GoalState.ARRIVED, GoalState.CANCELLED, GoalState.PREEMPTED)
"""Navigation has ended these itself; what a newer goal has replaced, that drives on with."""

logger = logging.getLogger(__name__)


class OwedStop:
    """The stop that is owed to one robot, if any.

    Attributes:
        goal_id: Of the drive it is owed for; None where nothing is owed.
    """

    def __init__(self, robot: Robot, *, wall_s: Callable[[], float]) -> None:
        self._robot = robot
        self._wall_s = wall_s
        self._stopping = anyio.Lock()
        self._answered_s: float | None = None
        self._has_warned = False
        self.goal_id: str | None = None

    def owe(self, goal_id: str) -> None:
        """Note that a drive has to be stopped."""
        self.goal_id, self._answered_s, self._has_warned = goal_id, None, False

    def forgive(self) -> None:
        """Note that nothing has to be stopped any more."""
        self.goal_id = None

    async def wait_for_stop(self) -> None:
        """Return when no stop is being sent: it would end what is sent meanwhile."""
        async with self._stopping:
            return

    async def stop(self) -> None:
        """Stop the robot where that is owed; what fails stays owed."""
        async with self._stopping:
            owed = self.goal_id
            if owed is None:
                return
            try:
                with anyio.CancelScope(shield=True), calling(NOBODY):
                    await self._robot.stop()
            except MapspeakError as error:
                if not self._has_warned:
                    logger.warning("%s could not be stopped yet: %s", owed, error)
                self._has_warned = True
                return
            if self.goal_id == owed:
                self.forgive()

    async def settle(self, drive: Drive) -> GoalStatus | None:
        """Stop the drive a stop is owed for, unless it has ended by itself; return how it has.

        A robot that is back needs a moment to tell how its goals stand.
        """
        try:
            truth = await self._robot.fetch_goal_status(drive.robot_goal_id or "")
        except LinkError:
            # Out of reach, or only its state is: then it can be stopped.
            self._answered_s = None
            await self.stop()
            return None
        if self.goal_id != drive.goal_id:
            return None
        if truth.state in NEEDS_NO_STOP:
            self.forgive()
            return truth
        now_s = self._wall_s()
        self._answered_s = now_s if self._answered_s is None else self._answered_s
        if truth.state.is_final or now_s - self._answered_s >= NEWS_S:
            await self.stop()
        return None


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
        return not self._n_calls and anyio.current_time() - self._last_heard_s > self.duration_s
