"""Asks for everything in every way, and takes the time."""

import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import cycle, islice
from statistics import median

import click
from rich.console import Console
from rich.table import Table

from benchmarks.figure import Figure
from benchmarks.requests.data import HELD_OUT, TUNING, Request, read_maps, read_requests
from benchmarks.requests.judging import ALL, Share, judge, kinds_of, shares_of
from benchmarks.requests.methods import Method, list_methods
from mapspeak.memory import SemanticMap
from mapspeak.memory.search.answer import Entry, list_entries
from mapspeak.memory.search.index import EntryIndex
from mapspeak.memory.search.meaningindex import Embedder, TextVectors

__all__ = ["main", "measure"]

N_WAYPOINTS = 1000
N_QUERIES = 60


def measure() -> Iterator[Figure]:
    """Measure what is found of the requests kept apart, by each method and kind; and speed."""
    requests = read_requests(HELD_OUT)
    methods, _ = list_methods()
    for method in methods:
        judged = judge(method, requests)
        for kind in kinds_of(requests):
            shares = shares_of(judged, kind)
            for share in shares if kind == ALL else shares[:2]:
                low, high = share.interval
                name = (
                    f"{method.name}, {kind}: {share.name} (of {share.n}, {low:.2f} to {high:.2f})"
                )
                yield Figure(name=name, value=share.ratio, unit="ratio")
    for method in methods:
        if method.name == "words only" or method.embedder:
            yield from _measure_speed(method, requests)


@click.command()
@click.option("--tuning", is_flag=True, help="Asks what settings may be chosen with.")
@click.option("--missed", is_flag=True, help="Lists what the tuning requests miss.")
def main(*, tuning: bool, missed: bool) -> None:
    """Show what is found, by method and kind of request, each with its 95 % interval."""
    paths = TUNING if tuning or missed else HELD_OUT
    requests = read_requests(paths)
    methods, missing = list_methods()
    console = Console(width=150)
    title = ", ".join(path.name for path in paths)
    console.print(_table(title, requests, methods))
    if missed:
        for each in judge(methods[-1], requests):
            if each.request.answers and not each.is_first_right:
                console.print(each.request.words, each.reply.verdict, list(each.reply.ids[:3]))
    for figure in (
        figure
        for method in methods
        if method.name == "words only" or method.embedder
        for figure in _measure_speed(method, requests)
    ):
        console.print(f"{figure.name}: {figure.value:,.3g} {figure.unit}")
    for sentence in missing:
        console.print(sentence)


def _table(title: str, requests: list[Request], methods: list[Method]) -> Table:
    table = Table("method", "kind", "what", "share", "of", "95 % interval", title=title)
    for method in methods:
        judged = judge(method, requests)
        for kind in kinds_of(requests):
            shares = shares_of(judged, kind)
            for share in shares if kind == ALL else shares[:2]:
                table.add_row(method.name, kind, *_columns(share))
        table.add_section()
    return table


def _columns(share: Share) -> tuple[str, ...]:
    low, high = share.interval
    return share.name, f"{share.ratio:.3f}", str(share.n), f"{low:.3f} to {high:.3f}"


def _measure_speed(method: Method, requests: list[Request]) -> Iterator[Figure]:
    """Measure processor time with 1,000 waypoints: those of the buildings over again."""
    entries = list_entries(_large_map())
    vectors = TextVectors(method.embedder) if method.embedder else None
    if method.embedder is not None and vectors is not None:
        yield Figure(
            name=f"{method.name}: texts embedded",
            value=_texts_per_second(method.embedder),
            unit="1/s",
        )
        took_s, _ = _timed(entries, vectors)
        name = f"{method.name}: index of {N_WAYPOINTS} waypoints, {len(vectors)} texts, built first"
        yield Figure(name=name, value=took_s, unit="s")
    took_s, index = _timed(entries, vectors)
    name = f"{method.name}: index of {N_WAYPOINTS} waypoints, built again"
    yield Figure(name=name, value=took_s, unit="s")
    times_ms = []
    for request in requests[:N_QUERIES]:
        start_s = time.process_time()
        index.find(request.words)
        times_ms.append((time.process_time() - start_s) * 1e3)
    yield Figure(name=f"{method.name}: query, median", value=median(times_ms), unit="ms")
    yield Figure(name=f"{method.name}: query, slowest", value=max(times_ms), unit="ms")


def _timed(entries: tuple[Entry, ...], vectors: TextVectors | None) -> tuple[float, EntryIndex]:
    start_s = time.process_time()
    index = EntryIndex(entries, vectors=vectors)
    return time.process_time() - start_s, index


def _texts_per_second(embedder: Embedder) -> float:
    texts = [entry.name for each in read_maps().values() for entry in list_entries(each)]
    start_s = time.process_time()
    embedder.embed(texts)
    return len(texts) / (time.process_time() - start_s)


def _large_map() -> SemanticMap:
    places = [place for each in read_maps().values() for place in each.waypoints]
    many = islice(cycle(places), N_WAYPOINTS)
    return SemanticMap(
        waypoints=tuple(
            replace(place, name=f"{place.name} {number // len(places) + 1}")
            for number, place in enumerate(many)
        )
    )
