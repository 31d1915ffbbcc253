"""Half way between two things: straight where they see each other, else along the way."""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from mapspeak.geometry import Point
from mapspeak.places.relations.footing import find_footing, is_in_sight
from mapspeak.places.relations.referent import Referent
from mapspeak.places.relations.stand import Stand, refuse
from mapspeak.spatial.paths import Path
from mapspeak.spatial.rooms import Region
from mapspeak.worldmodel.model import Atlas

__all__ = ["stand_between"]

LEAST_GAP_M = 0.5
SHARE = (0.3, 0.7)
"""What is between two things is in this part of the way from one to the other."""
ASIDE_RATIO = 0.25
STEP_OFF_M = 1.0
"""So far off a thing itself, or off the middle of a way, the robot may have to stand."""


@dataclass(frozen=True, slots=True)
class Span:
    """Two things and the line between them."""

    one: Referent
    other: Referent

    @property
    def length_m(self) -> float:
        """From middle to middle."""
        return self.one.anchor.distance_to(self.other.anchor)

    @property
    def middle(self) -> Point:
        """Half way as the crow flies."""
        one, other = self.one.anchor, self.other.anchor
        return Point((one.x + other.x) / 2, (one.y + other.y) / 2)

    @property
    def name(self) -> str:
        """Such as "D1 and D2"."""
        return f"{self.one.name} and {self.other.name}"


def stand_between(atlas: Atlas, one: Referent, other: Referent) -> Stand:
    """Finds where to stand half way between two things.

    Raises:
        GoalError: They are one, too near to each other, or no way leads from one to the other.
    """
    span = Span(one, other)
    if one.region is not None and other.region is not None:
        stand = _stand_in_door(atlas, one.region, other.region)
        if stand is not None:
            return stand
    if span.length_m < LEAST_GAP_M:
        raise refuse(
            f"{span.name} are only {span.length_m:.1f} m apart: nothing is between them.",
            [f"next to {one.name}"],
        )
    point = one.anchor
    sees = bool(is_in_sight(atlas, np.array([[point.x, point.y]]), other.anchor)[0])
    stand = _stand_straight(atlas, span) if sees else _stand_on_way(atlas, span)
    if stand is None:
        raise refuse(
            f"The robot can stand nowhere half way between {span.name}.",
            [f"next to {one.name}", f"next to {other.name}"],
        )
    return stand


def _stand_in_door(atlas: Atlas, one: Region, other: Region) -> Stand | None:
    """Gives the nearest door that joins two regions; two that are one have none."""
    crossings = [
        (atlas.path_m(crossing) or 0.0, door.id, crossing)
        for door in atlas.rooms.doors_between(one.id, other.id)
        if (crossing := atlas.find_crossing(door)) is not None
    ]
    if not crossings:
        return None
    _, door_id, point = min(crossings, key=lambda each: each[:2])
    return Stand(point=point, reason=f"in {door_id}, the door between {one.id} and {other.id}")


def _stand_straight(atlas: Atlas, span: Span) -> Stand | None:
    footing = find_footing(atlas, span.middle, span.length_m / 2)
    heading_rad = span.one.anchor.bearing_to(span.other.anchor)
    share = footing.along_m(span.one.anchor, heading_rad) / span.length_m
    aside_m = np.abs(footing.along_m(span.one.anchor, heading_rad + math.pi / 2))
    allowed = (share >= SHARE[0]) & (share <= SHARE[1])
    allowed &= aside_m <= ASIDE_RATIO * span.length_m
    costs = footing.away_m(span.middle)
    point = footing.choose(atlas, allowed, costs, in_sight_of=span.one.anchor)
    if point is None:
        return None
    one_m, other_m = (point.distance_to(end.anchor) for end in (span.one, span.other))
    reason = f"between {span.name}, {one_m:.1f} m from one and {other_m:.1f} m from the other"
    return Stand(point=point, reason=reason)


def _stand_on_way(atlas: Atlas, span: Span) -> Stand | None:
    begin, end = (_step_off(atlas, thing.anchor) for thing in (span.one, span.other))
    if begin is None or end is None:
        return None
    path = atlas.map.distances_from(begin).path_to(end)
    if path is None:
        return None
    middle = _half_of(path)
    footing = find_footing(atlas, middle, STEP_OFF_M)
    away_m = footing.away_m(middle)
    allowed = away_m <= min(STEP_OFF_M, ASIDE_RATIO * path.length_m)
    point = footing.choose(atlas, allowed, away_m, in_sight_of=middle)
    if point is None:
        return None
    reason = f"half way between {span.name}, on the way of {path.length_m:.1f} m"
    return Stand(point=point, reason=reason)


def _step_off(atlas: Atlas, point: Point) -> Point | None:
    """Gives the nearest place to a thing where the robot can be."""
    footing = find_footing(atlas, point, STEP_OFF_M)
    away_m = footing.away_m(point)
    if not away_m.size or float(away_m.min()) > STEP_OFF_M:
        return None
    x, y = footing.points[int(np.argmin(away_m))].tolist()
    return Point(x, y)


def _half_of(path: Path) -> Point:
    left_m = path.length_m / 2
    for start, end in itertools.pairwise(path.points):
        leg_m = start.distance_to(end)
        if leg_m >= left_m > 0:
            share = left_m / leg_m
            return Point(start.x + share * (end.x - start.x), start.y + share * (end.y - start.y))
        left_m -= leg_m
    return path.points[-1]
