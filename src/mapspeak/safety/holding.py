"""A held robot: stopped, and stopped again until it is known to stand."""

from collections.abc import Awaitable, Callable

import anyio

from mapspeak.errors import LinkError, MapspeakError
from mapspeak.geometry import Pose, wrap_angle
from mapspeak.hold import Hold
from mapspeak.robot import Robot

WAVER_M = 0.01
WAVER_RAD = 0.02
OLD_S = 1.0
"""A pose from longer ago says nothing of whether the robot moves now."""
LOOK_S = 1.0
"""A look takes no longer, in wall time."""


class StandingCheck:
    """Compares where a robot is with where it was at the look before.

    Args:
        robot: The robot.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._before: Pose | None = None
        self._has_looked = False

    def begin(self) -> None:
        """Forget where it was: it was just stopped, and may roll on."""
        self._before, self._has_looked = None, False

    async def is_standing(self) -> bool:
        """Return False when the robot moved since the look before, or its pose is not known.

        There is nothing to compare the first look with.
        """
        before, is_first = self._before, not self._has_looked
        self._before = here = await self._look()
        self._has_looked = True
        if here is None:
            return False
        if before is None:
            return is_first
        turned_rad = wrap_angle(here.yaw_rad - before.yaw_rad)
        return before.point.distance_to(here.point) <= WAVER_M and abs(turned_rad) <= WAVER_RAD

    async def _look(self) -> Pose | None:
        with anyio.move_on_after(LOOK_S):
            try:
                stamped = await self._robot.fetch_pose()
            except LinkError:
                return None
            is_old = self._robot.now_s - stamped.stamp_s > OLD_S
            return None if is_old else stamped.pose
        return None


class HoldKeeper:
    """Obeys a hold, and tells the operator what came of it.

    Args:
        hold: What may keep the robot standing.
        standing: Knows whether it stands.
        repeat_s: Between two looks whether it does, in wall time.
    """

    def __init__(self, hold: Hold, standing: StandingCheck, *, repeat_s: float) -> None:
        self._hold = hold
        self._standing = standing
        self._repeat_s = repeat_s
        self._answered: str | None = None
        self._next_look_s = float("-inf")

    async def obey(
        self,
        robot: str,
        *,
        stop: Callable[[str], Awaitable[None]],
        repeat: Callable[[], Awaitable[None]],
    ) -> None:
        """Stop the robot when a hold is new, and again while it is not known to stand.

        Args:
            robot: What the operator calls it.
            stop: Stops it for the reason that is given.
            repeat: Stops it once more.

        Raises:
            MapspeakError: The stop failed, which the operator is told; call again.
        """
        held_by = self._hold.read()
        if held_by is None or held_by != self._answered:
            self._answered = None
        if held_by is None:
            return
        try:
            if self._answered is not None:
                await self._keep_still(repeat)
                return
            await stop(held_by)
        except MapspeakError as error:
            self._answered = None
            self._hold.answer(robot, held_by=held_by, failure=str(error))
            raise
        self._answered = held_by
        self._standing.begin()
        self._hold.answer(robot, held_by=held_by)

    async def _keep_still(self, repeat: Callable[[], Awaitable[None]]) -> None:
        if anyio.current_time() < self._next_look_s:
            return
        self._next_look_s = anyio.current_time() + self._repeat_s
        if not await self._standing.is_standing():
            await repeat()
