"""Writes report.html: the paper's table with ours beside it, and the replay of every trial.

All else that is to be seen of a run, `inspect view` shows of its log.
"""

import base64
import hashlib
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from importlib import resources
from pathlib import Path
from typing import NewType
from urllib.parse import quote

from mapspeak.atomic import replace_file
from mapspeak.evaluation.agents.catalogue import is_script
from mapspeak.evaluation.report.replay import PAGE, REPLAY, ReplayWriter, say_standing
from mapspeak.evaluation.scores.rows import TableRow, count_rows, wilson_interval
from mapspeak.evaluation.trials import TRIALS, TrialResult, TrialState, trial_folder

Html = NewType("Html", str)
"""Markup that was made here; plain text is not accepted where it is asked for."""

VOID = frozenset({"img", "meta", "input", "br"})
INVISIBLE = re.compile(
    "[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u061c\u200b-\u200f\u202a-\u202e\u2060-\u2069\ufeff\ufff0-\uffff]"
    "|[\ud800-\udfff]"
)
"""Control characters, and characters that change the text direction: they are spelled out."""
MOST_SAID = 240
"""Characters of an error in the list; all of it is in the replay."""
NOT_RUN = "not run"
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
"""Results of each model in the paper: the coverage of one run of Task 1 by its own ratio, and the
number of thirty trials of Task 2 and of Task 3 that succeeded."""


def text(value: object) -> Html:
    """Return text as markup; invisible characters are spelled out."""
    return Html(escape(INVISIBLE.sub(lambda found: f"<U+{ord(found[0]):04X}>", str(value))))


def joined(parts: Iterable[Html]) -> Html:
    """Return pieces of markup one after the other."""
    return Html("".join(parts))


def element(name: str, attributes: Mapping[str, object], *children: Html) -> Html:
    """Return an element; the values of its attributes are escaped."""
    inside = "".join(f' {key}="{text(value)}"' for key, value in attributes.items())
    if name in VOID:
        return Html(f"<{name}{inside}>")
    return Html(f"<{name}{inside}>{joined(children)}</{name}>")


def paragraph(kind: str, said: str) -> Html:
    """Return text in a paragraph of a class."""
    return element("p", {"class": kind}, text(said))


def table(heading: Sequence[str], rows: Iterable[Sequence[Html]], *, kind: str) -> Html:
    """Return a table that scrolls sideways where the screen is narrow; cells come as <td>."""
    head = joined(element("th", {"scope": "col"}, text(cell)) for cell in heading)
    body = joined(element("tr", {}, *row) for row in rows)
    parts = (element("thead", {}, element("tr", {}, head)), element("tbody", {}, body))
    whole = element("table", {"class": kind}, *parts)
    return element("div", {"class": "wide", "tabindex": "0"}, whole)


def document(title: str, *body: Html) -> bytes:
    """Return a whole page in the style of the report, which loads and runs nothing."""
    style = resources.files(__package__).joinpath("page.css").read_text("utf-8")
    digest = base64.b64encode(hashlib.sha256(style.encode()).digest()).decode()
    policy = f"default-src 'none'; style-src 'sha256-{digest}'; base-uri 'none'; form-action 'none'"
    head = (
        element("meta", {"charset": "utf-8"}),
        element("meta", {"name": "viewport", "content": "width=device-width, initial-scale=1"}),
        element("meta", {"http-equiv": "Content-Security-Policy", "content": policy}),
        element("meta", {"name": "referrer", "content": "no-referrer"}),
        element("title", {}, text(title)),
        Html(f"<style>{style}</style>"),
    )
    page = element("html", {"lang": "en"}, element("head", {}, *head), element("body", {}, *body))
    return f"<!doctype html>\n{page}\n".encode(errors="replace")


def write_page(run: Path, results: Sequence[TrialResult]) -> Path:
    """Write the page of a run into its folder, and that of each trial into the trial's."""
    rows = count_rows(results)
    page = document(
        "mapspeak: an evaluation",
        element("h1", {}, text("mapspeak: an evaluation")),
        *_show_paper(rows),
        *_list_trials(results),
    )
    writer = ReplayWriter()
    for result in results:
        writer.write(result, trial_folder(run, result.trial))
    replace_file(run / PAGE, page)
    return run / PAGE


def _show_paper(rows: Sequence[TableRow]) -> Iterator[Html]:
    """Show the paper's table, where any of its tasks was run."""
    keys = dict.fromkeys((row.agent, row.representation) for row in rows if row.task in PAPER_TASKS)
    if not keys:
        return
    heading = ("who", "Task 1: coverage", "Task 2: smallest room", "Task 3: tool for fire")
    paper = (
        [
            _cell(model, "the paper, not run here"),
            _cell(f"{_percent(coverage_ratio)} of one warehouse"),
            *(_share(n_successes, PAPER_TRIALS) for n_successes in n_done),
        ]
        for model, coverage_ratio, *n_done in PAPER_ROWS
    )
    ours = (_our_row(agent, how, rows) for agent, how in keys)
    yield element("h2", {"id": "paper"}, text("Beside the paper"))
    yield table(heading, [*paper, *ours], kind="paper")
    yield paragraph("note", PAPER_NOTE)


def _our_row(agent: str, representation: str, rows: Iterable[TableRow]) -> list[Html]:
    found = {
        row.task: row for row in rows if (row.agent, row.representation) == (agent, representation)
    }
    explored, *others = (found.get(task) for task in PAPER_TASKS)
    kind = "a script, no model" if is_script(agent) else "a model or client program"
    return [
        _cell(agent, f"here, {representation}: {kind}"),
        _cell(NOT_RUN) if explored is None else _coverage(explored),
        *(
            _cell(NOT_RUN) if row is None else _share(row.n_successes, row.n_trials, row.n_broken)
            for row in others
        ),
    ]


def _coverage(row: TableRow) -> Html:
    names = {"paper_ratio": "by the paper's ratio", "recall": "recall", "known_ratio": "known"}
    figures = ((row.figures.get(f"coverage_{name}"), said) for name, said in names.items())
    said = ", ".join(f"{_percent(value)} {name}" for value, name in figures if value is not None)
    broken = f"; {row.n_broken} broken" if row.n_broken else ""
    return _cell(said or NOT_RUN, f"{row.n_successes}/{row.n_trials} done{broken}")


def _list_trials(results: Iterable[TrialResult]) -> Iterator[Html]:
    box = element("input", {"type": "checkbox", "id": "only-failed"})
    label = element("label", {"for": "only-failed"}, text(" only those that were not done"))
    yield element("h2", {"id": "trials"}, text("Every trial"))
    yield element("p", {"class": "choice"}, box, label)
    yield table(("trial", "", "mistake", "reason"), map(_line, results), kind="trials")


def _line(result: TrialResult) -> list[Html]:
    failure, (standing, kind) = result.score.failure, say_standing(result)
    link = quote(f"{TRIALS}/{result.trial.id}/{REPLAY}")
    # A trace ends with what went wrong.
    last = ((result.error or "").strip().splitlines() or [result.score.reason])[-1]
    mistake = "" if failure is None else failure.replace("_", " ")
    if failure is not None and result.state is TrialState.OUT_OF_BUDGET:
        mistake = f"{mistake}, out of budget"
    return [
        element("td", {"class": "id"}, element("a", {"href": link}, text(result.trial.id))),
        element("td", {}, element("span", {"class": f"word {kind}"}, text(standing))),
        _cell(mistake),
        _cell(last if len(last) <= MOST_SAID else f"{last[:MOST_SAID]}..."),
    ]


def _share(n_successes: int, n_trials: int, n_broken: int = 0) -> Html:
    """Return how many trials were done in a cell, with Wilson's interval."""
    share = wilson_interval(n_successes, n_trials)
    if share is None:
        return _cell(NOT_RUN)
    broken = f"; {n_broken} broken" if n_broken else ""
    span = f"{_percent(share.low)} to {_percent(share.high)}{broken}"
    return _cell(f"{n_successes}/{n_trials} ({_percent(share.value)})", span)


def _percent(ratio: float) -> str:
    return f"{100 * ratio:.2f} %"


def _cell(said: str, small: str = "") -> Html:
    below = (element("small", {}, text(small)),) if small else ()
    return element("td", {}, text(said), *below)
