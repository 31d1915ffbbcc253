"""Signs that a drive is over though nobody said so: no movement, a jump, silence."""

import math

import anyio

from mapspeak.errors import LinkError
from mapspeak.geometry import Pose, wrap_angle
from mapspeak.robot import GoalState, GoalStatus

__all__ = ["Vigil"]

MOVED_M = 0.1
TURNED_RAD = math.radians(10)
JUMP_M = 1.0
FASTEST_MPS = 3.0
"""No indoor robot drives faster; what the pose moves beyond this and a slack is a jump."""
SILENT_FOR_S = 10.0
"""Wall time without an answer after which a drive counts as lost."""


class Vigil:
    """Watches one drive at a time; it only judges what it is told.

    Args:
        patience_s: Robot time without any movement after which a drive has timed out.
    """

    def __init__(self, *, patience_s: float) -> None:
        self._patience_s = patience_s
        self.begin("", now_s=0.0)

    def begin(self, goal_id: str, *, now_s: float) -> None:
        """Begins to watch a drive."""
        self._goal_id = goal_id
        self._moved_s = now_s
        self._moved_at: Pose | None = None
        self._before: tuple[Pose, float] | None = None
        self._silent_since_s: float | None = None

    def judge(self, status: GoalStatus, pose: Pose, *, now_s: float) -> GoalStatus | None:
        """Gives how the drive has to end; None where it may go on."""
        self._silent_since_s = None
        return self._judge_jump(pose, now_s) or self._judge_progress(status, pose, now_s)

    def note_silence(self, error: LinkError) -> GoalStatus | None:
        """Notes that the robot did not answer; gives how the drive ends when it lasts."""
        now_s = anyio.current_time()
        self._silent_since_s = now_s if self._silent_since_s is None else self._silent_since_s
        silent_s = now_s - self._silent_since_s
        if silent_s < SILENT_FOR_S:
            return None
        reason = f"The robot has not answered for {silent_s:.0f} s. {error.message}"
        return GoalStatus(state=GoalState.LOST, reason=reason)

    def _judge_jump(self, pose: Pose, now_s: float) -> GoalStatus | None:
        before, self._before = self._before, (pose, now_s)
        if before is None:
            return None
        then, then_s = before
        moved_m, passed_s = then.point.distance_to(pose.point), max(now_s - then_s, 0.0)
        if moved_m <= JUMP_M + FASTEST_MPS * passed_s:
            return None
        reason = (
            f"The pose jumped by {moved_m:.1f} m within {passed_s:.1f} s: the robot was carried "
            "away, or has lost its place; it was stopped."
        )
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
