"""Every figure of a report, counted from the results that are there and from nothing else."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from pydantic import TypeAdapter

from mapspeak import __version__
from mapspeak.evaluation.report.curves import Curve, trace_coverage
from mapspeak.evaluation.report.gathering import Attempt, Run, Standing, read_course
from mapspeak.evaluation.report.paper import PAPER_NOTE, PAPER_ROWS, PAPER_TASKS, PaperRow
from mapspeak.evaluation.scores import Interval, TableRow, bootstrap_interval, count_rows
from mapspeak.evaluation.trials import Sitting, Trial, TrialResult, TrialState

__all__ = [
    "AgentRow",
    "Counts",
    "OurPaperRow",
    "Problem",
    "Report",
    "ReportRow",
    "build_report",
    "dump_report",
]

SPENT = ("n_input_tokens", "n_output_tokens", "n_picture_tokens", "n_calls", "wall_s", "robot_s")
"""What a decision costs."""
ALL_TASKS = "all tasks"
SCRIPTS = {
    "scripted": "a script that uses mapspeak's tools; no model",
    "oracle": "a script that knows the truth; no model",
    "random": "a script that acts by chance; no model",
    "nearest-frontier": "a script that drives to the nearest frontier; no model",
    "paper-loop": "a script that follows the paper's loop; no model",
    "mock": "a stand-in for a model, for tests; no model",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Counts:
    """How many trials there are.

    Attributes:
        n_asked: Asked for.
        n_preparations: Explorations that were not asked for and that gave others map and memory;
            they are in no figure.
        n_counted: In the figures: those that ended, and those that were only begun.
        n_successes: Done.
        n_standing: How many stand how.
    """

    n_asked: int
    n_preparations: int
    n_counted: int
    n_successes: int
    n_standing: dict[Standing, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class AgentRow:
    """One that was asked to answer.

    Attributes:
        agent: Its name, with how much it may think where that was said.
        kind: What it is.
        n_asked: Trials that were asked for.
        n_counted: Trials that count; where there are none, no figure is given.
    """

    agent: str
    kind: str
    n_asked: int
    n_counted: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportRow:
    """The trials of one task, agent and representation.

    Attributes:
        counted: Success, means and kinds of failure. Trials that crashed, hung or were only begun
            count as not successful, and in no mean.
        n_asked: Trials that were asked for; the rest were not run or cannot be read.
        n_unfinished: Of those counted, how many were begun and have no result.
        per_decision: What one decision cost, by name: tokens, calls, seconds.
    """

    counted: TableRow
    n_asked: int
    n_unfinished: int
    per_decision: dict[str, Interval]


@dataclass(frozen=True, slots=True, kw_only=True)
class OurPaperRow:
    """One agent in the paper's table; None for a task of which no trial counts.

    Attributes:
        agent: Who answered.
        representation: How the map was shown.
        explore: Task 1.
        smallest_room: Task 2.
        fire_tool: Task 3.
    """

    agent: str
    representation: str
    explore: TableRow | None
    smallest_room: TableRow | None
    fire_tool: TableRow | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """Something that could not be read.

    Attributes:
        trial_id: Of which trial.
        what: What is wrong with it.
    """

    trial_id: str
    what: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """Everything that report.json holds.

    Attributes:
        reported_with: The mapspeak that made the report; the run's own is among `versions`.
        versions: What the run was made with.
        options: What was asked for.
        earlier: Sittings of the run before, with other versions or options.
        counts: How many trials there are.
        agents: Who was asked.
        paper: The paper's table, as printed.
        paper_note: What it is and is not.
        beside_paper: Ours.
        rows: By task, agent and representation.
        rows_by_world: The same in each world.
        all_tasks: By agent and representation, over all trials that count; every trial weighs the
            same, so a task with more trials weighs more.
        curves: Coverage over metres, of trials that explore.
        problems: What could not be read.
    """

    reported_with: str
    versions: dict[str, str]
    options: dict[str, object]
    earlier: tuple[Sitting, ...]
    counts: Counts
    agents: tuple[AgentRow, ...]
    paper: tuple[PaperRow, ...]
    paper_note: str
    beside_paper: tuple[OurPaperRow, ...]
    rows: tuple[ReportRow, ...]
    rows_by_world: tuple[TableRow, ...]
    all_tasks: tuple[TableRow, ...]
    curves: tuple[Curve, ...]
    problems: tuple[Problem, ...]


_REPORT: TypeAdapter[Report] = TypeAdapter(Report)


def dump_report(report: Report) -> bytes:
    """Gives report.json."""
    return _REPORT.dump_json(report, indent=2) + b"\n"


def build_report(run: Run) -> Report:
    """Counts everything of a run that is there."""
    rows = count_rows(run.results)
    curves, problems = _trace(run)
    return Report(
        reported_with=__version__,
        versions=run.plan.versions,
        options=run.plan.options,
        earlier=run.plan.earlier,
        counts=_count(run),
        agents=_list_agents(run),
        paper=PAPER_ROWS,
        paper_note=PAPER_NOTE,
        beside_paper=_beside_paper(rows),
        rows=tuple(_with_costs(row, run) for row in rows),
        rows_by_world=count_rows(run.results, by_world=True),
        all_tasks=count_rows(map(_of_any_task, run.results)),
        curves=curves,
        problems=(*_unreadable(run), *problems),
    )


def say_kind(agent: str) -> str:
    """Says what an agent is, so that no script is taken for a model."""
    if agent in SCRIPTS:
        return SCRIPTS[agent]
    if agent.startswith("command:"):
        return "a client program with the server configured"
    if agent.startswith("mockllm/"):
        return SCRIPTS["mock"]
    return "a model" if "/" in agent else "an agent"


def _count(run: Run) -> Counts:
    standings = [each.standing for each in run.attempts]
    return Counts(
        n_asked=len(run.attempts),
        n_preparations=len(run.plan.preparations),
        n_counted=len(run.results),
        n_successes=sum(result.score.is_success for result in run.results),
        n_standing={each: standings.count(each) for each in Standing if each in standings},
    )


def _list_agents(run: Run) -> tuple[AgentRow, ...]:
    groups: dict[str, list[Attempt]] = {}
    for each in run.attempts:
        groups.setdefault(each.trial.answerer, []).append(each)
    return tuple(
        AgentRow(
            agent=agent,
            kind=say_kind(attempts[0].trial.agent),
            n_asked=len(attempts),
            n_counted=sum(each.result is not None for each in attempts),
        )
        for agent, attempts in groups.items()
    )


def _of_any_task(result: TrialResult) -> TrialResult:
    return replace(result, trial=replace(result.trial, task=ALL_TASKS))


def _beside_paper(rows: Sequence[TableRow]) -> tuple[OurPaperRow, ...]:
    tasks: dict[tuple[str, str], dict[str, TableRow]] = {}
    for row in rows:
        if row.task in PAPER_TASKS:
            tasks.setdefault((row.agent, row.representation), {})[row.task] = row
    explore, smallest_room, fire_tool = PAPER_TASKS
    return tuple(
        OurPaperRow(
            agent=agent,
            representation=representation,
            explore=found.get(explore),
            smallest_room=found.get(smallest_room),
            fire_tool=found.get(fire_tool),
        )
        for (agent, representation), found in tasks.items()
    )


def _with_costs(row: TableRow, run: Run) -> ReportRow:
    mine = [each for each in run.attempts if _is_of(each.trial, row)]
    results = [
        each.result
        for each in mine
        if each.result is not None
        and each.result.state not in (TrialState.CRASHED, TrialState.HUNG)
    ]
    return ReportRow(
        counted=row,
        n_asked=len(mine),
        n_unfinished=sum(each.standing is Standing.UNFINISHED for each in mine),
        per_decision=_per_decision(results),
    )


def _is_of(trial: Trial, row: TableRow) -> bool:
    key = (trial.task, trial.answerer, trial.representation)
    return key == (row.task, row.agent, row.representation)


def _per_decision(results: Iterable[TrialResult]) -> dict[str, Interval]:
    """Gives what a decision cost on average, over the trials in which any was made."""
    deciding = [result for result in results if result.n_decisions]
    means: dict[str, Interval] = {}
    for name in SPENT:
        spent = [(getattr(result, name), result.n_decisions) for result in deciding]
        shares = [value / n_decisions for value, n_decisions in spent if value is not None]
        interval = bootstrap_interval(shares)
        if interval is not None:
            means[name] = interval
    return means


def _unreadable(run: Run) -> Iterable[Problem]:
    for each in run.attempts:
        if each.problem is not None:
            what = f"result.json cannot be read and is skipped: {each.problem}."
            yield Problem(trial_id=each.trial.id, what=what)


def _trace(run: Run) -> tuple[tuple[Curve, ...], tuple[Problem, ...]]:
    """Reads the trials that explored for their coverage over metres."""
    curves: list[Curve] = []
    problems: list[Problem] = []
    for each in run.attempts:
        if each.result is None or each.trial.task != PAPER_TASKS[0]:
            continue
        course = read_course(run.folder, each.trial)
        curve = trace_coverage(each.result, course)
        if curve is not None:
            curves.append(curve)
        problems += (Problem(trial_id=each.trial.id, what=what) for what in course.problems)
    return tuple(curves), tuple(problems)
