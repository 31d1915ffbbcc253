"""Robot time: what a simulation says, else the robot's own clock as far as we can tell."""

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros import RosConnection
from mapspeak.ros.messages import Message, read_stamp

STANDSTILL_S = 5.0
"""Of the wall clock; a simulation that slow is paused or has ended."""
FIRST_TICK_S = 1.0
"""A clock topic that stays silent for so long is left over from something else."""
ASK_AGAIN_S = 1.0
"""Whoever could tell the time may be found only after we have connected."""
EPSILON_S = 1e-6


class RobotClock:
    """Tells robot time, and waits for it.

    Args:
        connection: Connected to the robot.
        standstill_s: Wall time after which a clock that does not move on stands still.
    """

    def __init__(self, connection: RosConnection, *, standstill_s: float = STANDSTILL_S) -> None:
        self._connection = connection
        self._standstill_s = standstill_s
        self._offset_s: float | None = None
        self._simulated_s: float | None = None
        self._moved_on = anyio.Event()

    @property
    def now_s(self) -> float:
        """Robot time."""
        if self._simulated_s is not None:
            return self._simulated_s
        return anyio.current_time() + (self._offset_s or 0.0)

    @property
    def is_set(self) -> bool:
        """True when the robot has said what time it is."""
        return self._simulated_s is not None or self._offset_s is not None

    async def start(self, clock_topic: str | None) -> None:
        """Sets the clock by what the robot says now."""
        await self._ask_the_time()
        if clock_topic is not None:
            self._connection.subscribe(clock_topic).listen(self._take)
            with anyio.move_on_after(FIRST_TICK_S):
                await self._moved_on.wait()

    async def set_late(self) -> None:
        """Ask until the robot has said what time it is; for the background."""
        while not self.is_set:
            await anyio.sleep(ASK_AGAIN_S)
            await self._ask_the_time()

    async def sleep(self, duration_s: float) -> None:
        """Returns when that much robot time has passed.

        Raises:
            LinkError: The simulation's clock stands still.
        """
        if self._simulated_s is None:
            await anyio.sleep(duration_s)
            return
        left_s, before_s = duration_s, self.now_s
        while left_s > EPSILON_S:
            await self._wait_for_tick()
            # A clock that was set back, by a simulation begun anew, has not run backwards.
            left_s -= max(self.now_s - before_s, 0.0)
            before_s = self.now_s

    async def _ask_the_time(self) -> None:
        try:
            robot_s = await self._connection.fetch_time_s()
        except LinkError:
            return
        if robot_s is not None:
            self._offset_s = robot_s - anyio.current_time()

    async def _wait_for_tick(self) -> None:
        with anyio.move_on_after(self._standstill_s):
            await self._moved_on.wait()
            return
        raise LinkError(
            f"The robot's simulated clock has stood still for {self._standstill_s:g} s.",
            hint="Unpause the simulation, or check that /clock is still published.",
        )

    def _take(self, message: Message) -> None:
        stamp = message.get("clock")
        if not isinstance(stamp, dict):
            return
        before_s = self._simulated_s
        try:
            self._simulated_s = read_stamp(stamp)
        except LinkError:
            return
        if self._simulated_s == before_s:
            return
        moved_on, self._moved_on = self._moved_on, anyio.Event()
        moved_on.set()
