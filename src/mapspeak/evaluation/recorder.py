"""Keeps what a run shows, as it happens: pictures on the disk, moments for the page, scores."""

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from mapspeak.errors import ConfigError
from mapspeak.evaluation.page import Moment
from mapspeak.evaluation.policy import Stage, Step
from mapspeak.evaluation.scoring import Scorer
from mapspeak.simulator import StateRecord, read_state_log
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.coverage import Coverage

__all__ = ["Recorder", "prepare_folder"]


def prepare_folder(folder: Path) -> Path:
    """Makes the folder that a run writes into.

    Raises:
        ConfigError: It cannot be made or written to.
    """
    try:
        (folder / "pictures").mkdir(parents=True, exist_ok=True)
        (folder / "pictures" / ".writable").touch()
        (folder / "pictures" / ".writable").unlink()
    except OSError as error:
        raise ConfigError(
            f"The folder {folder} cannot be written to: {error.strerror}.",
            hint="Choose another one with --out.",
        ) from error
    return folder


@dataclass(slots=True)
class Recorder:
    """Receives the steps of a policy and scores every map among them.

    Attributes:
        folder: Where pictures go.
        state_log: The simulator's truth.
        scorer: Compares with it.
        on_progress: Told of each moment.
        moments: Everything so far.
        last_map: The last map that was looked at.
        last_coverage: Its score.
        stage_ends: How the simulation truly stood at the last moment of each task.
    """

    folder: Path
    state_log: Path
    scorer: Scorer
    on_progress: Callable[[Moment], None]
    moments: list[Moment] = field(default_factory=list)
    last_map: OccupancyGrid | None = None
    last_coverage: Coverage | None = None
    stage_ends: dict[Stage, StateRecord] = field(default_factory=dict)

    async def take(self, step: Step) -> None:
        """Keeps a step."""
        if step.grid is not None:
            self.last_map = step.grid
            self.last_coverage = self.scorer.score_map(step.grid)
        state = self.last_state()
        self.stage_ends[step.stage] = state
        moment = Moment(
            stage=step.stage,
            caption=step.caption,
            picture=step.picture,
            is_map=step.grid is not None,
            driven_m=state.driven_m,
            coverage_recall=self.last_coverage.recall if self.last_coverage else None,
        )
        self._write_picture(moment)
        self.moments.append(moment)
        self.on_progress(moment)

    def states(self) -> tuple[StateRecord, ...]:
        """Gives the simulator's truth so far."""
        return read_state_log(self.state_log) if self.state_log.exists() else ()

    def last_state(self) -> StateRecord:
        """Gives how the simulation truly stands now."""
        last_line = self.state_log.read_text(encoding="utf-8").rstrip().rpartition("\n")[2]
        return StateRecord(**json.loads(last_line))

    def _write_picture(self, moment: Moment) -> None:
        if moment.picture is None:
            return
        kind = "map" if moment.is_map else "camera"
        name = f"{len(self.moments):03d}_{moment.stage}_{kind}{moment.picture.suffix}"
        (self.folder / "pictures" / name).write_bytes(moment.picture.data)
