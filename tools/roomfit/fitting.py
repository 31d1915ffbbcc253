"""Fit on all buildings but some, score on those, and fit on all."""

import pickle
import statistics
import sys
import zlib
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import chain, repeat
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from benchmarks.rooms.people import list_labelled_maps
from mapspeak.spatial.rooms.joining import Judge, read_trees
from tools.roomfit.labelled import LabelledMap, draw_maps, read_maps
from tools.roomfit.samples import Samples, Score, Task, prepare, unite
from tools.roomfit.trees import fit_judge, fit_trees
from tools.roomfit.variants import VARIANTS

SEEDS = range(300, 306)
VARIANT_WEIGHT = 0.5
"""A map made worse counts so much beside the map itself."""


def fit(folder: Path, *, n_parts: int, n_rounds: int) -> str:
    """Return the trees fitted on all maps; print scores of buildings left out, and of all.

    The buildings are dealt to parts; each part is divided by a judge that was fitted on the
    others. What a judge meets while it joins is added to the samples of the next round.
    """
    # Threads of OpenCV and LightGBM do not survive a fork.
    with (
        TemporaryDirectory() as scratch,
        ProcessPoolExecutor(mp_context=get_context("spawn")) as pool,
    ):
        drawn = chain.from_iterable(pool.map(draw_maps, SEEDS))
        maps = [*read_maps(list_labelled_maps(folder)), *drawn]
        tasks = list(pool.map(_prepare_all, maps, repeat(scratch)))
        parts = _deal([labelled.building for labelled in maps], n_parts)
        samples = list(pool.map(_play_all, tasks, repeat(None)))
        for number in range(1, n_rounds + 1):
            judges = [
                fit_judge(
                    unite([own for own, part in zip(samples, parts, strict=True) if part != k])
                )
                for k in range(n_parts)
            ]
            own_judges = [judges[part] for part in parts]
            _print_scores(f"left out, round {number}", maps, pool.map(_score, tasks, own_judges))
            if number < n_rounds:
                played = pool.map(_play_all, tasks, own_judges)
                samples = [unite(pair) for pair in zip(samples, played, strict=True)]
        text = fit_trees(unite(samples))
        _print_scores("fitted", maps, pool.map(_score, tasks, repeat(read_trees(text))))
    return text


def _prepare_all(labelled: LabelledMap, scratch: str) -> Path:
    """Write a map as it is, and made worse in each way; all of them do not fit into memory."""
    cv2.setNumThreads(1)
    seed = zlib.crc32(f"{labelled.group}/{labelled.name}".encode())
    worse = [vary(labelled, np.random.default_rng((seed, i))) for i, vary in enumerate(VARIANTS)]
    path = Path(scratch) / f"{seed}.pickle"
    path.write_bytes(pickle.dumps([prepare(each) for each in (labelled, *worse)]))
    return path


def _read_tasks(path: Path) -> list[Task]:
    tasks: list[Task] = pickle.loads(path.read_bytes())  # noqa: S301 - written above
    return tasks


def _play_all(path: Path, judge: Judge | None) -> Samples:
    return _weigh([task.play(judge) for task in _read_tasks(path)])


def _weigh(parts: Sequence[Samples]) -> Samples:
    """Return the samples of a map and of what it was made into, which count less."""
    first, *worse = parts
    lighter = [
        Samples(measures=part.measures, is_none=part.is_none, weights=part.weights * VARIANT_WEIGHT)
        for part in worse
    ]
    return unite([first, *lighter])


def _score(path: Path, judge: Judge) -> list[Score]:
    return [task.score(judge) for task in _read_tasks(path)]


def _deal(buildings: Sequence[str], n_parts: int) -> list[int]:
    """Return the part of each building, however many maps are of it."""
    names = sorted(set(buildings))
    order = np.random.default_rng(0).permutation(len(names))
    part = {names[i]: place % n_parts for place, i in enumerate(order.tolist())}
    return [part[building] for building in buildings]


def _print_scores(
    title: str, maps: Sequence[LabelledMap], scores: Iterable[Sequence[Score]]
) -> None:
    kinds = ("as it is", *(vary.__name__ for vary in VARIANTS))
    groups: dict[str, list[Sequence[Score]]] = defaultdict(list)
    for labelled, own in zip(maps, scores, strict=True):
        groups[labelled.group].append(own)
    sys.stdout.write(f"F1 at IoU 0.5, {title}: {', '.join(kinds)}; hallways as it is\n")
    sys.stdout.writelines(_rows(groups))
    sys.stdout.flush()


def _rows(groups: dict[str, list[Sequence[Score]]]) -> Iterator[str]:
    for group, scores in [*groups.items(), ("all", list(chain.from_iterable(groups.values())))]:
        means = " ".join(
            f"{statistics.mean(each.f1 for each in column):.3f}"
            for column in zip(*scores, strict=True)
        )
        yield f"  {group:20} {len(scores):3} maps  {means}  {_hallway_f1(scores)}\n"


def _hallway_f1(scores: Sequence[Sequence[Score]]) -> str:
    """Return F1 of hallways end to end, on the maps as they are."""
    right, wrong, missed = (
        sum(column) for column in zip(*(own[0].hallways for own in scores), strict=True)
    )
    return f"{2 * right / (2 * right + wrong + missed):.3f}" if right + missed else "-"
