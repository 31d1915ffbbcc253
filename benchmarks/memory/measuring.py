"""Observes every building, remembers, asks, and counts."""

import math
import time
from collections.abc import Callable, Iterator, Sequence

import click
import cv2
import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.figure import Figure
from benchmarks.memory.asking import Finder, Outcome, Verdict, ask, by_label, choose, open_library
from benchmarks.memory.observer import observe
from benchmarks.memory.places import PlaceError, measure_places
from benchmarks.memory.sites import Site, build_sites
from mapspeak.semantic.things import find_things

__all__ = ["main", "measure"]

N_REQUESTS = 300
SEEDS = (1, 2)
RULES: dict[str, Callable[[PlaceError], float]] = {
    "ours": lambda error: error.ours_m,
    "observer's own pose": lambda error: error.own_pose_m,
    "least-squares intersection": lambda error: error.intersection_m,
    "first wall of one bearing": lambda error: error.first_wall_m,
}


class Trial:
    """One building, observed once."""

    def __init__(self, site: Site, *, seed: int, has_ranges: bool, finder: Finder) -> None:
        memory = observe(site, seed=seed, has_ranges=has_ranges)
        started_s = time.process_time()
        found = find_things(memory.places, site.grid)
        self.took_s = time.process_time() - started_s
        self.n_waypoints = len(memory.places.waypoints)
        self.errors = list(measure_places(site, memory, found))
        library = open_library(site, memory.places, found)
        self.verdicts = list(ask(site, library, memory.annotated, finder))


def measure(finder: Finder = by_label) -> Iterator[Figure]:
    """Gives errors of places with and without ranges, and how requests came out."""
    cv2.setNumThreads(1)
    sites = list(build_sites())
    for has_ranges in (False, True):
        trials = [
            Trial(site, seed=seed, has_ranges=has_ranges, finder=finder)
            for seed in SEEDS
            for site in sites
        ]
        kind = "bearings and ranges" if has_ranges else "bearings alone"
        yield from _measure_errors(kind, [e for trial in trials for e in trial.errors])
        every = [verdict for trial in trials for verdict in trial.verdicts]
        yield from _measure_verdicts(kind, choose(every, n=N_REQUESTS, seed=9))
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
    yield Figure(
        name=f"{kind}: within the radius that holds 90 %", value=100 * _mean(held), unit="%"
    )


def _measure_verdicts(kind: str, verdicts: Sequence[Verdict]) -> Iterator[Figure]:
    yield Figure(name=f"{kind}: requests", value=len(verdicts), unit="")
    for outcome in Outcome:
        share = _mean([verdict.outcome is outcome for verdict in verdicts])
        yield Figure(name=f"{kind}: {outcome}", value=100 * share, unit="%")
    written = [each.outcome is Outcome.RIGHT for each in verdicts if each.was_annotated]
    yield Figure(
        name=f"{kind}: right thing, of those written down", value=100 * _mean(written), unit="%"
    )
    faces = [verdict.faces for verdict in verdicts if verdict.faces is not None]
    yield Figure(name=f"{kind}: pose faces it from 1.5 m", value=100 * _mean(faces), unit="%")


def _mean(values: Sequence[bool]) -> float:
    return sum(values) / max(len(values), 1)


@click.command()
@click.option("--seed", default=SEEDS[0], show_default=True, help="Of all noise.")
@click.option("--ranges", "has_ranges", is_flag=True, help="Observers tell ranges, too.")
def main(*, seed: int, has_ranges: bool) -> None:
    """Shows every building: errors of places in metres, and answers."""
    cv2.setNumThreads(1)
    table = Table("building", "things", *(f"{rule}, m" for rule in RULES), *Outcome, "faces it")
    for site in build_sites():
        trial = Trial(site, seed=seed, has_ranges=has_ranges, finder=by_label)
        medians = [
            float(np.median([error_of(error) for error in trial.errors]))
            for error_of in RULES.values()
        ]
        counts = [sum(v.outcome is outcome for v in trial.verdicts) for outcome in Outcome]
        faces = [verdict.faces for verdict in trial.verdicts if verdict.faces is not None]
        told = [f"{each:.2f}" for each in medians] + [str(n) for n in counts]
        table.add_row(site.name, str(len(site.things)), *told, f"{100 * _mean(faces):.0f} %")
    Console().print(table)
