"""Observes every building, remembers, asks, and counts."""

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import cache

import click
import cv2
import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.figure import Figure
from benchmarks.memory.asking import FindModel, open_world
from benchmarks.memory.judging import Facing, Fault, Judged, Outcome, choose, judge_all
from benchmarks.memory.lasers import Laser
from benchmarks.memory.observer import observe
from benchmarks.memory.places import PlaceError, measure_places
from benchmarks.memory.sites import Site, build_drawn, build_held_out, build_sites, build_worn
from mapspeak.evaluation.scores.rows import wilson_interval
from mapspeak.memory.search.meaningindex import (
    Embedder,
    find_model,
)

__all__ = ["main", "measure"]

N_REQUESTS = 300
SEEDS = (1, 2)
GROUPS: dict[str, Callable[[], Iterator[Site]]] = {
    "used": build_sites,
    "drawn": build_drawn,
    "worn": build_worn,
    "held out": build_held_out,
}
MEASURED = ("used", "held out")
"""Those drawn are for choosing alone, and the worn ones were looked at too often."""
RULES: dict[str, Callable[[PlaceError], float]] = {
    "ours": lambda error: error.ours_m,
    "observer's own pose": lambda error: error.own_pose_m,
    "least-squares intersection": lambda error: error.intersection_m,
    "first wall of one bearing": lambda error: error.first_wall_m,
}


@cache
def _the_model() -> Embedder | None:
    return find_model()


def _no_model() -> None:
    return None


WAYS: dict[str, FindModel] = {"with model": _the_model, "words alone": _no_model}


class Trial:
    """One building, observed once.

    Args:
        site: The building.
        seed: Of all noise.
        has_ranges: Observers tell ranges, too.
        band_m: Between which heights their laser looks; None without one.
        ways: How requests are understood.
    """

    def __init__(
        self,
        site: Site,
        *,
        seed: int,
        has_ranges: bool,
        band_m: tuple[float, float] | None = None,
        ways: Sequence[str] = tuple(WAYS),
    ) -> None:
        laser = None if band_m is None else Laser(site, band_m=band_m, seed=seed)
        memory = observe(site, seed=seed, has_ranges=has_ranges, laser=laser)
        worlds = {way: open_world(site, memory.places, WAYS[way]) for way in ways}
        started_s = time.process_time()
        found = worlds[ways[0]].recollection.found
        self.took_s = time.process_time() - started_s
        self.site = site
        self.n_waypoints = len(memory.places.waypoints)
        self.errors = list(measure_places(site, memory, found))
        self.judged = {way: list(judge_all(site, memory, world)) for way, world in worlds.items()}


def measure() -> Iterator[Figure]:
    """Return errors of places and how requests came out, each with ranges and without."""
    cv2.setNumThreads(1)
    for group in MEASURED:
        for has_ranges in (False, True):
            yield from _measure_group(group, has_ranges=has_ranges, ways=tuple(WAYS))


def _measure_group(group: str, *, has_ranges: bool, ways: Sequence[str]) -> Iterator[Figure]:
    kind = f"{group}, {'bearings and ranges' if has_ranges else 'bearings alone'}"
    sites = list(GROUPS[group]())
    trials = [
        Trial(site, seed=seed, has_ranges=has_ranges, ways=ways) for seed in SEEDS for site in sites
    ]
    yield from _measure_errors(kind, [e for trial in trials for e in trial.errors])
    for way in ways:
        every = [each for trial in trials for each in trial.judged[way]]
        drawn = choose(every, n=N_REQUESTS, seed=9)
        yield from _measure_answers(f"{kind}, {way}: {len(drawn)} requests", drawn)
        yield from _measure_answers(f"{kind}, {way}: all {len(every)} requests", every)
        yield from _measure_causes(f"{kind}, {way}: all {len(every)} requests", every)
    took_ms = 1e3 * sum(t.took_s for t in trials) / sum(t.n_waypoints for t in trials)
    yield Figure(name=f"{kind}: CPU for one waypoint", value=took_ms, unit="ms")


def _measure_errors(kind: str, errors: Sequence[PlaceError]) -> Iterator[Figure]:
    yield Figure(name=f"{kind}: things seen three times", value=len(errors), unit="")
    for name, error_of in RULES.items():
        offs = np.array([error_of(error) for error in errors])
        yield Figure(name=f"{kind}: {name}, median", value=float(np.median(offs)), unit="m")
        placed = offs[np.isfinite(offs)]
        yield Figure(name=f"{kind}: {name}, mean", value=float(placed.mean()), unit="m")
        ninety = float(np.percentile(np.minimum(offs, 99.0), 90))
        yield Figure(name=f"{kind}: {name}, 90 % within", value=ninety, unit="m")
    lost = sum(math.isinf(error.ours_m) for error in errors)
    yield Figure(name=f"{kind}: not made a thing of", value=lost, unit="things")
    for n_wrong in range(3):
        some = [error.ours_m for error in errors if error.n_wrong == n_wrong]
        name = f"{kind}: ours, median where {n_wrong} of three are wrong ({len(some)})"
        yield Figure(name=name, value=float(np.median(some or [0.0])), unit="m")
    held = [error.is_held for error in errors if math.isfinite(error.ours_m)]
    yield _share(f"{kind}: within the radius that holds 90 %", held)
    radius_m = float(np.median([error.radius_m for error in errors]))
    yield Figure(name=f"{kind}: that radius, median", value=radius_m, unit="m")


def _measure_answers(kind: str, judged: Sequence[Judged]) -> Iterator[Figure]:
    for outcome in Outcome:
        yield _share(f"{kind}, {outcome}", [each.outcome is outcome for each in judged])
    is_good = [each.outcome is not Outcome.WRONG for each in judged]
    yield _share(f"{kind}, right or honest", is_good)
    unsaid = [each.outcome is Outcome.WRONG and not each.is_told_unsure for each in judged]
    yield _share(f"{kind}, wrong and not even called likely or doubtful", unsaid)
    written = [each for each in judged if each.was_annotated]
    right = [each.outcome is Outcome.RIGHT for each in written]
    yield _share(f"{kind}, right thing, of those written down", right)
    listed = [each.is_listed for each in written]
    yield _share(f"{kind}, right thing among the candidates, of those written down", listed)
    found = [each for each in judged if each.facing is not None]
    faces = [each.facing is Facing.FACES for each in found]
    yield _share(f"{kind}, goal {Facing.FACES}", faces)
    sure = [each.facing is Facing.FACES for each in found if not each.is_told_unsure]
    yield _share(f"{kind}, goal {Facing.FACES}, of those told without doubt", sure)


def _measure_causes(kind: str, judged: Sequence[Judged]) -> Iterator[Figure]:
    """Return what the wrong answers were, and why goals do not face what was found."""
    for fault in Fault:
        n = sum(each.fault is fault for each in judged)
        yield Figure(name=f"{kind}, wrong: {fault}", value=n, unit="answers")
    for facing in Facing:
        n = sum(each.facing is facing for each in judged)
        yield Figure(name=f"{kind}, goal {facing}", value=n, unit="answers")


def _share(name: str, values: Sequence[bool]) -> Figure:
    interval = wilson_interval(sum(values), len(values))
    if interval is None:
        return Figure(name=f"{name} (of none)", value=0.0, unit="%")
    ends = f"{100 * interval.low:.1f} to {100 * interval.high:.1f}"
    return Figure(
        name=f"{name} ({sum(values)} of {len(values)}, {ends})",
        value=100 * interval.value,
        unit="%",
    )


@click.command()
@click.option("--seed", default=SEEDS[0], show_default=True, help="Of all noise.")
@click.option("--ranges", "has_ranges", is_flag=True, help="Observers tell ranges, too.")
@click.option("--group", type=click.Choice(list(GROUPS)), default="used", show_default=True)
@click.option("--way", type=click.Choice(list(WAYS)), default="with model", show_default=True)
@click.option("--wrong", "shows_wrong", is_flag=True, help="Lists the confident wrong answers.")
@click.option("--figures", "shows_figures", is_flag=True, help="Of both seeds, with intervals.")
def main(
    *, seed: int, has_ranges: bool, group: str, way: str, shows_wrong: bool, shows_figures: bool
) -> None:
    """Show every building: errors of places in metres, and answers."""
    cv2.setNumThreads(1)
    console = Console(width=150)
    if shows_figures:
        for figure in _measure_group(group, has_ranges=has_ranges, ways=(way,)):
            said = f"{figure.value:.2f} {figure.unit}  {figure.name}"
            console.print(said, markup=False, highlight=False, soft_wrap=True)
        return
    table = Table("building", "things", *(f"{rule}, m" for rule in RULES), *Outcome, "faces it")
    wrong: list[Judged] = []
    for site in GROUPS[group]():
        trial = Trial(site, seed=seed, has_ranges=has_ranges, ways=(way,))
        judged = trial.judged[way]
        table.add_row(site.name, str(len(site.things)), *_columns(trial.errors, judged))
        wrong += [each for each in judged if each.outcome is Outcome.WRONG]
    console.print(table)
    for fault, n in Counter(each.fault for each in wrong).most_common() if shows_wrong else ():
        console.print(f"{n} x {fault}")
    for each in wrong if shows_wrong else ():
        console.print(_say_wrong(each), markup=False, soft_wrap=True)


def _columns(errors: Sequence[PlaceError], judged: Sequence[Judged]) -> Iterator[str]:
    for error_of in RULES.values():
        yield f"{np.median([error_of(error) for error in errors]):.2f}"
    for outcome in Outcome:
        yield str(sum(each.outcome is outcome for each in judged))
    faces = [each.facing is Facing.FACES for each in judged if each.facing is not None]
    yield f"{100 * sum(faces) / max(len(faces), 1):.0f} %"


def _say_wrong(judged: Judged) -> str:
    first = judged.answer.candidates[0]
    return (
        f'{judged.site}: "{judged.request.words}" got {first.id} "{first.name}" in '
        f"{' or '.join(first.room_ids)}, {len(first.seen_from)} views, trust "
        f"{first.trust.ratio:.3f}, good to {first.uncertainty_m or 0.0:.1f} m, score "
        f"{first.match.score_ratio if first.match else 1.0:.2f}, "
        f"{judged.off_m:.1f} m from the nearest: {judged.fault}"
    )
