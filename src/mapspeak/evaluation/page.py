"""The demo's report as one HTML page that needs nothing else: pictures inside, no script."""

import base64
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

from mapspeak.evaluation.client import CallRecord, Picture

__all__ = ["Moment", "Page", "build_page"]

PLOT_WIDTH_PX, PLOT_HEIGHT_PX, PLOT_MARGIN_PX = 640, 240, 44

STYLE = """
:root { color-scheme: light dark; --line: #8884; --soft: #8881; --good: #0a7d4f; --bad: #c2410c; }
body { font: 16px/1.5 system-ui, sans-serif; max-width: 68rem; margin: 2rem auto; padding: 0 1rem; }
h1 { margin-bottom: 0; } h2 { margin-top: 2.5rem; border-bottom: 1px solid var(--line); }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(11rem, 1fr)); gap: .75rem; }
.tile { background: var(--soft); border-radius: .5rem; padding: .75rem 1rem; }
.tile b { display: block; font-size: 1.5rem; }
.good { color: var(--good); } .bad { color: var(--bad); }
.gallery { display: grid; grid-template-columns: repeat(auto-fill, minmax(20rem, 1fr)); gap: 1rem; }
figure { margin: 0; } img, svg { max-width: 100%; height: auto; border-radius: .4rem; }
figcaption { font-size: .85rem; opacity: .8; }
table { border-collapse: collapse; width: 100%; font-size: .9rem; }
td, th { text-align: left; padding: .3rem .6rem; border-bottom: 1px solid var(--line);
         vertical-align: top; }
pre { white-space: pre-wrap; background: var(--soft); padding: .6rem; border-radius: .4rem;
      font-size: .8rem; overflow-x: auto; }
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Moment:
    """One moment of the run as the page shows it.

    Attributes:
        stage: Which task was under way.
        caption: What happened.
        picture: What was seen; None where nothing was.
        is_map: The picture is a map.
        driven_m: Metres driven by then, by the simulator's truth.
        coverage_recall: Share of the floor in sight that the map shows as free by then; None
            between maps.
    """

    stage: str
    caption: str
    picture: Picture | None
    is_map: bool
    driven_m: float
    coverage_recall: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Page:
    """Everything the page shows.

    Attributes:
        title: Its headline.
        verdict: One sentence; what came of it.
        is_success: Whether that is good.
        figures: Pairs of name and value.
        beside_paper: Rows of task, mapspeak's result, the paper's results.
        moments: The run.
        trajectory: The way driven, on the last map.
        semantic_map: The YAML file as it was written.
        calls: Every tool call.
    """

    title: str
    verdict: str
    is_success: bool
    figures: Sequence[tuple[str, str]]
    beside_paper: Sequence[tuple[str, str, str]]
    moments: Sequence[Moment]
    trajectory: Picture
    semantic_map: str
    calls: Sequence[CallRecord]


def build_page(page: Page) -> str:
    """Gives the page as HTML."""
    maps = [moment for moment in page.moments if moment.is_map]
    views = [moment for moment in page.moments if moment.picture and not moment.is_map]
    return "\n".join(
        [
            "<!doctype html><html lang='en'><head><meta charset='utf-8'>",
            "<meta name='viewport' content='width=device-width'>",
            f"<title>{escape(page.title)}</title><style>{STYLE}</style></head><body>",
            f"<h1>{escape(page.title)}</h1>",
            f"<p class='{'good' if page.is_success else 'bad'}'>{escape(page.verdict)}</p>",
            _tiles(page.figures),
            "<h2>Beside the paper</h2>",
            _table(("task", "here", "the paper (Claude Sonnet 4.6; GPT-5.5)"), page.beside_paper),
            "<h2>Coverage over metres driven</h2>",
            _plot(maps),
            "<h2>The way it drove</h2>",
            f"<figure>{_image(page.trajectory)}</figure>",
            "<h2>The map as it grew</h2>",
            _gallery(maps),
            "<h2>What the camera saw</h2>",
            _gallery(views),
            "<h2>What it remembers</h2>",
            f"<pre>{escape(page.semantic_map)}</pre>",
            "<h2>Every tool call</h2>",
            _calls(page.calls),
            "</body></html>",
        ]
    )


def _tiles(figures: Iterable[tuple[str, str]]) -> str:
    tiles = (
        f"<div class='tile'><b>{escape(value)}</b>{escape(name)}</div>" for name, value in figures
    )
    return f"<div class='tiles'>{''.join(tiles)}</div>"


def _table(heading: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in heading)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f"<table><tr>{head}</tr>{body}</table>"


def _gallery(moments: Iterable[Moment]) -> str:
    figures = (
        f"<figure>{_image(moment.picture)}<figcaption>{moment.driven_m:.1f} m: "
        f"{escape(moment.caption)}</figcaption></figure>"
        for moment in moments
        if moment.picture is not None
    )
    return f"<div class='gallery'>{''.join(figures)}</div>"


def _image(picture: Picture) -> str:
    data = base64.b64encode(picture.data).decode()
    return f"<img loading='lazy' alt='' src='data:{picture.media_type};base64,{data}'>"


def _plot(maps: Sequence[Moment]) -> str:
    points = [(moment.driven_m, moment.coverage_recall or 0.0) for moment in maps]
    longest_m = max((driven_m for driven_m, _ in points), default=0.0) or 1.0
    line = " ".join(f"{_plot_x(x / longest_m):.1f},{_plot_y(y):.1f}" for x, y in points)
    rules = "".join(_plot_rule(share) for share in (0.0, 0.25, 0.5, 0.75, 0.9, 1.0))
    return (
        f"<svg viewBox='0 0 {PLOT_WIDTH_PX} {PLOT_HEIGHT_PX}' role='img' "
        f"aria-label='Coverage over metres driven'>{rules}"
        f"<polyline points='{line}' fill='none' stroke='#0072b2' stroke-width='2.5'/>"
        f"<text x='{PLOT_WIDTH_PX - PLOT_MARGIN_PX}' y='{PLOT_HEIGHT_PX - 8}' font-size='12' "
        f"text-anchor='end' fill='currentColor'>{longest_m:.0f} m driven</text></svg>"
    )


def _plot_rule(share: float) -> str:
    y = _plot_y(share)
    return (
        f"<line x1='{PLOT_MARGIN_PX}' x2='{PLOT_WIDTH_PX - PLOT_MARGIN_PX}' y1='{y:.1f}' "
        f"y2='{y:.1f}' stroke='#8886'/><text x='{PLOT_MARGIN_PX - 6}' y='{y + 4:.1f}' "
        f"font-size='12' text-anchor='end' fill='currentColor'>{share:.0%}</text>"
    )


def _plot_x(share: float) -> float:
    return PLOT_MARGIN_PX + share * (PLOT_WIDTH_PX - 2 * PLOT_MARGIN_PX)


def _plot_y(share: float) -> float:
    height_px = PLOT_HEIGHT_PX - 2 * PLOT_MARGIN_PX
    return PLOT_HEIGHT_PX - PLOT_MARGIN_PX - share * height_px


def _calls(calls: Iterable[CallRecord]) -> str:
    parts = (
        f"<details><summary>{number}. <code>{escape(call.tool)}</code> "
        f"{escape(_arguments(call.arguments))} ({call.wall_s:.2f} s"
        f"{', error' if call.is_error else ''})</summary><pre>{escape(call.text)}</pre></details>"
        for number, call in enumerate(calls, start=1)
    )
    return "".join(parts)


def _arguments(arguments: dict[str, object]) -> str:
    text = ", ".join(f"{name}={value!r}" for name, value in arguments.items())
    return text if len(text) <= 120 else f"{text[:117]}..."
