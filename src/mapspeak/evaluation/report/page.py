"""Writes report.html: the paper's table with ours beside it, and the replay of every trial.

All else that is to be seen of a run, `inspect view` shows of its log.
"""

import base64
import hashlib
from collections.abc import Iterable, Iterator, Sequence
from importlib import resources
from pathlib import Path
from urllib.parse import quote

from mapspeak.evaluation.report.replay import build_replay, show_standing
from mapspeak.evaluation.report.sheet import (
    Album,
    Html,
    count_picture_bytes,
    element,
    joined,
    paragraph,
    table,
    text,
)
from mapspeak.evaluation.report.way import read_course
from mapspeak.evaluation.scores.rows import Interval, TableRow, count_rows, wilson_interval
from mapspeak.evaluation.trials import PICTURES, TURNS, TrialResult, trial_folder, write_whole

PAGE_LIMIT_BYTES = 24_000_000
"""A page larger than this is slow to open on a phone."""
BASE64_RATIO = 4 / 3
MARKUP_RATIO = 1.4
"""How much larger a conversation is on the page than in its file, its map included."""
PAGE, REPLAY = "report.html", "replay.html"
MOST_SAID = 240
"""Characters of an error in the list; all of it is in the replay."""
NOT_RUN = "not run"
SCRIPTS = frozenset({"scripted", "oracle", "random", "nearest-frontier", "paper-loop", "mock"})


PAPER_TASKS = ("explore", "smallest-room", "fire-tool")
"""The names of its Tasks 1 to 3 here."""

PAPER_NOTE = (
    "The paper's figures are as it printed them: one warehouse in NVIDIA Isaac Sim, Task 1 once, "
    "Tasks 2 and 3 thirty times each, Claude Sonnet 4.6 and GPT-5.5. They were not measured here, "
    "and another simulator, other worlds and another robot stand behind ours. Its coverage is the "
    "free area of the map over the free area of the building, wherever it lies; ours is given by "
    "that ratio too, and as recall: the share of the floor in sight that the map shows as free. "
    "What is known is the share of the reachable floor that the map knows, be it as free or as "
    "solid. The intervals of its counts are ours, after Wilson."
)


PAPER_TRIALS = 30
PAPER_ROWS = (("Claude Sonnet 4.6", 0.9783, 26, 30), ("GPT-5.5", 0.9978, 28, 30))
"""What the paper printed of each model: the coverage of one run of Task 1 by its own ratio, and how
many of thirty trials of Task 2 and of Task 3 were done."""


def write_page(
    run: Path, results: Sequence[TrialResult], *, page_limit_bytes: int = PAGE_LIMIT_BYTES
) -> Path:
    """Write the page of a run into its folder.

    Args:
        page_limit_bytes: About how large the page may become. Above it each trial's replay is a
            page of its own in the trial's folder, with its pictures beside it.
    """
    is_apart = _estimate_bytes(run, results) > page_limit_bytes
    ids = [result.trial.id for result in results]
    links = [quote(f"trials/{each}/{REPLAY}") if is_apart else f"#{each}" for each in ids]
    album = Album(is_inside=True, root=run)
    page = run / PAGE
    body = [
        element("h1", {}, text("mapspeak: an evaluation")),
        *_show_paper(count_rows(results)),
        *_show_success(count_rows(results)),
        *_list_trials(results, links),
    ]
    replays = () if is_apart else _replays(run, results, album)
    write_whole(page, _document("mapspeak: an evaluation", (*body, *replays), album))
    if is_apart:
        for result in results:
            _write_apart(run, result)
    return page


def _estimate_bytes(run: Path, results: Sequence[TrialResult]) -> float:
    folders = [trial_folder(run, result.trial) for result in results]
    turns = (folder / TURNS for folder in folders)
    n_text = sum(path.stat().st_size for path in turns if path.exists())
    n_pictures = count_picture_bytes(folder / PICTURES for folder in folders)
    return MARKUP_RATIO * n_text + BASE64_RATIO * n_pictures


def _replays(run: Path, results: Iterable[TrialResult], album: Album) -> Iterator[Html]:
    for result in results:
        folder = trial_folder(run, result.trial)
        yield build_replay(result, folder, read_course(run, result.trial), album)


def _write_apart(run: Path, result: TrialResult) -> None:
    folder = trial_folder(run, result.trial)
    album = Album(is_inside=False, root=folder)
    up = "../" * (result.trial.id.count("/") + 2)
    back = element("p", {}, element("a", {"href": f"{up}{PAGE}"}, text("All trials")))
    parts = (back, *_replays(run, [result], album))
    title = f"mapspeak: {result.trial.id}"
    write_whole(folder / REPLAY, _document(title, parts, album))


# --- tables --------------------------------------------------------------------------------------


def _show_paper(rows: Sequence[TableRow]) -> Iterator[Html]:
    """Show the paper's table, where any of its tasks was run."""
    keys = dict.fromkeys((row.agent, row.representation) for row in rows if row.task in PAPER_TASKS)
    if not keys:
        return
    heading = ("who", "Task 1: coverage", "Task 2: smallest room", "Task 3: tool for fire")
    ours = (_our_row(agent, how, rows) for agent, how in keys)
    yield element("h2", {"id": "paper"}, text("Beside the paper"))
    yield table(heading, [*(_paper_row(*row) for row in PAPER_ROWS), *ours], kind="paper")
    yield paragraph("note", PAPER_NOTE)


def _paper_row(model: str, coverage_ratio: float, *n_done: int) -> list[Html]:
    return [
        _cell(model, "the paper, not run here"),
        _cell(f"{_percent(coverage_ratio)} of one warehouse"),
        *(_share(n_successes, PAPER_TRIALS) for n_successes in n_done),
    ]


def _our_row(agent: str, representation: str, rows: Iterable[TableRow]) -> list[Html]:
    found = {
        row.task: row for row in rows if (row.agent, row.representation) == (agent, representation)
    }
    explored, *others = (found.get(task) for task in PAPER_TASKS)
    kind = "a script, no model" if _is_script(agent) else "a model or client program"
    return [
        _cell(agent, f"here, {representation}: {kind}"),
        _cell(NOT_RUN) if explored is None else _coverage(explored),
        *(_cell(NOT_RUN) if row is None else _share_of(row) for row in others),
    ]


def _is_script(agent: str) -> bool:
    return agent.partition("+")[0] in SCRIPTS or agent.startswith("mockllm/")


def _coverage(row: TableRow) -> Html:
    names = {"paper_ratio": "by the paper's ratio", "recall": "recall", "known_ratio": "known"}
    figures = ((row.figures.get(f"coverage_{name}"), said) for name, said in names.items())
    said = ", ".join(f"{_percent(value.value)} {name}" for value, name in figures if value)
    return _cell(said or NOT_RUN, f"{row.n_successes}/{row.n_trials} done{_say_broken(row)}")


def _show_success(rows: Sequence[TableRow]) -> Iterator[Html]:
    heading = ("task", "agent", "map shown as", "done", "SPL", "driven m", "calls", "mistakes")
    yield element("h2", {"id": "success"}, text("Success"))
    lines = (
        [
            _cell(row.task),
            _cell(row.agent),
            _cell(row.representation),
            _share_of(row),
            *(_mean(row.figures.get(name)) for name in ("spl", "driven_m", "n_calls")),
            _cell(", ".join(f"{name} {count}" for name, count in row.failures.items())),
        ]
        for row in rows
    )
    yield table(heading, lines, kind="success")


def _list_trials(results: Sequence[TrialResult], links: Sequence[str]) -> Iterator[Html]:
    box = element("input", {"type": "checkbox", "id": "only-failed"})
    label = element("label", {"for": "only-failed"}, text(" only those that were not done"))
    yield element("h2", {"id": "trials"}, text("Every trial"))
    yield element("p", {"class": "choice"}, box, label)
    heading = ("trial", "", "mistake", "reason", "driven m", "calls", "wall s")
    lines = (_line(result, link) for result, link in zip(results, links, strict=True))
    yield table(heading, lines, kind="trials")


def _line(result: TrialResult, link: str) -> list[Html]:
    failure = result.score.failure
    name = element("a", {"href": link}, text(result.trial.id))
    # A trace ends with what went wrong.
    last = ((result.error or "").strip().splitlines() or [result.score.reason])[-1]
    mistake = "" if failure is None else failure.replace("_", " ")
    if failure is not None and result.state == "out_of_budget":
        mistake = f"{mistake}, out of budget"
    return [
        element("td", {"class": "id"}, name),
        element("td", {}, show_standing(result)),
        _cell(mistake),
        _cell(last if len(last) <= MOST_SAID else f"{last[:MOST_SAID]}..."),
        *(_cell(f"{value:g}") for value in (result.driven_m, result.n_calls, result.wall_s)),
    ]


def _share_of(row: TableRow) -> Html:
    return _share(row.n_successes, row.n_trials, _say_broken(row))


def _share(n_successes: int, n_trials: int, more: str = "") -> Html:
    """Return how many trials were done in a cell, with Wilson's interval."""
    share = wilson_interval(n_successes, n_trials)
    if share is None:
        return _cell(NOT_RUN)
    span = f"{_percent(share.low)} to {_percent(share.high)}{more}"
    return _cell(f"{n_successes}/{n_trials} ({_percent(share.value)})", span)


def _mean(interval: Interval | None) -> Html:
    """Return a mean in a cell; equal values, and one alone, have no interval that says anything."""
    if interval is None:
        return _cell("")
    is_sure = interval.low == interval.high
    span = "" if is_sure else f"{interval.low:.3g} to {interval.high:.3g}"
    return _cell(f"{interval.value:.3g}", span)


def _say_broken(row: TableRow) -> str:
    return f"; {row.n_broken} broken" if row.n_broken else ""


def _percent(ratio: float) -> str:
    return f"{100 * ratio:.2f} %"


def _cell(said: str, small: str = "") -> Html:
    below = (element("small", {}, text(small)),) if small else ()
    return element("td", {}, text(said), *below)


# --- the document --------------------------------------------------------------------------------


def _document(title: str, body: Iterable[Html], album: Album) -> Iterator[bytes]:
    """Yield a whole page, piece by piece; it loads nothing that is not its own."""
    style, script = _read("page.css"), _read("replay.js")
    pictures = "data:" if album.is_inside else "data: 'self' file:"
    policy = (
        f"default-src 'none'; img-src {pictures}; style-src '{_hash(style)}'; "
        f"script-src '{_hash(script)}'; base-uri 'none'; form-action 'none'"
    )
    head = [
        element("meta", {"charset": "utf-8"}),
        element("meta", {"name": "viewport", "content": "width=device-width, initial-scale=1"}),
        element("meta", {"http-equiv": "Content-Security-Policy", "content": policy}),
        element("meta", {"name": "referrer", "content": "no-referrer"}),
        element("title", {}, text(title)),
        Html(f"<style>{style}</style>"),
    ]
    opening = Html(f'<!doctype html>\n<html lang="en"><head>{joined(head)}</head><body>')
    closing = Html(f"<script>{script}</script>\n</body></html>")
    for part in (opening, *body, album.definitions(), closing):
        yield f"{part}\n".encode(errors="replace")


def _read(name: str) -> str:
    return (resources.files("mapspeak.evaluation.report") / name).read_text("utf-8")


def _hash(inline: str) -> str:
    """Return the hash by which a page's policy allows this text and no other."""
    return f"sha256-{base64.b64encode(hashlib.sha256(inline.encode()).digest()).decode()}"
