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
from rich.table import Column, Table

from mapspeak.evaluation.scores import TableRow
from mapspeak.evaluation.trials import RunPlan, TrialResult, TrialState

__all__ = ["RunBar", "build_table", "show_run"]

SHOWN = {
    "coverage_recall": "recall",
    "coverage_known_ratio": "known",
    "spl": "SPL",
    "driven_m": "driven m",
    "n_calls": "calls",
    "wall_s": "wall s",
}
"""Figures with their headings, short enough for a terminal of eighty columns."""
BAR_WIDTH = 16


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
        n_first = len(plan.preparations)
        worlds = "a world" if n_first == 1 else f"{n_first} worlds"
        first = f"exploring {worlds} first" if n_first else "starting"
        self.progress.update(self.bar, total=self.n_asked, description=first)
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
        BarColumn(bar_width=BAR_WIDTH),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        # What does not fit is cut, and not the numbers before it.
        TextColumn(
            "{task.description}", table_column=Column(ratio=1, no_wrap=True, overflow="ellipsis")
        ),
    )
    console = Console(stderr=True)
    progress = Progress(*columns, console=console, disable=is_quiet, expand=True)
    try:
        yield RunBar(progress, progress.add_task("starting", total=None))
    finally:
        progress.stop()


def build_table(rows: Sequence[TableRow]) -> Table:
    """Gives the rows as a table for the terminal, without columns that say nothing."""
    headings = ("task", "agent", "map shown as", "done", "95 %", *SHOWN.values())
    headings = (*headings, "broken", "failures")
    cells = [_cells_of(row) for row in rows]
    kept = [column for column in range(len(headings)) if any(row[column] for row in cells)]
    table = Table(*(Column(headings[column], overflow="fold") for column in kept))
    for row in cells:
        table.add_row(*(row[column] for column in kept))
    return table


def _cells_of(row: TableRow) -> tuple[str, ...]:
    success = row.success
    span = "" if success is None else f"{100 * success.low:.0f} to {100 * success.high:.0f} %"
    figures = (row.figures.get(name) for name in SHOWN)
    return (
        row.task if row.world is None else f"{row.task} in {row.world}",
        row.agent,
        row.representation,
        f"{row.n_successes}/{row.n_trials}",
        span,
        *("" if figure is None else f"{figure.value:.3g}" for figure in figures),
        str(row.n_broken or ""),
        ", ".join(f"{failure} {count}" for failure, count in row.failures.items()),
    )
