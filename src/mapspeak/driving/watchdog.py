"""Signs that a drive is over though nobody said so: no movement, a jump, silence."""

import math
from collections.abc import Callable

import anyio

from mapspeak.errors import LinkError
from mapspeak.geometry import Pose, wrap_angle
from mapspeak.robot import GoalState, GoalStatus, StampedPose

MOVED_M = 0.1
TURNED_RAD = math.radians(10)
JUMP_M = 1.0
FASTEST_MPS = 3.0
"""No indoor robot drives faster; what the pose moves beyond this and a slack is a jump."""
SILENT_FOR_S = 10.0
"""Wall time without state or pose after which a drive counts as lost."""
STEP_M = 0.05
"""A pose that has moved less may only have wavered."""


class Odometer:
    """Adds up how far a robot has come, by the stamps of its poses.

    Attributes:
        driven_m: So far; jumps are not driven.
    """

    def __init__(self) -> None:
        self.driven_m = 0.0
        self._counted: Pose | None = None
        self._before: StampedPose | None = None

    def take(self, here: StampedPose) -> float | None:
        """Add the way since the pose before, and return how far that jumped; None if it did not.

        A pose without a newer stamp says nothing of the way: part of it may be old.
        """
        before = self._before
        if before is not None and here.stamp_s == before.stamp_s:
            return None
        self._before = here
        if before is None or self._counted is None or here.stamp_s < before.stamp_s:
            self._counted = here.pose
            return None
        moved_m = before.pose.point.distance_to(here.pose.point)
        if moved_m > JUMP_M + FASTEST_MPS * (here.stamp_s - before.stamp_s):
            self._counted = here.pose
            return moved_m
        step_m = self._counted.point.distance_to(here.pose.point)
        if step_m >= STEP_M:
            self.driven_m += step_m
            self._counted = here.pose
        return None


class DriveWatchdog:
    """Watches one drive at a time; it only judges what it is told.

    Args:
        patience_s: Robot time without any movement after which a drive has timed out.
        wall_s: Tells wall time.
    """

    def __init__(
        self, *, patience_s: float, wall_s: Callable[[], float] = anyio.current_time
    ) -> None:
        self._patience_s = patience_s
        self._wall_s = wall_s
        self.begin(now_s=0.0)

    def begin(self, *, now_s: float) -> None:
        """Begin to watch a drive."""
        self._moved_s = now_s
        self._moved_at: Pose | None = None
        self._heard_s: float | None = None
        self._is_silent = False

    def judge(
        self, status: GoalStatus, here: StampedPose, *, jump_m: float | None, now_s: float
    ) -> GoalStatus | None:
        """Return how the drive has to end; None where it may go on.

        Args:
            status: How the drive stands.
            here: Where the robot is.
            jump_m: How far the pose jumped; None where it did not.
            now_s: Robot time.
        """
        if self._is_silent:
            # What happened in the silence is unknown: the robot may have moved all the time.
            self._moved_at = None
        self._heard_s, self._is_silent = self._wall_s() - here.silent_s, False
        if jump_m is not None:
            reason = (
                f"The pose jumped by {jump_m:.1f} m: the robot was carried away, or has lost its "
                "place."
            )
            return GoalStatus(state=GoalState.LOST, reason=reason)
        return self._judge_progress(status, here.pose, now_s)

    def note_silence(self, error: LinkError) -> GoalStatus | None:
        """Note that state or pose is missing; return how the drive ends when that lasts."""
        now_s = self._wall_s()
        self._heard_s = now_s if self._heard_s is None else self._heard_s
        self._is_silent = True
        silent_s = now_s - self._heard_s
        if silent_s < SILENT_FOR_S:
            return None
        reason = f"The robot was silent for {silent_s:.0f} s. {error.message}"
        return GoalStatus(state=GoalState.LOST, reason=reason)

    def _judge_progress(self, status: GoalStatus, pose: Pose, now_s: float) -> GoalStatus | None:
        at = self._moved_at
        if at is None or _has_moved(at, pose) or now_s < self._moved_s:
            self._moved_at, self._moved_s = pose, now_s
        still_s = now_s - self._moved_s
        if still_s < self._patience_s:
            return None
        what = "has not begun" if status.state is GoalState.ACCEPTED else "has not moved the robot"
        reason = f"The navigation {what} for {still_s:.0f} s; the goal was withdrawn."
        return GoalStatus(
            state=GoalState.TIMED_OUT,
            distance_left_m=status.distance_left_m,
            n_recoveries=status.n_recoveries,
            reason=reason,
        )


def _has_moved(one: Pose, other: Pose) -> bool:
    turned_rad = abs(wrap_angle(other.yaw_rad - one.yaw_rad))
    return one.point.distance_to(other.point) > MOVED_M or turned_rad > TURNED_RAD
