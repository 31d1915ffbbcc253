"""The simulator's truth as JSON lines, for scoring: no tool ever reads it."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Self

from mapspeak.errors import ConfigError
from mapspeak.geometry import Pose
from mapspeak.simulator.simulation import Simulation

PERIOD_S = 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class StateRecord:
    """How a simulation truly stood at one moment.

    Attributes:
        time_s: Robot time.
        x: Metres, in a map without errors.
        y: Likewise.
        yaw_rad: Likewise.
        slam_error_m: How far the robot's own pose was off.
        driven_m: Metres driven since the start.
        n_collisions: Bumps since the start.
    """

    time_s: float
    x: float
    y: float
    yaw_rad: float
    slam_error_m: float
    driven_m: float
    n_collisions: int

    @property
    def pose(self) -> Pose:
        """Where the robot truly stood."""
        return Pose(self.x, self.y, self.yaw_rad)

    @classmethod
    def of(cls, simulation: Simulation) -> Self:
        """Return how a simulation truly stands now."""
        truth = simulation.truth
        pose = truth.pose
        return cls(
            time_s=round(simulation.time_s, 3),
            x=pose.x,
            y=pose.y,
            yaw_rad=pose.yaw_rad,
            slam_error_m=truth.slam_error_m,
            driven_m=truth.driven_m,
            n_collisions=truth.n_collisions,
        )


class StateLog:
    """Writes a record at most five times per second of robot time."""

    def __init__(self, simulation: Simulation, path: Path) -> None:
        self._simulation = simulation
        self._last_s = float("-inf")
        try:
            self._file = path.open("w", encoding="utf-8")
            self.note()
        except OSError as error:
            raise ConfigError(
                f"The state log {path} cannot be written: {error.strerror}.",
                hint="Choose another file with --state-log.",
            ) from error

    def note(self) -> None:
        """Write a record when the last one is old enough."""
        now_s = self._simulation.time_s
        if now_s - self._last_s < PERIOD_S:
            return
        self._last_s = now_s
        record = StateRecord.of(self._simulation)
        self._file.write(json.dumps(asdict(record)) + "\n")
        self._file.flush()

    def close(self) -> None:
        """Write the last record and close the file."""
        self._last_s = float("-inf")
        self.note()
        self._file.close()


def read_state_log(path: Path) -> tuple[StateRecord, ...]:
    """Read every whole line of a state log, which may still be growing."""
    whole_lines = path.read_text(encoding="utf-8").rpartition("\n")[0].splitlines()
    return tuple(StateRecord(**json.loads(line)) for line in whole_lines)
