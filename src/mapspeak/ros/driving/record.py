"""What is known of one drive; kept after its end, so that it can be asked for later."""

from mapspeak.geometry import Pose
from mapspeak.robot import GoalState, GoalStatus


class GoalRecord:
    """A goal that was sent, and how it stands. Once ended, its state stays.

    Attributes:
        goal_id: Ours, used nowhere else.
        goal: In the map frame.
        state: How it stands.
        is_replaced: We have sent another goal since.
        afterwards: What became of it after its end.
    """

    def __init__(self, goal_id: str, goal: Pose) -> None:
        self.goal_id = goal_id
        self.goal = goal
        self.state = GoalState.ACCEPTED
        self.is_replaced = False
        self.afterwards = ""
        self._distance_left_m: float | None = None
        self._n_recoveries = 0
        self._reason = ""
        self._is_unanswered = False

    @property
    def status(self) -> GoalStatus:
        """How it stands, as the port tells it."""
        return GoalStatus(
            state=self.state,
            distance_left_m=self._distance_left_m,
            n_recoveries=self._n_recoveries,
            reason=self._reason,
            is_unanswered=self._is_unanswered,
            afterwards=self.afterwards,
        )

    @property
    def is_over(self) -> bool:
        """True when nothing more will happen."""
        return self.state.is_final

    def drive(self, *, distance_left_m: float | None = None, n_recoveries: int = 0) -> None:
        """Note that the robot is on its way."""
        if self.is_over:
            return
        self.state = GoalState.DRIVING
        if distance_left_m is not None:
            self._distance_left_m = distance_left_m
        self._n_recoveries = max(self._n_recoveries, n_recoveries)

    def end(self, state: GoalState, reason: str = "", *, is_unanswered: bool = False) -> None:
        """Note how it ended; the first word counts."""
        if self.is_over:
            return
        if self.is_replaced and state in (GoalState.BLOCKED, GoalState.CANCELLED):
            # Navigation tells a replaced goal as aborted or cancelled.
            state, reason = GoalState.PREEMPTED, "A newer goal replaced it."
        self.state, self._reason = state, reason
        self._is_unanswered = is_unanswered
        if state is GoalState.ARRIVED:
            self._distance_left_m = 0.0
