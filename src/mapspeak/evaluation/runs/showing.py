"""A run and a trial as people see them: a bar while they go on, a table in the end.

A bar is drawn only where standard error is a terminal; elsewhere each result is a line.
"""

from collections.abc import Sequence
from typing import Self

from rich.console import Console
from rich.markup import escape
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Column, Table

from mapspeak.evaluation.agents.catalogue import can_think, is_script
from mapspeak.evaluation.runs.plan import RunOptions, RunPlan
from mapspeak.evaluation.scores.rows import TableRow, wilson_interval
from mapspeak.evaluation.tasks.catalogue import EXPLORE
from mapspeak.evaluation.trials import Trial, TrialResult, Turn

SHOWN = {
    "coverage_recall": "recall",
    "coverage_known_ratio": "known",
    "faced_near_ratio": "faced",
    "spl": "SPL",
    "driven_m": "driven m",
    "n_calls": "calls",
    "wall_s": "wall s",
}
"""Figures with their headings, short enough for a terminal of eighty columns."""
BAR_WIDTH = 12
EXPLORATION_S, TRIAL_S = 26.0, 1.0
"""Mean core time of a script's trials over all worlds, for the announcement."""
SPARE_TEXT = Column(ratio=1, no_wrap=True, overflow="ellipsis")
"""This column is cut if space is short, not the numbers before it."""


def announce(options: RunOptions, plan: RunPlan) -> str:
    """Say how many trials there are, about how long they take, and how to interrupt."""
    trials = (*plan.preparations, *plan.trials)
    n_worlds = len({trial.world for trial in trials})
    worlds = "1 world" if n_worlds == 1 else f"{n_worlds} worlds"
    names = ", ".join(options.agents)
    cost_s = sum(EXPLORATION_S if trial.task == EXPLORE else TRIAL_S for trial in trials)
    minutes = max(round(cost_s / min(options.n_jobs, 2) / 60), 1)
    long = f"about {minutes} min on two idle cores"
    if any(map(can_think, options.agents)):
        long = "as long as whoever answers takes"
    return (
        f"{len(trials)} trials in {worlds} by {names}, {options.n_jobs} at a time: {long}. "
        "Ctrl-C stops; the same command goes on."
    )


def say_result(result: TrialResult) -> str:
    """Say in a coloured line what came of a trial, as markup of rich."""
    if result.score.is_success:
        word = "[bold green]done  [/]"
    else:
        word = "[bold red]BROKEN[/]" if result.state.is_broken else "[bold red]FAILED[/]"
    asked = (result.prompt or result.trial.task).rstrip(".")
    return f"{word}  {escape(asked)}: {escape(result.score.reason)}"


class _Bar:
    """A bar on standard error, where that is a terminal; it is there until the context ends."""

    def __init__(self, *columns: ProgressColumn, is_quiet: bool) -> None:
        console = Console(stderr=True)
        text = TextColumn("{task.description}", table_column=SPARE_TEXT)
        is_off = is_quiet or not console.is_terminal
        self.progress = Progress(
            *columns, text, console=console, disable=is_off, expand=True, transient=True
        )
        self._bar = self.progress.add_task("starting", total=None)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.progress.stop()

    def tell(self, said: str) -> None:
        """Say something above the bar."""
        self.progress.console.print(said, markup=False, highlight=False, soft_wrap=True)


class RunBar(_Bar):
    """Counts results while they come in.

    Attributes:
        n_asked: Trials and preparations that were asked for; 0 before that is known.
        n_broken: Trials that crashed or hung, preparations among them.
    """

    def __init__(self, *, is_quiet: bool) -> None:
        numbers = (MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn())
        super().__init__(BarColumn(bar_width=BAR_WIDTH), *numbers, is_quiet=is_quiet)
        self.n_asked = self.n_done = self.n_broken = self._n_successes = 0
        self._preparations: tuple[Trial, ...] = ()

    def begin(self, plan: RunPlan) -> None:
        """Take note of how much there is to do, and begin to show it."""
        self._preparations = plan.preparations
        self.n_asked = len(plan.trials) + len(plan.preparations)
        self.progress.update(self._bar, total=self.n_asked, description="starting")
        self.progress.start()

    def note(self, result: TrialResult) -> None:
        """Take note of a result."""
        self.n_broken += result.state.is_broken
        self.n_done += 1
        if result.trial not in self._preparations:
            self._n_successes += result.score.is_success
        said = f"{self._n_successes} done, {self.n_broken} broken; last {result.trial.id}"
        self.progress.update(self._bar, advance=1, description=said)
        if not self.progress.console.is_terminal:
            self.tell(f"{self.n_done}/{self.n_asked} {result.trial.id}: {result.score.reason}")


class TrialBar(_Bar):
    """Shows a trial while it goes on."""

    def __init__(self, *, is_quiet: bool) -> None:
        super().__init__(
            TextColumn("{task.fields[stage]:<13}"),
            BarColumn(bar_width=BAR_WIDTH),
            TextColumn("{task.fields[n_calls]:>4} calls"),
            TimeElapsedColumn(),
            is_quiet=is_quiet,
        )
        self._n_calls = 0
        self.progress.update(self._bar, stage="", n_calls=0)

    def begin(self, task: str) -> None:
        """Show that a trial begins."""
        self._n_calls = 0
        self.progress.update(self._bar, stage=task, n_calls=0, description="starting")
        self.progress.start()

    def note(self, turn: Turn) -> None:
        """Show a turn of it."""
        if turn.call is not None and turn.role != "tool":
            self._n_calls += 1
            said = " ".join((turn.call.tool, *map(str, turn.call.arguments.values())))
            self.progress.update(self._bar, n_calls=self._n_calls, description=escape(said))


def build_table(rows: Sequence[TableRow], *, width: int) -> Table:
    """Return the rows as a table for the terminal, without columns that say nothing.

    What all rows share stands above it. Figures that do not fit in the width are left out from
    the last on, and named below it.

    Args:
        width: Of the terminal, in characters.
    """
    headings = ("task", "agent", "map shown as", "done", "95 %", "failures", "broken")
    columns = list(zip((*headings, *SHOWN.values()), *map(_cells_of, rows), strict=True))
    kept = [column for column in columns if any(column[1:])]
    shared = [column for column in kept[1:3] if len(set(column[1:])) == 1]
    kept = [column for column in kept if column not in shared]
    n_first = sum(column[0] in headings for column in kept)
    n_shown = len(kept)
    while n_shown > n_first and _measure(kept[:n_shown]) > width:
        n_shown -= 1
    left_out = ", ".join(heading for heading, *_ in kept[n_shown:])
    table = Table(
        *(Column(heading, overflow="fold") for heading, *_ in kept[:n_shown]),
        title=", ".join(f"{heading}: {cell}" for heading, cell, *_ in shared),
        caption=f"Wider terminals and files show more: {left_out}." if left_out else None,
    )
    for row in list(zip(*kept[:n_shown], strict=True))[1:]:
        table.add_row(*row)
    return table


def _measure(columns: Sequence[Sequence[str]]) -> int:
    """Return the width of a table of columns, with a line and two spaces for each."""
    return 1 + sum(3 + max(map(len, column)) for column in columns)


def _cells_of(row: TableRow) -> tuple[str, ...]:
    success = wilson_interval(row.n_successes, row.n_trials)
    span = "" if success is None else f"{100 * success.low:.0f} to {100 * success.high:.0f} %"
    figures = (row.figures.get(name) for name in SHOWN)
    return (
        row.task,
        f"{row.agent} (script)" if is_script(row.agent) else row.agent,
        row.representation,
        f"{row.n_successes}/{row.n_trials}",
        span,
        ", ".join(f"{failure} {count}" for failure, count in row.failures.items()),
        str(row.n_broken or ""),
        *("" if figure is None else f"{figure:.3g}" for figure in figures),
    )
