"""What each verdict on a request is worth, in drawn buildings asked in people's words.

Each line of `requests/people.txt` is a request and the labels that meet it. The things of drawn
buildings (MAPSPEAK_SEED) get these labels, dealt out so that each stands in one building of three;
a scripted observer notes them, three times each, by label alone. A request is asked where one of
its labels is remembered, and every third also where none is. Half of the lines, drawn by a fixed
seed, are for choosing settings and for words of the lists (MAPSPEAK_DEVELOP); the others judge.
"""

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.figure import Figure
from benchmarks.memory.observer import observe
from benchmarks.memory.sites import RADIUS_M, Site
from mapspeak.geometry import Pose
from mapspeak.memory.search.answer import Verdict
from mapspeak.memory.search.meaningindex import Embedder, find_model
from mapspeak.places.asking import Recall, RecallQuery, recall
from mapspeak.simulator.worlds.worldfiles import parse_world
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.recollection import Recollector
from tools.worldgen import draw_plan

__all__ = ["Asked", "ask_all", "measure", "read_lines"]

SEED = int(os.environ.get("MAPSPEAK_SEED", "48611"))
IS_DEVELOPING = "MAPSPEAK_DEVELOP" in os.environ
SPLIT_SEED = 17
STYLES = ("office", "clinic", "school")
FIRST = 5
ABSENT_EVERY = 3
SAID = (Verdict.FOUND, Verdict.LIKELY, Verdict.SEVERAL)


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """What people say, and every label that meets it."""

    words: str
    labels: frozenset[str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """A request, what was told, and whether the first, one of five and all meant are right."""

    line: Line
    told: Recall
    is_absent: bool
    is_first_right: bool
    is_among_five: bool
    is_all_right: bool

    @property
    def is_said(self) -> bool:
        """True for a verdict that commits itself."""
        return self.told.verdict in SAID

    @property
    def is_said_right(self) -> bool:
        """True where what is said is right: the first, or all of several."""
        is_several = self.told.verdict is Verdict.SEVERAL
        return self.is_said and (self.is_all_right if is_several else self.is_first_right)


def measure() -> Iterator[Figure]:
    """Measure what is found and what each verdict is worth, by words alone and with the model."""
    which = "developing" if IS_DEVELOPING else "judging"
    embedder = find_model()
    ways: dict[str, Callable[[], Embedder | None]] = {"words": lambda: None}
    ways |= {} if embedder is None else {"model": lambda: embedder}
    for way, find in ways.items():
        asked = ask_all(read_lines(is_developing=IS_DEVELOPING), find)
        yield from _sum_up(f"{way}, {which}", asked)


def _sum_up(what: str, asked: Sequence[Asked]) -> Iterator[Figure]:
    there = [each for each in asked if not each.is_absent]
    absent = [each for each in asked if each.is_absent]
    yield _share(f"{what}: right one first", [each.is_first_right for each in there])
    yield _share(f"{what}: right one in first five", [each.is_among_five for each in there])
    yield _share(f"{what}: said and right (60)", [each.is_said_right for each in there])
    said = [each for each in asked if each.is_said]
    yield _share(f"{what}: wrong when said (2 at most)", [not each.is_said_right for each in said])
    for verdict in Verdict:
        own = [each for each in asked if each.told.verdict is verdict]
        right = [each.is_absent if verdict is Verdict.NOT_REMEMBERED else each.is_first_right
                 for each in own]  # fmt: skip
        yield _share(f"{what}: {verdict}, right", right)
    unremembered = Verdict.NOT_REMEMBERED
    refused = [each.told.verdict is unremembered for each in there]
    yield _share(f"{what}: called unremembered though there", refused)
    is_told = [each.told.verdict is unremembered for each in absent]
    yield _share(f"{what}: absent, said so (85)", is_told)


def _share(name: str, answers: Sequence[bool]) -> Figure:
    value = 100 * sum(answers) / max(len(answers), 1)
    return Figure(name=f"{name}, of {len(answers)}", value=value, unit="%")


def read_lines(*, is_developing: bool) -> list[Line]:
    """Read the half of the requests for developing, or the one for judging."""
    lines = _read_every_line()
    order = np.random.default_rng(SPLIT_SEED).permutation(len(lines)).tolist()
    return [lines[i] for i in sorted(order[int(not is_developing) :: 2])]


def _read_every_line() -> list[Line]:
    path = Path(__file__).with_name("requests") / "people.txt"
    text = path.read_text(encoding="utf-8")
    rows = [row.split("|") for row in text.splitlines() if not row.startswith("#")]
    return [
        Line(
            words=words.strip(),
            labels=frozenset(filter(None, (label.strip() for label in labels.split(";")))),
        )
        for words, labels in rows
    ]


def ask_all(lines: Sequence[Line], find_model: Callable[[], Embedder | None]) -> list[Asked]:
    """Ask each request where it can be met, and every third where it cannot."""
    dealt = np.array(sorted({label for line in _read_every_line() for label in line.labels}))
    dealt = dealt[np.random.default_rng(SEED).permutation(len(dealt))]
    asked = []
    for number, style in enumerate(STYLES):
        world, labels = _furnish(style, dealt[number :: len(STYLES)].tolist(), find_model)
        for i, line in enumerate(lines):
            is_absent = not line.labels & labels
            if not is_absent or i % (ABSENT_EVERY * len(STYLES)) == number:
                asked.append(_ask(world, line, is_absent=is_absent))
    return asked


def _furnish(
    style: str, labels: Sequence[str], find_model: Callable[[], Embedder | None]
) -> tuple[WorldModel, frozenset[str]]:
    """Return the memory of a drawn building whose things have these labels, and those in it."""
    site = Site(parse_world(draw_plan(style, seed=SEED), name=style))
    order = np.random.default_rng(SEED).permutation(len(site.things)).tolist()
    named = {site.things[at]: labels[i % len(labels)] for i, at in enumerate(order)}
    site.things = tuple(replace(thing, label=named[thing]) for thing in site.things)
    memory = observe(site, seed=SEED, has_ranges=True)
    world = WorldModel(
        site.grid,
        Pose(0.0, 0.0),
        memory.places,
        radius_m=RADIUS_M,
        revision=site.revision,
        recollector=Recollector(find_model),
    )
    return world, frozenset(thing.thing.label for thing in world.things)


def _ask(world: WorldModel, line: Line, *, is_absent: bool) -> Asked:
    told = recall(world, RecallQuery(words=line.words, n=FIRST))
    right = [each.name in line.labels for each in told.candidates]
    return Asked(
        line=line,
        told=told,
        is_absent=is_absent,
        is_first_right=any(right[:1]),
        is_among_five=any(right),
        is_all_right=bool(right) and all(right[: told.answer.n_meant]),
    )
