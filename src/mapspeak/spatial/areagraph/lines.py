"""The line of a door: from one end of the border that its two areas share there to the other."""

from collections import Counter, defaultdict
from itertools import combinations

import numpy as np

from mapspeak.spatial.areagraph.outlines import Border, Vertex

VertexLine = tuple[Vertex, Vertex]
Place = tuple[float, float]
"""Row and column of a point, as real numbers on the scale of vertices."""


def find_lines(borders: list[Border], places: list[Place]) -> list[VertexLine | None]:
    """Gives the line of each door between two areas, in the order of the doors.

    Args:
        borders: All that these two areas have in common, from one side.
        places: The middle of each door.
    """
    ends: list[list[Vertex]] = [[] for _ in places]
    for run in _runs(borders):
        nearest = min(range(len(places)), key=lambda i: _distance(run, places[i]))
        ends[nearest] += _ends(run)
    return [_farthest_pair(each) for each in ends]


def _runs(borders: list[Border]) -> list[list[Border]]:
    """Gives the borders that hang together."""
    at: defaultdict[Vertex, list[int]] = defaultdict(list)
    for index, border in enumerate(borders):
        at[border.start].append(index)
        at[border.end].append(index)
    left = dict.fromkeys(range(len(borders)))
    runs = []
    while left:
        open_ends = [next(iter(left))]
        run = []
        while open_ends:
            index = open_ends.pop()
            if index not in left:
                continue
            del left[index]
            border = borders[index]
            run.append(border)
            open_ends += at[border.start] + at[border.end]
        runs.append(run)
    return runs


def _ends(run: list[Border]) -> list[Vertex]:
    """Gives the vertices at which a run begins and ends; none when it is closed."""
    touches = Counter(vertex for border in run for vertex in (border.start, border.end))
    return sorted(vertex for vertex, n in touches.items() if n % 2)


def _farthest_pair(ends: list[Vertex]) -> VertexLine | None:
    pairs = list(combinations(sorted(set(ends)), 2))
    return max(pairs, key=lambda pair: _squared_length(*pair)) if pairs else None


def _squared_length(one: Vertex, other: Vertex) -> int:
    return (one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2


def _distance(run: list[Border], place: Place) -> float:
    """Gives the distance in cells from a point to the nearest border of a run."""
    corners = np.array([(border.start, border.end) for border in run], np.float64)
    nearest = np.clip(np.array(place), corners.min(axis=1), corners.max(axis=1))
    return float(np.hypot(*(nearest - np.array(place)).T).min())
