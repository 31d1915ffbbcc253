"""A run as people see it: a bar while it goes on, a table in the end."""

from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from mapspeak.evaluation.scores import TableRow
from mapspeak.evaluation.trials import RunPlan, TrialResult, TrialState

__all__ = ["RunBar", "build_table", "show_run"]

SHOWN = ("coverage_recall", "coverage_known_ratio", "spl", "driven_m", "n_calls", "wall_s")


@dataclass(slots=True)
class RunBar:
    """Counts results while they come in.

    Attributes:
        progress: The bar.
        bar: Its line.
        n_asked: Trials and preparations that were asked for; 0 before that is known.
        n_done: Those with a result.
        n_broken: Trials that crashed or hung, preparations among them.
    """

    progress: Progress
    bar: TaskID
    n_asked: int = 0
    n_done: int = 0
    n_broken: int = 0
    _n_successes: int = 0
    _preparations: frozenset[str] = frozenset()

    def begin(self, plan: RunPlan) -> None:
        """Takes note of how much there is to do, and begins to show it."""
        self._preparations = frozenset(trial.id for trial in plan.preparations)
        self.n_asked = len(plan.trials) + len(plan.preparations)
        self.progress.update(self.bar, total=self.n_asked)
        self.progress.start()

    def note(self, result: TrialResult) -> None:
        """Takes note of a result."""
        self.n_broken += result.state in (TrialState.CRASHED, TrialState.HUNG)
        self.n_done += 1
        if result.trial.id not in self._preparations:
            self._n_successes += result.score.is_success
        said = f"{self._n_successes} done, {self.n_broken} broken; last {result.trial.id}"
        self.progress.update(self.bar, advance=1, description=said)

    def tell(self, said: str) -> None:
        """Says something besides."""
        self.progress.console.print(said, markup=False, highlight=False, soft_wrap=True)


@contextmanager
def show_run(*, is_quiet: bool) -> Generator[RunBar]:
    """Offers something to tell results to; it draws on standard error, or nothing at all."""
    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.description}"),
    )
    progress = Progress(*columns, console=Console(stderr=True), disable=is_quiet)
    try:
        yield RunBar(progress, progress.add_task("starting", total=None))
    finally:
        progress.stop()


def build_table(rows: Sequence[TableRow]) -> Table:
    """Gives the rows as a table for the terminal."""
    table = Table("task", "agent", "map shown as", "done", "95 %", *SHOWN, "broken", "failures")
    for row in rows:
        success = row.success
        span = "" if success is None else f"{100 * success.low:.0f} to {100 * success.high:.0f} %"
        figures = (row.figures.get(name) for name in SHOWN)
        table.add_row(
            row.task if row.world is None else f"{row.task} in {row.world}",
            row.agent,
            row.representation,
            f"{row.n_successes}/{row.n_trials}",
            span,
            *("" if figure is None else f"{figure.value:.3g}" for figure in figures),
            str(row.n_broken or ""),
            ", ".join(f"{failure} {count}" for failure, count in row.failures.items()),
        )
    return table
