"""`mapspeak eval`: tasks, agents and worlds, trial by trial, scored from the simulator's truth."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mapspeak.cli.shared.options import INTERRUPTED, require_finite
from mapspeak.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from mapspeak.evaluation.runs.plan import RunOptions, RunPlan
    from mapspeak.evaluation.trials import TrialResult

TABLE_WIDTH = 180
"""Width of the table in characters where the terminal's is unknown, as in a file."""


def _split(_context: click.Context, _parameter: click.Parameter, value: str) -> tuple[str, ...]:
    """Return the parts between the commas, each once."""
    return tuple(dict.fromkeys(part.strip() for part in value.split(",") if part.strip()))


@click.command("eval")
@click.option(
    "--agent",
    "agents",
    callback=_split,
    default="scripted",
    show_default=True,
    help="Who answers, comma-separated: scripted, near-sighted, bearings, blind, oracle, "
    "random, nearest-frontier, paper-loop, mock, PROVIDER/MODEL for a model, command:PROGRAM for a "
    "client program.",
)
@click.option(
    "--task",
    "tasks",
    callback=_split,
    default="paper",
    show_default=True,
    help="Tasks, or groups of them: paper, rooms, objects, relations, routes, search, questions, "
    "failures, errands, inspection, all.",
)
@click.option(
    "--worlds",
    callback=_split,
    default="flat_1",
    show_default=True,
    help="Worlds, world files or maps, comma-separated; all: those that come with mapspeak.",
)
@click.option(
    "--trials",
    "n_trials",
    type=click.IntRange(min=1),
    default=3,
    show_default=True,
    help="Of each task in each world; a world is explored once.",
)
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Of each first trial; the next has the next.",
)
@click.option(
    "--out",
    "folder",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("out/eval"),
    show_default=True,
    help="Where everything goes; what is done there already is not done again.",
)
@click.option(
    "--representation",
    "representations",
    callback=_split,
    default="picture-table",
    show_default=True,
    help="How the server shows the map, comma-separated: picture-table, table, picture-rooms, "
    "picture-numbers, paper-picture, raw-grid.",
)
@click.option(
    "--thinking",
    callback=lambda *given: _split(*given) or (None,),
    default="",
    help="How much a model may think, comma-separated: none, low, medium, high. Without it the "
    "provider decides.",
)
@click.option(
    "--jobs",
    "n_jobs",
    type=click.IntRange(min=1),
    default=2,
    show_default=True,
    help="Trials at a time.",
)
@click.option(
    "--hang-s",
    type=click.FloatRange(min=1.0),
    callback=require_finite,
    default=1200.0,
    show_default=True,
    help="A trial without a turn for so long by the wall clock is killed; the others go on.",
)
@click.option(
    "--retry",
    "has_retry",
    is_flag=True,
    help="Run also those again that crashed or hung before.",
)
@click.option("--quiet", "is_quiet", is_flag=True, help="Show no progress.")
@click.option(
    "--report",
    "is_report_only",
    is_flag=True,
    help="Run nothing; make page and log of --out anew from all results that are there.",
)
def evaluate(*, folder: Path, is_quiet: bool, is_report_only: bool, **chosen: Any) -> None:  # noqa: ANN401 - fields of RunOptions
    """Run tasks in simulated worlds and score them by the simulator's truth.

    Without options this is a small try: a script, the paper's three tasks, one flat. The paper's
    trials in every world are: mapspeak eval --worlds all --trials 30

    Started again with the same folder, it goes on where it was left off. The exit status is 0 when
    every trial came to a result, whatever the result is; 1 when one crashed or hung; 2 when
    something that was asked for does not exist; 130 after Ctrl-C or SIGTERM. With --report it is 1
    also when a trial that was begun in that folder, or waited there for its turn, has no result.
    """
    from mapspeak.evaluation.agents.catalogue import check_agent  # noqa: PLC0415 - heavy; help must be quick
    from mapspeak.evaluation.runs.plan import RunOptions  # noqa: PLC0415

    if is_report_only:
        sys.exit(_report(folder))
    options = RunOptions(folder=folder, **chosen)
    for agent in options.agents:
        for amount in options.thinking:
            check_agent(agent, amount)
    sys.exit(_run(options, is_quiet=is_quiet))


def _report(folder: Path) -> int:
    """Make page and log of a run's folder from all results in it, and return the exit status."""
    from mapspeak.evaluation.runs.runner import writing_to  # noqa: PLC0415 - heavy
    from mapspeak.evaluation.trials import count_asked, read_results  # noqa: PLC0415

    results = read_results(folder)
    if not results:
        raise ConfigError(
            f"{folder} holds no result of an evaluation.",
            hint="Name the folder that was given as --out.",
        )
    with writing_to(folder):
        _write_report(folder, results, {})
    n_asked = max(count_asked(folder), len(results))
    if n_missing := n_asked - len(results):
        click.echo(f"{n_missing} of {n_asked} trials have no result.", err=True)
    return 1 if n_missing or any(each.state.is_broken for each in results) else 0


def _write_report(
    folder: Path,
    results: "Sequence[TrialResult]",
    versions: "Mapping[str, str]",
) -> None:
    from mapspeak.evaluation.report.page import write_page  # noqa: PLC0415 - heavy
    from mapspeak.evaluation.runs.inspectlog import write_log  # noqa: PLC0415

    log = write_log(folder, results, versions)
    click.echo(f"The trials can be replayed in {write_page(folder, results)}; the log is {log}.")


def _run(options: "RunOptions", *, is_quiet: bool) -> int:
    """Run an evaluation, print its table, and return the exit status."""
    from rich.console import Console  # noqa: PLC0415 - heavy; help must be quick

    from mapspeak.evaluation.runs.runner import run_evaluation  # noqa: PLC0415
    from mapspeak.evaluation.runs.showing import RunBar, announce, build_table  # noqa: PLC0415
    from mapspeak.evaluation.scores.rows import count_rows  # noqa: PLC0415

    done: list[TrialResult] = []
    with RunBar(is_quiet=is_quiet) as bar:

        def on_plan(plan: "RunPlan") -> None:
            if not is_quiet:
                click.echo(announce(options, plan), err=True)
            bar.begin(plan)

        def on_done(result: "TrialResult") -> None:
            done.append(result)
            bar.note(result)

        try:
            plan = run_evaluation(options, on_plan=on_plan, on_done=on_done)
        except KeyboardInterrupt:
            bar.progress.stop()
            click.echo(f"Stopped: {bar.n_done} of {bar.n_asked} are done.", err=True)
            return INTERRUPTED
    found = {result.trial: result for result in done}
    results = [found[trial] for trial in plan.trials]
    console = Console()
    if not console.is_terminal:
        console.width = TABLE_WIDTH
    console.print(build_table(count_rows(results), width=console.width))
    _write_report(options.folder, results, plan.versions)
    return 1 if bar.n_broken else 0
