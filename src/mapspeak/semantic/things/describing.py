"""Puts what is known of one thing into words and numbers."""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from mapspeak.geometry import Point
from mapspeak.semantic.things.placing import Placement
from mapspeak.semantic.things.sighting import Sighting
from mapspeak.semantic.things.thing import Category, Thing, View
from mapspeak.semantic.waypoint import name_key

__all__ = ["LEAST_AGREEMENT", "describe_group"]

LEAST_AGREEMENT = 2.0
"""A view that is less than so much likelier than by chance, given the others, places nothing."""

_BEST_ODDS = 1e6
"""However many views agree: they may all be of a map that is wrong."""
_SAME_PLACE_M = 0.3
"""Views from nearer to each other share their mistakes and count once."""


def describe_group(
    group: Sequence[Sighting],
    placement: Placement | None,
    *,
    agreements: Sequence[float],
    conflicting: Iterable[Sighting],
) -> Thing:
    """Gives the thing that a group of views has seen.

    Args:
        group: The views of it.
        placement: Where it is; None where no view says.
        agreements: How well each view goes with the others; 1 is chance.
        conflicting: Views that say it is elsewhere.
    """
    ordered = sorted(group, key=lambda each: name_key(each.waypoint.name))
    labels = _by_votes(each.landmark.label for each in ordered)
    position = placement.position if placement else None
    return Thing(
        label=labels[0],
        other_labels=tuple(labels[1:]),
        category=Category(_by_votes(each.category.value for each in ordered)[0]),
        purposes=tuple(_by_votes(filter(None, (each.landmark.purpose for each in ordered)))),
        position=position,
        uncertainty_m=placement.uncertainty_m if placement else None,
        supporting=tuple(_view(each, _say_support(each, position)) for each in ordered),
        conflicting=tuple(_view(each, _say_conflict(each, position)) for each in conflicting),
        confidence_ratio=_confidence(group, agreements),
        n_agreeing=_count_agreeing(group, agreements),
        whereabouts=placement.whereabouts if placement else None,
    )


def _by_votes(words: Iterable[str]) -> list[str]:
    """Gives each once, what was said most often first, then the longer."""
    counts = Counter(words)
    return sorted(counts, key=lambda word: (-counts[word], -len(word), word))


def _view(sighting: Sighting, why: str) -> View:
    return View(
        waypoint=sighting.waypoint.name,
        landmark=sighting.landmark,
        place=sighting.waypoint.pose.point,
        why=why,
    )


def _say_support(sighting: Sighting, position: Point | None) -> str:
    landmark = sighting.landmark
    if position is None or landmark.bearing_rad is None:
        return "names it, without a direction"
    far_m = sighting.waypoint.pose.point.distance_to(position)
    told = "" if landmark.range_m is None else f", told as {landmark.range_m:.1f} m"
    return f"saw it {far_m:.1f} m away{told}, {_off_deg(sighting, position):.0f} deg off"


def _say_conflict(sighting: Sighting, position: Point | None) -> str:
    assert position is not None, "only a place can be contradicted"  # noqa: S101 - our belief
    return f"has it in plain sight, but points {_off_deg(sighting, position):.0f} deg past it"


def _off_deg(sighting: Sighting, position: Point) -> float:
    pose = sighting.waypoint.pose
    ahead = pose.yaw_rad + (sighting.landmark.bearing_rad or 0.0)
    off_rad = math.remainder(pose.point.bearing_to(position) - ahead, math.tau)
    return abs(math.degrees(off_rad))


def _confidence(group: Sequence[Sighting], agreements: Sequence[float]) -> float:
    """Gives how likely it is that not all views are wrong: the odds of each, multiplied.

    The first view may be wrong in any way; a further one must be wrong and agree by chance.
    """
    odds = 1.0
    for i, (each, agreement) in enumerate(_from_different_places(group, agreements)):
        odds *= (1 - each.wrong_ratio) / each.wrong_ratio * (agreement if i else 1.0)
    odds = min(odds, _BEST_ODDS)
    return odds / (1 + odds)


def _count_agreeing(group: Sequence[Sighting], agreements: Sequence[float]) -> int:
    agreeing = [
        agreement >= LEAST_AGREEMENT for _, agreement in _from_different_places(group, agreements)
    ]
    return sum(agreeing)


def _from_different_places(
    group: Sequence[Sighting], agreements: Sequence[float]
) -> Iterator[tuple[Sighting, float]]:
    """Gives the first view from each place, with its agreement."""
    places = list[Point]()
    for each, agreement in zip(group, agreements, strict=True):
        here = each.waypoint.pose.point
        if all(here.distance_to(other) >= _SAME_PLACE_M for other in places):
            places.append(here)
            yield each, agreement
