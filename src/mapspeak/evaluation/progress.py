"""A progress bar for people who watch a run: coverage, metres, and what happens."""

from collections.abc import Callable, Generator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from mapspeak.evaluation.page import Moment

__all__ = ["show_progress"]


@contextmanager
def show_progress(*, is_quiet: bool) -> Generator[Callable[[Moment], None]]:
    """Offers something to tell each moment to; it draws on standard error, or nothing at all."""
    columns = (
        TextColumn("{task.fields[stage]}"),
        BarColumn(),
        TextColumn("{task.percentage:>5.1f} % covered"),
        TextColumn("{task.fields[driven_m]:.0f} m"),
        TimeElapsedColumn(),
        TextColumn("{task.description}"),
    )
    with Progress(*columns, console=Console(stderr=True), disable=is_quiet) as progress:
        bar = progress.add_task("starting", total=1.0, stage="task1", driven_m=0.0)

        def tell(moment: Moment) -> None:
            progress.update(
                bar,
                completed=moment.coverage_recall or 0.0,
                description=moment.caption[:60],
                stage=moment.stage,
                driven_m=moment.driven_m,
            )

        yield tell
