"""Findings about doubtful records. A finding lowers trust; it never removes anything."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum

from mapspeak.geometry import Point
from mapspeak.memory.things.labels import find_half_life_s
from mapspeak.memory.things.thing import Thing, View


class FindingKind(StrEnum):
    """Kinds of findings."""

    OTHER_MAP = "other_map"
    OFF_MAP = "off_map"
    IN_OBSTACLE = "in_obstacle"
    IN_UNKNOWN = "in_unknown"
    UNREACHABLE = "unreachable"
    BEHIND_WALL = "behind_wall"
    THROUGH_UNKNOWN = "through_unknown"
    WRONG_ROOM = "wrong_room"
    DUPLICATE = "duplicate"
    NOT_SEEN = "not_seen"
    MOVED = "moved"
    AGED = "aged"
    POINTS_PAST = "points_past"
    TWO_LABELS = "two_labels"


WEIGHTS = {
    FindingKind.OTHER_MAP: 0.3,
    FindingKind.OFF_MAP: 0.2,
    FindingKind.IN_OBSTACLE: 0.5,
    FindingKind.IN_UNKNOWN: 0.7,
    FindingKind.UNREACHABLE: 0.7,
    FindingKind.BEHIND_WALL: 0.4,
    FindingKind.THROUGH_UNKNOWN: 0.7,
    FindingKind.WRONG_ROOM: 0.6,
    FindingKind.DUPLICATE: 1.0,
    FindingKind.NOT_SEEN: 0.7,
    FindingKind.MOVED: 1.0,
    FindingKind.AGED: 0.9,
    FindingKind.POINTS_PAST: 0.5,
    FindingKind.TWO_LABELS: 0.02,
}
"""Factors on the odds of a thing. Observers need not name all that they see, so "not seen" says
little; two views of one place are not a fault, so a duplicate says nothing. Of two labels in one
place that are never named together, both are right one time in fifty; the loss of either depends
on how well the other is seen."""


SEEN_ODDS = 24.0
"""Highest odds that a thing is still where it was last seen, once a later look missed it."""
MISSED_RATIO = 0.2
"""Observers miss about one thing in five of those that a look shows."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MemoryFinding:
    """A doubt about something remembered.

    Attributes:
        view: The view of the concerned thing that points past it.
        ids: Of the maps: the record's and the robot's. Of the rooms: the one that a record names
            or a thing lies in, and the one that it is seen from.
        radius_m: Of the robot that cannot get there.
        told_m: The recorded distance of the landmark.
        open_m: Length of the free part of the line to the landmark.
        n_since: How many looks later than the last one that saw the thing it stands for.
        shown_ratio: How likely such a look shows it where it is still there.
        age_s: How long ago the thing was last seen.
        half_life_s: Half of such things stand elsewhere after so long.
    """

    kind: FindingKind
    waypoints: tuple[str, ...]
    label: str | None = None
    things: tuple[Thing, ...] = ()
    view: View | None = None
    ids: tuple[str, str] | None = None
    at: Point | None = None
    radius_m: float | None = None
    far_m: float | None = None
    told_m: float | None = None
    open_m: float | None = None
    n_since: int = 0
    shown_ratio: float = 1.0
    age_s: float = 0.0
    half_life_s: float = math.inf

    @property
    def stayed_ratio(self) -> float:
        """How likely a thing of such an age still stands where it was seen."""
        return float(0.5 ** (self.age_s / self.half_life_s))

    @property
    def weight(self) -> float:
        """The largest factor on the odds of a thing that it concerns."""
        return WEIGHTS[self.kind]

    def weight_for(self, thing: Thing) -> float:
        """Return the factor on the odds of one of the things that it concerns.

        A look that shows it with probability s and misses a share m of what it shows fails to name
        it with 1 - s (1 - m) where it is there, and surely where it is not (Bayes).
        Two labels in one place are hardly both right, so each becomes less likely the likelier
        the other is. Few views against many change little.
        """
        weight = self.weight
        if self.n_since:
            return float((1 - self.shown_ratio * (1 - MISSED_RATIO)) ** self.n_since)
        if self.kind is not FindingKind.TWO_LABELS:
            return weight
        product = 1.0
        for rival in self.things:
            if rival is not thing and rival != thing:
                odds = rival.confidence_ratio / (1 - rival.confidence_ratio)
                product *= (1 + weight * odds) / (1 + odds)
        return product


@dataclass(frozen=True, slots=True)
class Trust:
    """Degree of trust.

    Attributes:
        stayed_ratio: The part of it that is left since the thing was last seen.
    """

    ratio: float
    findings: tuple[MemoryFinding, ...]
    thing: Thing | None = None
    stayed_ratio: float = 1.0


def judge_trust(
    thing: Thing, findings: Iterable[MemoryFinding], *, now: datetime | None = None
) -> Trust:
    """Return the trust that a thing deserves by its views, its age, and findings of its memory.

    A finding about one of several places that have seen it counts by its share of them. That it
    is still there is less likely the older its last sight is; looks that miss it come after that.
    """
    odds = thing.confidence_ratio / (1 - thing.confidence_ratio)
    against, missed = [], []
    for finding in findings:
        share = _share(thing, finding)
        if share and finding.n_since:
            missed.append(finding)
        elif share and finding.weight < 1.0:
            odds *= finding.weight_for(thing) ** share
        elif finding.kind is not FindingKind.MOVED or not share:
            continue
        against.append(finding)
    odds = min(odds, SEEN_ODDS) if missed else odds
    aged = _find_aged(thing, now)
    stayed_ratio = 1.0 if aged is None else aged.stayed_ratio
    ratio = odds / (1 + odds) * stayed_ratio
    odds = ratio / (1 - ratio) * math.prod(each.weight_for(thing) for each in missed)
    if aged is not None and stayed_ratio < WEIGHTS[FindingKind.AGED]:
        against.append(aged)
    return Trust(odds / (1 + odds), tuple(against), thing, stayed_ratio)


def _find_aged(thing: Thing, now: datetime | None) -> MemoryFinding | None:
    if thing.last_seen is None or now is None:
        return None
    return MemoryFinding(
        kind=FindingKind.AGED,
        waypoints=thing.waypoints[:1],
        things=(thing,),
        age_s=max((now - thing.last_seen).total_seconds(), 0.0),
        half_life_s=find_half_life_s(thing.label),
    )


def _share(thing: Thing, finding: MemoryFinding) -> float:
    if finding.things:
        return float(thing in finding.things)
    views = [
        finding.label is None or view.landmark.label == finding.label
        for view in thing.supporting
        if view.waypoint in finding.waypoints
    ]
    return sum(views) / len(thing.supporting)
