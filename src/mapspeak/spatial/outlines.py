"""Outlines of labelled cells: the borders between labels, followed into rings along cell edges.

A vertex is a corner of a cell, as (row, col) counted in whole cells from the grid's origin. Every
border runs with its own label on the left, so outer rings are counter-clockwise and holes are
clockwise (as RFC 7946 wants them). Borders break wherever the label on either side changes, so
outlines of neighbours share all corners along their common border.
"""

from collections import defaultdict
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Vertex = tuple[int, int]
VertexRing = tuple[Vertex, ...]
"""Without the first vertex repeated."""

Labels = NDArray[np.integer[Any]]

_LEFT, _STRAIGHT, _RIGHT = 1, 0, 3


@dataclass(frozen=True, slots=True, kw_only=True)
class BorderRun:
    """A straight piece of border, with its label on the left.

    Attributes:
        other: The label on the right; 0 for none.
        direction: 0 along columns, 1 along rows, 2 and 3 backwards.
    """

    label: int
    other: int
    direction: int
    start: Vertex
    end: Vertex


@dataclass(frozen=True, slots=True, kw_only=True)
class VertexPolygon:
    """An outer ring with its holes."""

    outer: VertexRing
    holes: tuple[VertexRing, ...]


def find_borders(labels: Labels) -> list[BorderRun]:
    """Return all borders of all labels above 0."""
    padded = np.pad(labels, 1)
    here = padded[1:-1, 1:-1]
    return [
        *_pieces(here, padded[:-2, 1:-1], direction=0),
        *_pieces(here, padded[1:-1, 2:], direction=1),
        *_pieces(here, padded[2:, 1:-1], direction=2),
        *_pieces(here, padded[1:-1, :-2], direction=3),
    ]


def _pieces(here: Labels, there: Labels, *, direction: int) -> list[BorderRun]:
    """Return the borders towards one side: runs of cells with the same two labels."""
    rows, cols = np.nonzero((here != there) & (here > 0))
    is_upright = direction in {1, 3}
    order = np.lexsort((rows, cols)) if is_upright else np.arange(rows.size)
    rows, cols = rows[order], cols[order]
    label, other = here[rows, cols], there[rows, cols]
    along, across = (rows, cols) if is_upright else (cols, rows)
    goes_on = (np.diff(along) == 1) & (np.diff(across) == 0)
    goes_on &= (np.diff(label) == 0) & (np.diff(other) == 0)
    first = np.flatnonzero(np.concatenate([[True], ~goes_on])) if rows.size else rows
    last = np.append(first[1:], rows.size) - 1 if rows.size else rows
    start, end = along[first], along[last] + 1
    if direction in {2, 3}:
        start, end = end, start
    line = across[first] + (direction in {1, 2})
    starts, ends = ([at, line] if is_upright else [line, at] for at in (start, end))
    pieces = np.stack([label[first], other[first], *starts, *ends], axis=1).tolist()
    return [
        BorderRun(label=own, other=beside, direction=direction, start=(r0, c0), end=(r1, c1))
        for own, beside, r0, c0, r1, c1 in pieces
    ]


def trace_polygons(borders: list[BorderRun]) -> dict[int, tuple[VertexPolygon, ...]]:
    """Return the polygons of every label, the largest first.

    Cells that touch at a corner only are apart: each gets a polygon of its own. No ring visits a
    vertex twice; a hole may touch an outer ring or another hole at single vertices.
    """
    rings: defaultdict[int, list[VertexRing]] = defaultdict(list)
    following = {(border.label, border.start, border.direction): border for border in borders}
    while following:
        first = next(iter(following.values()))
        rings[first.label] += _split(_follow(following, first))
    return {label: _assemble(rings[label]) for label in sorted(rings)}


def _follow(following: dict[tuple[int, Vertex, int], BorderRun], first: BorderRun) -> list[Vertex]:
    """Take one closed line out of the borders.

    The left turn comes first where two cells touch at a corner: it stays with the same cell.
    """
    vertices = []
    border = first
    while True:
        vertices.append(border.start)
        del following[border.label, border.start, border.direction]
        ahead = (
            following.get((border.label, border.end, (border.direction + turn) % 4))
            for turn in (_LEFT, _STRAIGHT, _RIGHT)
        )
        successor = next((each for each in ahead if each is not None), None)
        if successor is None:
            return vertices
        border = successor


def _split(vertices: list[Vertex]) -> list[VertexRing]:
    """Cut a closed line that touches itself into rings that do not."""
    rings: list[VertexRing] = []
    path: list[Vertex] = []
    place: dict[Vertex, int] = {}
    for vertex in [*vertices, vertices[0]]:
        if vertex in place:
            loop = path[place[vertex] :]
            del path[place[vertex] :]
            for each in loop:
                del place[each]
            rings.append(tuple(loop))
        place[vertex] = len(path)
        path.append(vertex)
    return rings


def _assemble(rings: list[VertexRing]) -> tuple[VertexPolygon, ...]:
    """Assign each hole to the smallest outer ring around it."""
    outers = sorted((ring for ring in rings if twice_area(ring) > 0), key=twice_area)
    holes: list[list[VertexRing]] = [[] for _ in outers]
    for ring in rings:
        if twice_area(ring) > 0:
            continue
        # The centre of the cell to the left of the ring's first piece.
        (row, col), (next_row, next_col) = ring[:2]
        down, right = np.sign(next_row - row), np.sign(next_col - col)
        point = row + 0.5 * (down + right), col + 0.5 * (right - down)
        around = (i for i, outer in enumerate(outers) if len(outers) == 1 or _holds(outer, point))
        holes[next(around)].append(ring)
    polygons = [
        VertexPolygon(outer=outer, holes=tuple(own))
        for outer, own in zip(outers, holes, strict=True)
    ]
    return tuple(reversed(polygons))


def twice_area(ring: VertexRing) -> int:
    """Return twice the area in cells, positive when the ring runs counter-clockwise."""
    ahead = (*ring[1:], ring[0])
    return sum(
        one[1] * other[0] - other[1] * one[0] for one, other in zip(ring, ahead, strict=True)
    )


def _holds(ring: VertexRing, point: tuple[float, float]) -> bool:
    """Tell by crossings whether a cell's centre lies in a ring."""
    rows, cols = np.array(ring).T
    next_rows = np.roll(rows, -1)
    crosses = (rows > point[0]) != (next_rows > point[0])
    return bool((crosses & (cols > point[1])).sum() % 2)
