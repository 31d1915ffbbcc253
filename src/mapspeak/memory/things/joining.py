"""Which views are of one thing: they may share a label and can meet at one place.

Views that speak of no place together are divided first, so that a new view costs what it touches.
Votes of the others are added up over the map. The place with most votes is a thing; the views that
it explains better than a thing of their own would are taken out, at most one from each pose, since
who names two sees two. What is left votes again. Then every view may change to the thing that
explains it best, things that are better explained as one are joined, and two views that do not
bear each other out are parted.
"""

import math
from collections.abc import Iterator, Sequence

import cv2
import numpy as np

from mapspeak.memory.merging import SAME_SPOT_M
from mapspeak.memory.things.labels import name_the_same
from mapspeak.memory.things.likelihood import NEAR_M, WeighedView
from mapspeak.memory.things.placing import (
    Posterior,
    build_posterior,
    find_middle,
    likelihood_of,
    log_evidence,
    measure_agreement,
)
from mapspeak.memory.things.sight import SightMap, find_log_priors
from mapspeak.memory.waypoint import Waypoint
from mapspeak.spatial.grid import FloatArray, IntArray

Group = list[WeighedView]

N_SWEEPS = 2
_THINGS_PER_CELL = 0.01
"""Of one name: about one on twenty metres of wall, in cells of the lattice."""


class _Ballot:
    """The votes of all views of a pool, sorted by cell, and what is left of them.

    Attributes:
        places: Lattice cells that any view speaks of, rising.
        voters: For each vote, the index of its view.
        starts: Where the votes of each place begin; one more at the end.
    """

    def __init__(self, sight: SightMap, sightings: Sequence[WeighedView]) -> None:
        likelihoods = [likelihood_of(each) for each in sightings]
        cells = np.concatenate([each.cells for each in likelihoods])
        order = np.argsort(cells, kind="stable")
        sizes = [len(each.cells) for each in likelihoods]
        self.places, starts = np.unique(cells[order], return_index=True)
        self.starts: IntArray = np.append(starts, len(cells))
        self.voters: IntArray = np.repeat(np.arange(len(sizes)), sizes)[order]
        self.ratios: FloatArray = np.concatenate([each.ratios for each in likelihoods])[order]
        self.least_ratios: FloatArray = np.array([each.least_ratio for each in sightings])
        self._n_left = np.diff(self.starts)
        self._at = np.repeat(np.arange(len(self.places)), self._n_left)
        self._weights = np.log1p(self.ratios)
        self._by_voter = np.argsort(self.voters, kind="stable")
        self._ends = np.searchsorted(self.voters[self._by_voter], np.arange(len(sizes) + 1))
        log_priors = find_log_priors(
            sight,
            self.places,
            (each.update for each in likelihoods),
            sightings[0].stance,
        )
        n_places = len(self.places)
        self.votes: FloatArray = log_priors + np.bincount(
            self._at, weights=self._weights, minlength=n_places
        )

    def votes_at(self, indices: IntArray) -> IntArray:
        sizes = self.starts[indices + 1] - self.starts[indices]
        first = np.repeat(self.starts[indices] - np.cumsum(sizes) + sizes, sizes)
        return first + np.arange(int(sizes.sum()))

    def find_best(self) -> int | None:
        """Return the index of the place with most votes; None when no vote is left."""
        best = int(np.argmax(self.votes))
        return best if np.isfinite(self.votes[best]) else None

    def take_out(self, voter: int) -> None:
        mine = self._by_voter[self._ends[voter] : self._ends[voter + 1]]
        at = self._at[mine]
        self.votes[at] -= self._weights[mine]
        self._n_left[at] -= 1
        self.votes[at[self._n_left[at] == 0]] = -np.inf


def divide_views(
    sight: SightMap, views: Sequence[WeighedView]
) -> Iterator[tuple[WeighedView, ...]]:
    """Divide views by whether they, over others, speak of places beside each other.

    Views of different parts are never of one thing, so that each part is joined for itself.
    """
    spoken_of = [view.spoken_of for view in views]
    mask = np.zeros(sight.rows.shape, dtype=np.uint8)
    mask.ravel()[np.concatenate([np.empty(0, dtype=np.intp), *spoken_of])] = 1
    # A place of most votes is spoken of by views of its neighbours, too.
    n_areas, areas = cv2.connectedComponents(cv2.dilate(mask, np.ones((3, 3), dtype=np.uint8)))
    owner = np.arange(n_areas)
    touched = [np.unique(areas.ravel()[cells]) for cells in spoken_of]
    for each in touched:
        owners = np.unique(owner[each])
        if len(owners) > 1:
            owner[np.isin(owner, owners)] = owners[0]
    parts: dict[int, list[WeighedView]] = {}
    for number, (view, each) in enumerate(zip(views, touched, strict=True)):
        parts.setdefault(int(owner[each[0]]) if each.size else -1 - number, []).append(view)
    return map(tuple, parts.values())


def join_sightings(posteriors: "Posteriors", sightings: Sequence[WeighedView]) -> list[Group]:
    """Divide views whose labels are related, each with a likelihood: one group for each thing."""
    ballot = _Ballot(posteriors.sight, sightings)
    groups = _take_peaks(posteriors.sight, sightings, ballot)
    for _ in range(N_SWEEPS):
        groups = _sweep(posteriors, sightings, groups, ballot)
    merged = _merge(posteriors, groups)
    return [each for group in merged for each in _part(posteriors, group)]


class Posteriors:
    """Where things may be, by the groups of views of them; each is worked out once."""

    def __init__(self, sight: SightMap) -> None:
        self.sight = sight
        self._known: dict[tuple[WeighedView, ...], Posterior] = {}

    def of(self, group: Group) -> Posterior:
        """Return where the thing of a group of views may be."""
        key = tuple(group)
        if key not in self._known:
            self._known[key] = build_posterior(self.sight, group)
        return self._known[key]


def _take_peaks(sight: SightMap, sightings: Sequence[WeighedView], ballot: _Ballot) -> list[Group]:
    is_left = np.ones(len(sightings), dtype=np.bool_)
    groups = []
    while is_left.any() and (best := ballot.find_best()) is not None:
        near = _around(sight, ballot, best)
        said = ballot.votes_at(near)
        ratios = np.zeros(len(sightings))
        np.maximum.at(ratios, ballot.voters[said], ballot.ratios[said])
        ratios[~is_left] = 0.0
        chosen = _choose(sightings, ratios, ballot.least_ratios)
        if not chosen:
            # Nothing that is left can be there.
            ballot.votes[near] = -np.inf
            continue
        groups.append([sightings[i] for i in chosen])
        is_left[chosen] = False
        for i in chosen:
            ballot.take_out(i)
    return groups + [[sightings[i]] for i in np.flatnonzero(is_left).tolist()]


def _around(sight: SightMap, ballot: _Ballot, index: int) -> IntArray:
    n_cols = sight.rows.shape[1]
    steps = np.array([-1, 0, 1])
    cells = (ballot.places[index] + n_cols * steps[:, None] + steps).ravel()
    found = np.searchsorted(ballot.places, cells)
    found = np.minimum(found, len(ballot.places) - 1)
    return np.asarray(found[ballot.places[found] == cells], dtype=np.intp)


def _choose(
    sightings: Sequence[WeighedView], ratios: FloatArray, least_ratios: FloatArray
) -> list[int]:
    """Return the views that speak of a place, the strongest first, one from each pose."""
    chosen: list[int] = []
    speaking = np.flatnonzero(ratios >= least_ratios)
    for i in speaking[np.argsort(-ratios[speaking], kind="stable")].tolist():
        if _fits(sightings[i], (sightings[j] for j in chosen)):
            chosen.append(i)
    return chosen


def _fits(sighting: WeighedView, members: Iterator[WeighedView]) -> bool:
    return all(
        not _are_of_one_look(sighting.waypoint, other.waypoint)
        and name_the_same(sighting.landmark.label, other.landmark.label)
        for other in members
    )


def _are_of_one_look(one: Waypoint, other: Waypoint) -> bool:
    """Return True for views of one place from one spot: who names two of a kind there sees two."""
    if one is other:
        return True
    is_same_spot = one.pose.point.distance_to(other.pose.point) < SAME_SPOT_M
    return one.name == other.name and is_same_spot


def _sweep(
    posteriors: Posteriors,
    sightings: Sequence[WeighedView],
    groups: list[Group],
    ballot: _Ballot,
) -> list[Group]:
    """Return every view to the thing that explains it best; what is alone may join another."""
    ratios = np.zeros((len(sightings), len(groups)))
    number = {id(sighting): i for i, sighting in enumerate(sightings)}
    for j, group in enumerate(groups):
        ratios[:, j] = _explain(ballot, posteriors.of(group), len(sightings))
        if len(group) == 1:
            ratios[number[id(group[0])], j] = group[0].least_ratio
    taken: list[Group] = [[] for _ in groups]
    is_left = np.ones(len(sightings), dtype=np.bool_)
    rows, cols = np.nonzero(ratios >= ballot.least_ratios[:, None])
    for k in np.argsort(-ratios[rows, cols], kind="stable").tolist():
        i, j = int(rows[k]), int(cols[k])
        if is_left[i] and _fits(sightings[i], iter(taken[j])):
            taken[j].append(sightings[i])
            is_left[i] = False
    alone = [[sightings[i]] for i in np.flatnonzero(is_left).tolist()]
    return [group for group in taken if group] + alone


def _explain(ballot: _Ballot, posterior: Posterior, n_views: int) -> FloatArray:
    """Return how much likelier each view is, given where a thing may be."""
    indices = np.searchsorted(ballot.places, posterior.cells)
    said = ballot.votes_at(indices)
    weights = np.repeat(posterior.weights, np.diff(ballot.starts)[indices])
    explained = np.bincount(
        ballot.voters[said], weights=weights * ballot.ratios[said], minlength=n_views
    )
    return np.asarray(explained, dtype=np.float64)


def _merge(posteriors: Posteriors, groups: list[Group]) -> list[Group]:
    """Join things that are better explained as one, the nearest first."""
    sight = posteriors.sight
    middles = [find_middle(sight, posteriors.of(group)) for group in groups]
    at = np.array(middles).reshape(-1, 2)
    off_m = np.hypot(*(np.subtract.outer(at[:, k], at[:, k]) for k in (0, 1)))
    first, second = np.nonzero(np.tril(off_m <= NEAR_M, k=-1))
    pairs = sorted(zip(off_m[first, second].tolist(), first.tolist(), second.tolist(), strict=True))
    owner = list(range(len(groups)))
    merged = dict(enumerate(groups))
    for _, i, j in pairs:
        a, b = owner[i], owner[j]
        if a != b and _are_one(sight, merged[a], merged[b]):
            merged[b] = merged[b] + merged.pop(a)
            owner = [b if each == a else each for each in owner]
    return list(merged.values())


def _part(posteriors: Posteriors, group: Group) -> list[Group]:
    """Return two views apart that speak of far places, and of a common one no more than by chance.

    Of more than two each was held against the others when they were swept.
    """
    sight = posteriors.sight
    if len(group) != 2 or min(measure_agreement(sight, group)) >= 1.0:
        return [group]
    alone = [group[:1], group[1:]]
    off_m = math.dist(*(find_middle(sight, posteriors.of(each)) for each in alone))
    return alone if off_m > NEAR_M else [group]


def _are_one(sight: SightMap, some: Group, others: Group) -> bool:
    if not all(_fits(each, iter(others)) for each in some):
        return False
    apart = log_evidence(sight, some) + log_evidence(sight, others) + np.log(_THINGS_PER_CELL)
    return bool(log_evidence(sight, some + others) > apart)
