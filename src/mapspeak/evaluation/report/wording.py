"""How the report writes figures: their units, their intervals, and the names of what failed."""

from collections.abc import Callable

from mapspeak.evaluation.report.markup import Html, element, text
from mapspeak.evaluation.scores import Interval, TableRow

__all__ = [
    "NOTHING",
    "cell",
    "figure_cell",
    "say_broken",
    "say_figure",
    "say_percent",
    "share_cell",
]

NOTHING = "–"  # noqa: RUF001 - a dash, as tables have it
"""Stands where there is no figure."""


def say_percent(ratio: float) -> str:
    """Gives a share between 0 and 1 in percent."""
    return f"{100 * ratio:.2f} %"


def say_figure(value: float) -> str:
    """Gives a figure with as many digits as say something."""
    if abs(value) >= 1000:
        return f"{value:,.0f}"
    return f"{value:.0f}" if abs(value) >= 100 or value == round(value) else f"{value:.3g}"


def cell(value: object, *, kind: str | None = None) -> Html:
    """Gives text in a cell of a table."""
    return element("td", {"class": kind}, text(value))


def figure_cell(interval: Interval | None, *, is_ratio: bool = False) -> Html:
    """Gives a mean and its interval in a cell, and both as exact numbers for programs.

    Equal values, and one alone, have no interval that says anything.
    """
    if interval is None:
        return cell(NOTHING, kind="none")
    say = say_percent if is_ratio else say_figure
    span = () if interval.low == interval.high else (_span(interval, say),)
    return element("td", _exact(interval), text(say(interval.value)), *span)


def share_cell(row: TableRow | None) -> Html:
    """Gives how many trials were done, of how many, in a cell."""
    if row is None or row.success is None:
        return cell("not run", kind="none")
    said = text(f"{row.n_successes}/{row.n_trials} ({100 * row.success.value:.2f} %)")
    span = f"{say_percent(row.success.low)} to {say_percent(row.success.high)}{say_broken(row)}"
    return element("td", _exact(row.success), said, element("small", {}, text(span)))


def say_broken(row: TableRow) -> str:
    """Gives how many trials broke, to follow what else is said; nothing where none did."""
    return f"; {row.n_broken} broken" if row.n_broken else ""


def _exact(interval: Interval) -> dict[str, object]:
    return {
        "class": "figure",
        "data-value": repr(interval.value),
        "data-low": repr(interval.low),
        "data-high": repr(interval.high),
    }


def _span(interval: Interval, say: Callable[[float], str]) -> Html:
    return element("small", {}, text(f"{say(interval.low)} to {say(interval.high)}"))
