"""The figures of a report as sections of its page."""

from collections import Counter
from collections.abc import Iterator, Sequence

from mapspeak.evaluation.report.figures import OurPaperRow, Report, ReportRow
from mapspeak.evaluation.report.markup import Html, element, table, text
from mapspeak.evaluation.report.paper import PaperRow
from mapspeak.evaluation.report.plots import Bar, Series, plot_bars, plot_coverage
from mapspeak.evaluation.report.wording import (
    NOTHING,
    cell,
    figure_cell,
    say_broken,
    say_percent,
    share_cell,
)
from mapspeak.evaluation.scores import Interval, TableRow

__all__ = ["show_figures"]

COSTS = (
    ("n_input_tokens", "tokens read"),
    ("n_picture_tokens", "picture tokens, estimated"),
    ("n_output_tokens", "tokens written"),
    ("n_calls", "calls"),
    ("n_decisions", "decisions"),
    ("driven_m", "metres"),
    ("robot_s", "robot s"),
    ("wall_s", "wall s"),
)
PER_DECISION = (
    ("n_input_tokens", "tokens read"),
    ("n_picture_tokens", "picture tokens, estimated"),
    ("n_output_tokens", "tokens written"),
    ("n_calls", "calls"),
    ("robot_s", "robot s"),
    ("wall_s", "wall s"),
)
TOGETHER = tuple(each for each in COSTS if each[0] not in {"driven_m", "robot_s", "n_decisions"})
BROKEN_NOTE = (
    "A trial that crashed, hung, or was begun and has no result counts as not successful, and in "
    "no mean. One that was not begun, or whose result cannot be read, counts nowhere. "
    "Shares are given with Wilson's interval, means with a bootstrap interval, both at 95 %; "
    "a mean without one is of a single trial or of equal values."
)


def show_figures(report: Report) -> Iterator[Html]:
    """Gives all sections above the trials."""
    keys = dict.fromkeys((row.counted.agent, row.counted.representation) for row in report.rows)
    series = Series(tuple(keys))
    yield element("h1", {}, text("mapspeak: an evaluation"))
    yield from _show_counts(report)
    yield from _show_paper(report)
    yield from _show_success(report.rows, series)
    yield from _show_all_tasks(report)
    yield from _show_curves(report, series)
    yield from _show_failures(report.rows)
    yield from _show_costs(report.rows)
    yield from _show_worlds(report.rows_by_world)
    yield from _show_run(report)


def _heading(name: str, said: str) -> Html:
    return element("h2", {"id": name}, text(said))


def _show_counts(report: Report) -> Iterator[Html]:
    counts = report.counts
    standing = ", ".join(f"{count} {name}" for name, count in counts.n_standing.items())
    said = (
        f"{counts.n_successes} of {counts.n_counted} trials were done as asked. "
        f"Asked for were {counts.n_asked}: {standing}."
    )
    yield element("p", {"class": "lead"}, text(said))
    yield element("p", {}, text(BROKEN_NOTE))
    if counts.n_preparations:
        said = (
            f"{counts.n_preparations} scripted explorations went before them, whose map and memory "
            "the others start from; they are in no figure."
        )
        yield element("p", {}, text(said))
    if report.earlier:
        said = "It was run in several sittings, with other versions or options: see What was run."
        yield element("p", {"class": "problem"}, text(said))
    if counts.n_counted < counts.n_asked:
        yield element(
            "p", {"class": "problem"}, text("This run is not complete: the report shows a part.")
        )


def _show_paper(report: Report) -> Iterator[Html]:
    yield _heading("paper", "Beside the paper")
    heading = ("who", "Task 1: coverage", "Task 2: smallest room", "Task 3: tool for fire")
    kinds = {row.agent: row.kind for row in report.agents}
    ours = (_our_row(row, kinds[row.agent]) for row in report.beside_paper)
    rows = [*map(_paper_row, report.paper), *ours]
    yield table(heading, rows, kind="paper")
    if not report.beside_paper:
        yield element("p", {}, text("None of the paper's tasks has been run here yet."))
    yield element("p", {"class": "note"}, text(report.paper_note))


def _paper_row(row: PaperRow) -> list[Html]:
    name = element("td", {}, text(row.model), element("small", {}, text("the paper, not run here")))
    coverage = cell(f"{say_percent(row.coverage_paper_ratio)} of one warehouse")
    return [
        name,
        coverage,
        _paper_share(row.n_smallest_room, row.n_trials, row.smallest_room),
        _paper_share(row.n_fire_tool, row.n_trials, row.fire_tool),
    ]


def _paper_share(n_successes: int, n_trials: int, share: Interval | None) -> Html:
    if share is None:
        return cell(NOTHING)
    said = text(f"{n_successes}/{n_trials} ({say_percent(share.value)})")
    span = text(f"{say_percent(share.low)} to {say_percent(share.high)}")
    return element("td", {}, said, element("small", {}, span))


def _our_row(row: OurPaperRow, kind: str) -> list[Html]:
    who = element("small", {}, text(f"here, {row.representation}: {kind}"))
    return [
        element("td", {}, text(row.agent), who),
        _coverage_cell(row.explore),
        share_cell(row.smallest_room),
        share_cell(row.fire_tool),
    ]


def _coverage_cell(row: TableRow | None) -> Html:
    if row is None:
        return cell("not run", kind="none")
    names = ("paper_ratio", "recall", "known_ratio")
    ratio, recall, known = (row.figures.get(f"coverage_{name}") for name in names)
    done = f"{row.n_successes}/{row.n_trials} explorations done{say_broken(row)}"
    if ratio is None or recall is None:
        return cell(done)
    said = f"{say_percent(ratio.value)} by the paper's ratio, {say_percent(recall.value)} recall"
    if known is not None:
        said = f"{said}, {say_percent(known.value)} known"
    span = f"{say_percent(recall.low)} to {say_percent(recall.high)} recall; "
    span = done if recall.low == recall.high else f"{span}{done}"
    return element("td", {}, text(said), element("small", {}, text(span)))


def _show_success(rows: Sequence[ReportRow], series: Series) -> Iterator[Html]:
    yield _heading("success", "Success")
    if not rows:
        yield element("p", {}, text("No trial has come to a result yet."))
        return
    yield series.legend()
    ordered = sorted(rows, key=lambda row: _task_order(rows, row))
    yield plot_bars(_success_bars(ordered), series)
    heading = ("task", "agent", "map shown as", "done", "SPL", "crashed or hung", "unfinished")
    yield table((*heading, "not run or unreadable"), map(_success_line, ordered), kind="success")
    ways = list(_spl_bars(ordered))
    if ways:
        yield element("h3", {}, text("Success weighted by path length (SPL)"))
        yield plot_bars(ways, series)


def _task_order(rows: Sequence[ReportRow], row: ReportRow) -> int:
    """Gives the place of a row's task among the tasks, so that each stands in one block."""
    return list(dict.fromkeys(each.counted.task for each in rows)).index(row.counted.task)


def _success_bars(rows: Sequence[ReportRow]) -> Iterator[Bar]:
    for row in (each.counted for each in rows):
        if row.success is not None:
            said = f"{row.n_successes}/{row.n_trials}"
            yield _bar(row, row.success, said)


def _spl_bars(rows: Sequence[ReportRow]) -> Iterator[Bar]:
    for row in (each.counted for each in rows):
        if "spl" in row.figures:
            yield _bar(row, row.figures["spl"], f"{row.figures['spl'].value:.2f}")


def _bar(row: TableRow, value: Interval, said: str) -> Bar:
    return Bar(
        group=row.task, agent=row.agent, representation=row.representation, value=value, said=said
    )


def _success_line(row: ReportRow) -> list[Html]:
    counted = row.counted
    return [
        cell(counted.task),
        cell(counted.agent),
        cell(counted.representation),
        share_cell(counted),
        figure_cell(counted.figures.get("spl")),
        cell(counted.n_broken - row.n_unfinished or NOTHING),
        cell(row.n_unfinished or NOTHING),
        cell(row.n_asked - counted.n_trials or NOTHING),
    ]


def _show_all_tasks(report: Report) -> Iterator[Html]:
    """Shows what each agent and each way of showing the map is worth, where there is a choice."""
    if len(report.rows) == len(report.all_tasks):
        return
    yield element("h3", {}, text("All tasks together"))
    known = _known(TOGETHER, [row.figures for row in report.all_tasks])
    heading = ("agent", "map shown as", "done", *(said for _, said in known))
    lines = (
        [
            cell(row.agent),
            cell(row.representation),
            share_cell(row),
            *(figure_cell(row.figures.get(name)) for name, _ in known),
        ]
        for row in report.all_tasks
    )
    yield table(heading, lines, kind="all-tasks")
    said = "Every trial weighs the same; tokens, calls and seconds are means of one trial."
    yield element("p", {"class": "note"}, text(said))


def _show_curves(report: Report, series: Series) -> Iterator[Html]:
    if not report.curves:
        return
    yield _heading("coverage", "Coverage over metres driven")
    yield plot_coverage(report.curves, series)
    said = (
        "The paper's ratio, as the map's free area in the answers of look_at_map told it on the "
        "way; the point is the scored map in the end. Where an agent was never told, there is the "
        "point alone. The line at 90 % is the paper's criterion."
    )
    yield element("p", {"class": "note"}, text(said))


def _show_failures(rows: Sequence[ReportRow]) -> Iterator[Html]:
    yield _heading("failures", "What went wrong")
    every: Counter[str] = Counter()
    for row in rows:
        every.update({str(kind): count for kind, count in row.counted.failures.items()})
    if not every:
        yield element("p", {}, text("No trial that counts has failed."))
        return
    kinds = [kind for kind, _ in sorted(every.items(), key=lambda item: (-item[1], item[0]))]
    heading = ("task", "agent", "map shown as", *(kind.replace("_", " ") for kind in kinds))
    lines = (_failure_line(row.counted, kinds) for row in rows if row.counted.failures)
    yield table(heading, lines, kind="failures")


def _failure_line(row: TableRow, kinds: Sequence[str]) -> list[Html]:
    counts = {str(kind): count for kind, count in row.failures.items()}
    return [
        cell(row.task),
        cell(row.agent),
        cell(row.representation),
        *(cell(counts.get(kind, NOTHING)) for kind in kinds),
    ]


def _show_costs(rows: Sequence[ReportRow]) -> Iterator[Html]:
    if not rows:
        return
    yield _heading("cost", "What it cost")
    yield element("h3", {}, text("Each trial, on average"))
    yield _cost_table(COSTS, [(row.counted, row.counted.figures) for row in rows])
    yield element("h3", {}, text("Each decision, on average"))
    yield _cost_table(PER_DECISION, [(row.counted, row.per_decision) for row in rows])


def _cost_table(
    columns: Sequence[tuple[str, str]], rows: Sequence[tuple[TableRow, dict[str, Interval]]]
) -> Html:
    """Gives a table of means."""
    known = _known(columns, [figures for _, figures in rows])
    lines = (
        [
            cell(row.task),
            cell(row.agent),
            cell(row.representation),
            *(figure_cell(figures.get(name)) for name, _ in known),
        ]
        for row, figures in rows
    )
    return table(("task", "agent", "map shown as", *(said for _, said in known)), lines)


def _known(
    columns: Sequence[tuple[str, str]], rows: Sequence[dict[str, Interval]]
) -> list[tuple[str, str]]:
    """Leaves out the columns that nobody has counted."""
    return [each for each in columns if any(each[0] in figures for figures in rows)]


def _show_worlds(rows: Sequence[TableRow]) -> Iterator[Html]:
    if len({row.world for row in rows}) < 2:
        return
    yield _heading("worlds", "World by world")
    heading = ("task", "world", "agent", "map shown as", "done", "coverage recall", "known", "SPL")
    lines = (
        [
            cell(row.task),
            cell(row.world),
            cell(row.agent),
            cell(row.representation),
            share_cell(row),
            figure_cell(row.figures.get("coverage_recall"), is_ratio=True),
            figure_cell(row.figures.get("coverage_known_ratio"), is_ratio=True),
            figure_cell(row.figures.get("spl")),
        ]
        for row in rows
    )
    said = element("summary", {}, text(f"{len(rows)} lines"))
    yield element("details", {}, said, table(heading, lines, kind="worlds"))


def _show_run(report: Report) -> Iterator[Html]:
    yield _heading("run", "What was run")
    agents = (
        [cell(row.agent), cell(row.kind), cell(_say_run(row.n_counted, row.n_asked))]
        for row in report.agents
    )
    yield table(("agent", "what it is", "trials"), agents, kind="agents")
    versions = [*report.versions.items(), ("report made with mapspeak", report.reported_with)]
    facts = [
        *((name, _say_option(value)) for name, value in report.options.items()),
        *((name, version) for name, version in versions),
    ]
    yield table(
        ("asked for, and with what", ""), ([cell(a), cell(b)] for a, b in facts), kind="facts"
    )
    yield from _show_sittings(report)
    if report.problems:
        yield element("h3", {}, text("What could not be read"))
        lines = ([cell(each.trial_id), cell(each.what)] for each in report.problems)
        yield table(("trial", "problem"), lines, kind="problems")


def _show_sittings(report: Report) -> Iterator[Html]:
    """Shows what earlier sittings ran with, where it was something else."""
    if not report.earlier:
        return
    yield element("h3", {}, text("Earlier sittings"))
    now = {**report.options, **report.versions}
    n_before = 0
    lines: list[list[Html]] = []
    for each in report.earlier:
        then = {**each.options, **each.versions}
        changed = (name for name in {**then, **now} if then.get(name) != now.get(name))
        said = "; ".join(f"{name}: {_say_option(then.get(name))}" for name in changed)
        lines.append([cell(each.n_done - n_before), cell(said or NOTHING)])
        n_before = each.n_done
    yield table(("trials with a result", "what was different from the table above"), lines)


def _say_option(value: object) -> str:
    if value is None:
        return "not said"
    if isinstance(value, list):
        return ", ".join("not said" if each is None else str(each) for each in value)
    return str(value)


def _say_run(n_counted: int, n_asked: int) -> str:
    if not n_counted:
        return f"not run: none of {n_asked}, so no figure is given"
    return f"{n_counted} of {n_asked}"
