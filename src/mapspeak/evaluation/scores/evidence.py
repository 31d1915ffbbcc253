"""What is left of a trial to be judged by."""

from dataclasses import dataclass

from mapspeak.evaluation.trials import ToolCall, TrialState
from mapspeak.geometry import Point
from mapspeak.simulator import StateRecord
from mapspeak.spatial import OccupancyGrid

__all__ = ["Evidence"]

NOWHERE = StateRecord(
    time_s=0.0, x=0.0, y=0.0, yaw_rad=0.0, slam_error_m=0.0, driven_m=0.0, n_collisions=0
)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Evidence:
    """How a trial truly went.

    Attributes:
        states: The simulator's truth from begin to end; poses in a map without errors.
        grid: The robot's map in the end; None where there is none.
        memory: The semantic map in the end, as YAML; None where there is none.
        answer: The agent's last words; only questions are scored by them.
        state: How the agent ended.
        calls: What it called.
        n_errors: Calls that were answered with an error.
    """

    states: tuple[StateRecord, ...]
    grid: OccupancyGrid | None = None
    memory: str | None = None
    answer: str = ""
    state: TrialState = TrialState.FINISHED
    calls: tuple[ToolCall, ...] = ()
    n_errors: int = 0

    @property
    def last(self) -> StateRecord:
        """How the simulation stood in the end."""
        return self.states[-1] if self.states else NOWHERE

    @property
    def end(self) -> Point:
        """Where the robot truly stood in the end, in the map frame."""
        return self.last.pose.point
