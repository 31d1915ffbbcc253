"""What is known of one drive; kept after its end, so that it can be asked for later."""

from collections.abc import Iterable

import anyio

from mapspeak.geometry import Pose
from mapspeak.robot import GoalState, GoalStatus


class GoalRecord:
    """A goal that was sent, and how it stands. Once ended, nothing changes it any more.

    Attributes:
        goal_id: Ours, used nowhere else.
        goal: In the map frame.
        state: How it stands.
        is_accepted: The robot has given a sign that it took the goal.
        is_replaced: We have sent another goal since.
    """

    def __init__(self, goal_id: str, goal: Pose) -> None:
        self.goal_id = goal_id
        self.goal = goal
        self.state = GoalState.ACCEPTED
        self.is_accepted = False
        self.is_replaced = False
        self._distance_left_m: float | None = None
        self._n_recoveries = 0
        self._reason = ""
        self._news = anyio.Event()

    @property
    def status(self) -> GoalStatus:
        """How it stands, as the port tells it."""
        return GoalStatus(
            state=self.state,
            distance_left_m=self._distance_left_m,
            n_recoveries=self._n_recoveries,
            reason=self._reason,
        )

    @property
    def is_over(self) -> bool:
        """True when nothing more will happen."""
        return self.state.is_final

    def accept(self) -> None:
        """Notes that the robot has taken the goal."""
        self.is_accepted = True
        self.tell()

    def drive(self, *, distance_left_m: float | None = None, n_recoveries: int = 0) -> None:
        """Notes that the robot is on its way."""
        if self.is_over:
            return
        self.state = GoalState.DRIVING
        if distance_left_m is not None:
            self._distance_left_m = distance_left_m
        self._n_recoveries = max(self._n_recoveries, n_recoveries)
        self.accept()

    def end(self, state: GoalState, reason: str = "") -> None:
        """Notes how it ended; the first word counts."""
        if self.is_over:
            return
        if self.is_replaced and state in (GoalState.BLOCKED, GoalState.CANCELLED):
            # Navigation tells a replaced goal as aborted or cancelled.
            state, reason = GoalState.PREEMPTED, "A newer goal replaced it."
        self.state, self._reason = state, reason
        if state is GoalState.ARRIVED:
            self._distance_left_m = 0.0
        self.tell()

    def tell(self) -> None:
        """Wakes those who wait for news."""
        news, self._news = self._news, anyio.Event()
        news.set()

    async def wait_for_acceptance(self, *, within_s: float) -> None:
        """Returns when the robot has taken the goal, when it is over, or after so long."""
        with anyio.move_on_after(within_s):
            while not (self.is_accepted or self.is_over):
                await self.wait_for_news()

    async def wait_for_news(self) -> None:
        """Returns after the next change, or the next sign that there may be one."""
        await self._news.wait()


async def wait_for_ends(records: Iterable[GoalRecord], *, within_s: float) -> None:
    """Returns when all of some goals are over, or after so long."""
    with anyio.move_on_after(within_s):
        for record in records:
            while not record.is_over:
                await record.wait_for_news()
