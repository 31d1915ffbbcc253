"""The page of a run: tables and plots of a report, and every trial to be replayed below them."""

import base64
import hashlib
from collections.abc import Iterable, Iterator
from importlib import resources

from mapspeak.evaluation.report.figures import Report
from mapspeak.evaluation.report.gathering import Attempt, Standing
from mapspeak.evaluation.report.markup import Html, element, joined, table, text
from mapspeak.evaluation.report.replay import show_standing
from mapspeak.evaluation.report.sections import show_figures
from mapspeak.evaluation.report.wording import NOTHING, cell
from mapspeak.evaluation.trials import TrialResult

__all__ = ["build_document", "build_page_body"]

MOST_SAID = 240
"""Characters of an error in the list; all of it is in the replay."""


def build_page_body(
    report: Report, attempts: Iterable[Attempt], links: dict[str, str], note: str
) -> Html:
    """Gives everything above the replays.

    Args:
        report: The figures.
        attempts: Every trial that was asked for.
        links: Where each trial's replay is, by its id.
        note: Where pictures and replays are.
    """
    return joined(
        [
            *show_figures(report),
            element("h2", {"id": "trials"}, text("Every trial")),
            element("p", {}, text(note)),
            *_list_trials(attempts, links),
        ]
    )


def build_document(title: str, body: Iterable[Html], *, has_links: bool) -> Iterator[str]:
    """Gives a whole page, piece by piece; it loads nothing that is not its own.

    Args:
        title: Of the page.
        body: What it shows.
        has_links: Pictures are linked from the folder the page lies in.
    """
    style, script = _read("page.css"), _read("replay.js")
    pictures = "data: 'self' file:" if has_links else "data:"
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
    yield f'<!doctype html>\n<html lang="en"><head>{joined(head)}</head><body>\n'
    for part in body:
        yield f"{part}\n"
    yield f"<script>{script}</script>\n</body></html>\n"


def _read(name: str) -> str:
    return (resources.files("mapspeak.evaluation.report") / name).read_text("utf-8")


def _hash(inline: str) -> str:
    """Gives the hash by which a page's policy allows this text and no other."""
    return f"sha256-{base64.b64encode(hashlib.sha256(inline.encode()).digest()).decode()}"


def _list_trials(attempts: Iterable[Attempt], links: dict[str, str]) -> Iterator[Html]:
    box = element("input", {"type": "checkbox", "id": "only-failed"})
    label = element("label", {"for": "only-failed"}, text(" only those that were not done"))
    yield element("p", {"class": "choice"}, box, label)
    heading = ("trial", "", "mistake", "reason", "driven m", "calls", "wall s")
    yield table(heading, (_line(each, links) for each in attempts), kind="trials")


def _line(attempt: Attempt, links: dict[str, str]) -> list[Html]:
    trial, result = attempt.trial, attempt.result
    where = links.get(trial.id)
    name = text(trial.id)
    first = name if where is None else element("a", {"href": where}, name)
    cells = [element("td", {"class": "id"}, first), element("td", {}, show_standing(attempt))]
    if result is None:
        what = cell(attempt.problem or NOTHING)
        return [*cells, cell(NOTHING), what, *(cell(NOTHING) for _ in range(3))]
    mistake = cell(_say_mistake(attempt, result))
    if attempt.is_broken:
        spent = (cell(NOTHING) for _ in range(3))
        return [*cells, mistake, cell(_last_line(result.error) or result.score.reason), *spent]
    return [
        *cells,
        mistake,
        cell(result.score.reason),
        cell(f"{result.driven_m:.1f}"),
        cell(result.n_calls),
        cell(f"{result.wall_s:.1f}"),
    ]


def _say_mistake(attempt: Attempt, result: TrialResult) -> str:
    """Says what kind of mistake was made, and whether it was made for want of budget."""
    failure = result.score.failure
    if failure is None:
        return NOTHING
    kind = failure.replace("_", " ")
    is_out = attempt.standing is Standing.OUT_OF_BUDGET
    return f"{kind}, {attempt.standing}" if is_out else kind


def _last_line(error: str | None) -> str:
    """Gives what of an error says most: a trace ends with what went wrong."""
    lines = (error or "").strip().splitlines()
    if not lines:
        return ""
    last = lines[-1]
    return last if len(last) <= MOST_SAID else f"{last[:MOST_SAID]}..."
