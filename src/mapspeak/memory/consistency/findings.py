"""Findings about doubtful records. A finding lowers trust; it never removes anything."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from mapspeak.geometry import Point
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
    FindingKind.POINTS_PAST: 0.5,
    FindingKind.TWO_LABELS: 0.02,
}
"""Factors on the odds of a thing. Observers need not name all that they see, so "not seen" says
little; two views of one place are not a fault, so a duplicate says nothing. Of two labels in one
place that are never named together, both are right one time in fifty; the loss of either depends
on how well the other is seen."""


SEEN_ODDS = 20.0
"""Highest odds that a thing is still where it was last seen, once a later look missed it."""
MISSED_WEIGHT = 0.25
"""Factor on the odds for each such look: observers miss about one thing in five."""


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

    @property
    def weight(self) -> float:
        """The largest factor on the odds of a thing that it concerns."""
        return WEIGHTS[self.kind]

    def weight_for(self, thing: Thing) -> float:
        """Return the factor on the odds of one of the things that it concerns.

        Two labels in one place are hardly both right, so each becomes less likely the likelier
        the other is. Few views against many change little.
        """
        weight = self.weight
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
    """Degree of trust."""

    ratio: float
    findings: tuple[MemoryFinding, ...]
    thing: Thing | None = None


def judge_trust(thing: Thing, findings: Iterable[MemoryFinding]) -> Trust:
    """Return the trust that a thing deserves by its views and all findings of its memory.

    A finding about one of several places that have seen it counts by its share of them.
    """
    odds = thing.confidence_ratio / (1 - thing.confidence_ratio)
    against = []
    for finding in findings:
        share = _share(thing, finding)
        if share and finding.weight < 1.0:
            odds *= 1.0 if finding.n_since else finding.weight_for(thing) ** share
            against.append(finding)
    n_since = sum(finding.n_since for finding in against)
    if n_since:
        odds = min(odds, SEEN_ODDS) * MISSED_WEIGHT**n_since
    return Trust(odds / (1 + odds), tuple(against), thing)


def _share(thing: Thing, finding: MemoryFinding) -> float:
    if finding.things:
        return float(thing in finding.things)
    views = [
        finding.label is None or view.landmark.label == finding.label
        for view in thing.supporting
        if view.waypoint in finding.waypoints
    ]
    return sum(views) / len(thing.supporting)
