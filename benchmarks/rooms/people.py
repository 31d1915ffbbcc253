"""How well the division of a map agrees with people.

MAPS holds folders of maps; each map is a folder with `map.png` (0 occupied, 205 unknown, 254
free), `rooms.png` (16-bit region numbers, 0 for none) and `meta.json` (the resolution; per region
its number, and if known whether it is a "room" or a "hallway", as type or as class). Only cells
that are free in the map and numbered by people are counted.
"""

import json
import os
import statistics
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import click
import cv2
import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from benchmarks.figure import Figure
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.mapfiles import load_picture
from mapspeak.spatial.rooms import RoomClass, RoomMap, find_rooms

__all__ = [
    "Numbers",
    "count_hallways",
    "find_agreement",
    "find_labelled_maps",
    "find_overlap",
    "list_labelled_maps",
    "read_classes",
    "score_figures",
    "score_map",
    "show_maps",
    "timed_rooms",
]

RANKS = {"smallest": 0, "second": 1, "largest": -1}

PUBLISHED = {
    "bormann_plain": {
        "MAORIS": 0.908,
        "distance": 0.796,
        "morphological": 0.797,
        "DuDe": 0.782,
        "ROSE2": 0.768,
        "Voronoi": 0.759,
    },
    "bormann_furnished": {"DuDe": 0.777, "ROSE2": 0.771, "Voronoi": 0.693},
    "rose2_full": {"ROSE2": 0.817},
    "rose2_partial_fr79": {"ROSE2": 0.862},
}
"""F1 at 0.5 of published methods on the same maps with the same score; none takes part here.

The figures are those of the table in the maps' own README.md. Distance, morphological and Voronoi
are the segmentations of Bormann et al. (ICRA 2016).
"""

Numbers = NDArray[np.intp]
Ratios = NDArray[np.float64]


def find_labelled_maps() -> Path | None:
    """Return the folder of maps that people have divided, or None where there is none."""
    named = os.environ.get("MAPSPEAK_LABELLED_MAPS")
    folder = Path(named) if named else Path(__file__).parents[3] / "shared" / "maps"
    return folder if folder.is_dir() else None


def list_labelled_maps(maps: Path) -> list[Path]:
    """Return the folders of the maps in it, in alphabetical order."""
    return [found.parent for found in sorted(maps.glob("*/*/rooms.png"))]


def score_figures(scores: Sequence["Score"]) -> Iterator[Figure]:
    """Return the means of groups of maps, and how often the questions are answered rightly."""
    for group, own in _by_group(scores).items():
        f1_50 = statistics.mean(score.f1_50 for score in own)
        f1_75 = statistics.mean(score.f1_75 for score in own)
        yield Figure(name=f"{group}, {len(own)} maps, F1 at IoU 0.5", value=f1_50, unit="")
        yield Figure(name=f"{group}, {len(own)} maps, F1 at IoU 0.75", value=f1_75, unit="")
    ranks = [score.ranks_right for score in scores if score.ranks_right]
    for name in RANKS if ranks else ():
        n_right = sum(rank[name] for rank in ranks)
        yield Figure(name=f"{name} room right, of {len(ranks)}", value=n_right, unit="maps")


def _by_group(scores: Sequence["Score"]) -> dict[str, list["Score"]]:
    groups: dict[str, list[Score]] = {}
    for score in scores:
        groups.setdefault(score.group, []).append(score)
    return groups


def timed_rooms(grid: OccupancyGrid) -> tuple[RoomMap, float]:
    """Divide a map; return also the milliseconds of CPU time that it took."""
    started_s = time.process_time()
    rooms = find_rooms(grid)
    return rooms, (time.process_time() - started_s) * 1e3


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """How one map was divided; None where people gave no classes.

    Attributes:
        group: The folder the map's folder lies in.
        name: The map's folder.
        f1_50: F1 of regions that agree with an intersection over union of at least 0.5.
        f1_75: The same for 0.75.
        n_found: Regions found.
        n_true: Regions people drew.
        class_ratio: The share of agreeing regions with the right class.
        hallways: Corridors found that are hallways people drew, corridors that are none, and
            hallways that no corridor agrees with.
        ranks_right: Which rooms by size are the right ones; hallways, and regions that may be
            parts of others, left out.
        time_ms: CPU time.
    """

    group: str
    name: str
    f1_50: float
    f1_75: float
    n_found: int
    n_true: int
    class_ratio: float | None
    hallways: tuple[int, int, int] | None
    ranks_right: dict[str, bool] | None
    time_ms: float


def score_map(folder: Path) -> Score:
    """Divide one map and compares it with what people drew."""
    meta = json.loads((folder / "meta.json").read_text())
    loaded = load_picture(folder / "map.png", resolution_m=meta["resolution"])
    rooms, time_ms = timed_rooms(loaded.grid)
    picture = cv2.imread(str(folder / "rooms.png"), cv2.IMREAD_UNCHANGED)
    truth = np.asarray(picture, np.intp)[::-1]
    overlap = find_overlap(rooms.labels.astype(np.intp), truth, loaded.grid.free & (truth > 0))
    agreement = find_agreement(overlap)
    classes = read_classes(meta)
    pairs = [(int(i), int(j)) for i, j in np.argwhere(agreement >= 0.5)]
    return Score(
        group=folder.parent.name,
        name=folder.name,
        f1_50=_f1(overlap, agreement, 0.5),
        f1_75=_f1(overlap, agreement, 0.75),
        n_found=int((overlap[1:].sum(axis=1) > 0).sum()),
        n_true=int((overlap[:, 1:].sum(axis=0) > 0).sum()),
        class_ratio=_class_ratio(rooms, classes, pairs) if classes else None,
        hallways=_hallways(rooms, classes, overlap) if classes else None,
        ranks_right=_ranks_right(rooms, classes, truth, agreement) if classes else None,
        time_ms=time_ms,
    )


def read_classes(meta: dict[str, Any]) -> dict[int, str]:
    """Return "room" or "hallway" for each number that has a class."""
    named = {room["id"]: room.get("type", room.get("class")) for room in meta.get("rooms", ())}
    return {number: each for number, each in named.items() if each in ("room", "hallway")}


def find_overlap(found: Numbers, truth: Numbers, counted: NDArray[np.bool_]) -> Numbers:
    """Return the number of shared cells; row by region found, column by region drawn."""
    shape = (int(found.max(initial=0)) + 1, int(truth.max(initial=0)) + 1)
    flat = found[counted] * shape[1] + truth[counted]
    return np.bincount(flat, minlength=shape[0] * shape[1]).reshape(shape)


def find_agreement(overlap: Numbers) -> Ratios:
    """Return the intersection over union; above 0.5 it pairs regions one to one."""
    union = overlap.sum(axis=1, keepdims=True) + overlap.sum(axis=0, keepdims=True) - overlap
    ratios: Ratios = overlap / np.maximum(union, 1)
    ratios[0] = ratios[:, 0] = 0
    return ratios


def _f1(overlap: Numbers, agreement: Ratios, least: float) -> float:
    n_found = int((overlap[1:].sum(axis=1) > 0).sum())
    n_true = int((overlap[:, 1:].sum(axis=0) > 0).sum())
    return 2 * int((agreement >= least).sum()) / max(n_found + n_true, 1)


def _is_hallway(rooms: RoomMap, index: int) -> bool:
    return rooms.regions[index - 1].room_class is RoomClass.CORRIDOR


def _class_ratio(
    rooms: RoomMap, classes: dict[int, str], pairs: list[tuple[int, int]]
) -> float | None:
    known = [(i, classes[j]) for i, j in pairs if j in classes]
    right = [_is_hallway(rooms, i) == (each == "hallway") for i, each in known]
    return statistics.mean(right) if right else None


def _hallways(rooms: RoomMap, classes: dict[int, str], overlap: Numbers) -> tuple[int, int, int]:
    corridors = [region.room_class is RoomClass.CORRIDOR for region in rooms.regions]
    return count_hallways(corridors, classes, overlap)


def count_hallways(
    is_corridor: Sequence[bool], classes: dict[int, str], overlap: Numbers
) -> tuple[int, int, int]:
    """Count corridors that are hallways people drew, that are none, and hallways not found.

    Args:
        is_corridor: Of each region found.
        classes: What the regions that people drew are.
    """
    drawn = np.flatnonzero(overlap.any(axis=0)).tolist()
    n_true = sum(classes.get(number) == "hallway" for number in drawn)
    found = [i for i in np.flatnonzero(overlap[:, 1:].any(axis=1)).tolist() if i > 0]
    n_found = sum(is_corridor[i - 1] for i in found)
    pairs = np.argwhere(find_agreement(overlap) >= 0.5).tolist()
    n_right = sum(is_corridor[i - 1] and classes.get(j) == "hallway" for i, j in pairs)
    return n_right, n_found - n_right, n_true - n_right


def _ranks_right(
    rooms: RoomMap, classes: dict[int, str], truth: Numbers, agreement: Ratios
) -> dict[str, bool]:
    found = sorted(
        (region.floor_area_m2, region.index)
        for region in rooms.regions
        if region.room_class is not RoomClass.CORRIDOR and not rooms.find_doubtful_door(region)
    )
    areas = np.bincount(truth.ravel())
    true = sorted((int(areas[j]), j) for j, named in classes.items() if named == "room")
    return {
        name: len(found) > abs(rank) and bool(agreement[found[rank][1], true[rank][1]] >= 0.5)
        for name, rank in RANKS.items()
    }


def show_maps(maps: Path, *, as_json: bool) -> None:
    """Write the scores of a folder of maps."""
    scores = [score_map(folder) for folder in list_labelled_maps(maps)]
    if as_json:
        click.echo(json.dumps([asdict(score) for score in scores], indent=2))
        return
    _show(scores)


def _show(scores: Sequence[Score]) -> None:
    columns = ("maps", "n", "F1@.5", "F1@.75", "class", "hallway F1", *RANKS, "ms", "ms, most")
    table = Table(*columns)
    for group, own in _by_group(scores).items():
        table.add_row(group, *_row(own))
        for method, f1_50 in PUBLISHED.get(group, {}).items():
            table.add_row(f"  {method}", "", f"{f1_50:.3f}")
    table.add_row("all", *_row(scores))
    Console(width=120).print(table)


def _row(scores: Sequence[Score]) -> list[str]:
    times_ms = [score.time_ms for score in scores]
    ranks = [score.ranks_right for score in scores if score.ranks_right]
    return [
        str(len(scores)),
        _mean(score.f1_50 for score in scores),
        _mean(score.f1_75 for score in scores),
        _mean(score.class_ratio for score in scores),
        _hallway_f1(scores),
        *(f"{sum(rank[name] for rank in ranks)}/{len(ranks)}" for name in RANKS),
        f"{statistics.mean(times_ms):.0f}",
        f"{max(times_ms):.0f}",
    ]


def _mean(values: Iterable[float | None]) -> str:
    known = [value for value in values if value is not None]
    return f"{statistics.mean(known):.3f}" if known else "-"


def _hallway_f1(scores: Sequence[Score]) -> str:
    counts: list[Any] = [score.hallways for score in scores if score.hallways]
    if not counts:
        return "-"
    right, wrong, missed = (sum(column) for column in zip(*counts, strict=True))
    return f"{2 * right / max(2 * right + wrong + missed, 1):.3f}"
