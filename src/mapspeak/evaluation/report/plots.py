"""Plots as SVG that reads in light and dark: bars with intervals, and coverage over metres."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby

from mapspeak.evaluation.report.curves import Curve
from mapspeak.evaluation.report.markup import Html, element, joined, text
from mapspeak.evaluation.scores import Interval

__all__ = ["Bar", "Series", "plot_bars", "plot_coverage"]

N_COLOURS = 8
WIDTH_PX, HEIGHT_PX = 520, 300
ENOUGH_COVERAGE = 0.9
"""The paper's criterion for Task 1."""
FEW = 4
"""Curves that can be named in the plot itself."""
LEFT_PX, RIGHT_PX, TOP_PX, BOTTOM_PX = 46, 12, 12, 40


@dataclass(frozen=True, slots=True)
class Series:
    """Colours for pairs of agent and representation, the same in every plot of a page.

    Attributes:
        keys: The pairs, in the order of the colours.
    """

    keys: tuple[tuple[str, str], ...]

    def colour(self, agent: str, representation: str) -> str:
        """Gives the class of a pair's colour."""
        return f"s{self.keys.index((agent, representation)) % N_COLOURS}"

    def legend(self) -> Html:
        """Says which colour is whose."""
        items = (
            element("li", {}, element("i", {"class": self.colour(*key)}), text(", ".join(key)))
            for key in self.keys
        )
        return element("ul", {"class": "legend"}, *items)


@dataclass(frozen=True, slots=True, kw_only=True)
class Bar:
    """One bar.

    Attributes:
        group: What stands above it and its neighbours.
        agent: Whose it is.
        representation: Likewise.
        value: A share between 0 and 1, with its interval.
        said: The figure in words.
    """

    group: str
    agent: str
    representation: str
    value: Interval
    said: str


def plot_bars(bars: Iterable[Bar], series: Series) -> Html:
    """Gives horizontal bars from 0 to 100 %, grouped; labels are text, so that phones show them."""
    groups = []
    for name, members in groupby(bars, key=lambda bar: bar.group):
        rows = joined(_bar_row(bar, series) for bar in members)
        heading = element("p", {"class": "group"}, text(name))
        groups.append(element("div", {"class": "bars"}, heading, rows))
    return element("div", {"class": "chart"}, *groups)


def _bar_row(bar: Bar, series: Series) -> Html:
    label = element("span", {"class": "name"}, text(f"{bar.agent}, {bar.representation}"))
    value = element("span", {"class": "said"}, text(bar.said))
    drawn = _draw_bar(bar.value, series.colour(bar.agent, bar.representation))
    return element("div", {"class": "row"}, label, drawn, value)


def _draw_bar(interval: Interval, colour: str) -> Html:
    rules = joined(
        element("line", {"class": "rule", "x1": x, "x2": x, "y1": 0, "y2": 14})
        for x in (0, 25, 50, 75, 100)
    )
    low, high, value = (100 * each for each in (interval.low, interval.high, interval.value))
    bar = {"class": colour, "x": 0, "y": 2, "height": 10, "width": f"{value:.2f}"}
    ends = joined(
        element("line", {"class": "span", "x1": x, "x2": x, "y1": 4, "y2": 10})
        for x in (f"{low:.2f}", f"{high:.2f}")
    )
    across = {"class": "span", "x1": f"{low:.2f}", "x2": f"{high:.2f}", "y1": 7, "y2": 7}
    return element(
        "svg",
        {"viewBox": "0 0 100 14", "preserveAspectRatio": "none", "aria-hidden": "true"},
        rules,
        element("rect", bar),
        element("line", across),
        ends,
    )


def plot_coverage(curves: Sequence[Curve], series: Series) -> Html:
    """Gives the coverage of each trial that explored over the metres it drove."""
    longest_m = max((point.driven_m for each in curves for point in each.points), default=0.0)
    most = max((point.coverage_paper_ratio for each in curves for point in each.points), default=0)
    frame = _Frame(x_most=longest_m or 1.0, y_most=max(1.0, most))
    label = "Coverage by the paper's ratio over metres driven"
    return element(
        "svg",
        {"class": "plot", "viewBox": f"0 0 {WIDTH_PX} {HEIGHT_PX}", "role": "img"}
        | {"aria-label": label},
        *frame.rules(),
        *(_draw_curve(each, frame, series) for each in curves),
        *(_name_curve(each, frame) for each in curves if len(curves) <= FEW),
    )


@dataclass(frozen=True, slots=True)
class _Frame:
    """The axes of a plot: metres to the right, a share upwards."""

    x_most: float
    y_most: float

    def x(self, value: float) -> float:
        return LEFT_PX + value / self.x_most * (WIDTH_PX - LEFT_PX - RIGHT_PX)

    def y(self, value: float) -> float:
        return HEIGHT_PX - BOTTOM_PX - value / self.y_most * (HEIGHT_PX - TOP_PX - BOTTOM_PX)

    def rules(self) -> Iterable[Html]:
        """Draws lines at shares, among them the paper's 90 %, and says how far the metres go."""
        for share in (0.0, 0.25, 0.5, 0.75, ENOUGH_COVERAGE, 1.0):
            y = f"{self.y(share):.1f}"
            kind = "rule bound" if share == ENOUGH_COVERAGE else "rule"
            across = {"class": kind, "x1": LEFT_PX, "x2": WIDTH_PX - RIGHT_PX, "y1": y, "y2": y}
            yield element("line", across)
            place = {"x": LEFT_PX - 6, "y": f"{self.y(share) + 4:.1f}", "text-anchor": "end"}
            yield element("text", place, text(f"{share:.0%}"))
        for part in (0.0, 0.5, 1.0):
            metres = part * self.x_most
            anchor = "end" if part == 1 else "middle"
            place = {"x": f"{self.x(metres):.1f}", "y": HEIGHT_PX - 18, "text-anchor": anchor}
            yield element("text", place, text(f"{metres:.0f} m"))
        middle = {"x": (LEFT_PX + WIDTH_PX) / 2, "y": HEIGHT_PX - 3, "text-anchor": "middle"}
        yield element("text", middle, text("driven"))


def _draw_curve(curve: Curve, frame: _Frame, series: Series) -> Html:
    points = [(frame.x(each.driven_m), frame.y(each.coverage_paper_ratio)) for each in curve.points]
    colour = series.colour(curve.agent, curve.representation)
    line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    end_x, end_y = points[-1]
    end = {"class": colour, "cx": f"{end_x:.1f}", "cy": f"{end_y:.1f}", "r": 4}
    title = element("title", {}, text(f"{curve.world}, {curve.agent}, {curve.representation}"))
    shape = element("polyline", {"class": f"curve {colour}", "points": line}, title)
    return element("g", {}, shape, element("circle", end, title))


def _name_curve(curve: Curve, frame: _Frame) -> Html:
    """Names a curve's world below its end."""
    end = curve.points[-1]
    x, y = frame.x(end.driven_m), frame.y(end.coverage_paper_ratio)
    place = {"x": f"{x:.1f}", "y": f"{y + 20:.1f}", "text-anchor": "end"}
    return element("text", place, text(curve.world))
