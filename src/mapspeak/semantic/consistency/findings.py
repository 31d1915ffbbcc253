"""What may be odd about a record. A finding lowers trust; it never takes anything away."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from mapspeak.semantic.quoting import quote_name
from mapspeak.semantic.things import Thing


class FindingKind(StrEnum):
    """What is odd."""

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
"""What the odds of a thing are multiplied by. Nobody has to name all that is to be seen, so that
"not seen" says little; two views of one place are no fault, so that a duplicate says nothing.
Of two labels in one place that nobody names together, both are right one time in fifty; how much
either loses depends on how well the other is seen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """Something odd about what is remembered.

    Attributes:
        kind: What is odd.
        sentence: The same in words with numbers.
        waypoints: The names of the places concerned.
        label: Of the one landmark concerned; None where it is the whole place.
        things: The things concerned, whatever their views.
    """

    kind: FindingKind
    sentence: str
    waypoints: tuple[str, ...]
    label: str | None = None
    things: tuple[Thing, ...] = ()

    @property
    def weight(self) -> float:
        """What the odds of a thing that it concerns are multiplied by, at the most."""
        return WEIGHTS[self.kind]

    def weight_for(self, thing: Thing) -> float:
        """What the odds of one of the things that it concerns are multiplied by.

        Two labels in one place hardly are both right, so that each is as much less likely as the
        other is likely. Few views against many change little.
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
    """How far something may be trusted.

    Attributes:
        ratio: From 0 to 1.
        reasons: In words: who speaks for it, then what speaks against it.
    """

    ratio: float
    reasons: tuple[str, ...]


def judge_trust(thing: Thing, findings: Iterable[Finding]) -> Trust:
    """Gives the trust that a thing deserves by its views and all findings of its memory.

    A finding about one of several places that have seen it counts by its share of them.
    """
    odds = thing.confidence_ratio / (1 - thing.confidence_ratio)
    reasons = [_say_views(thing)]
    for finding in findings:
        share = _share(thing, finding)
        if share and finding.weight < 1.0:
            odds *= finding.weight_for(thing) ** share
            reasons.append(finding.sentence)
    return Trust(odds / (1 + odds), tuple(reasons))


def _share(thing: Thing, finding: Finding) -> float:
    """Gives what share of a thing a finding concerns."""
    if finding.things:
        return float(thing in finding.things)
    views = [
        finding.label is None or view.landmark.label == finding.label
        for view in thing.supporting
        if view.waypoint in finding.waypoints
    ]
    return sum(views) / len(thing.supporting)


def _say_views(thing: Thing) -> str:
    names = ", ".join(map(quote_name, thing.waypoints))
    n_views = len(thing.supporting)
    views = "" if n_views == len(thing.waypoints) else f" in {n_views} views"
    return f"Seen from {len(thing.waypoints)}{views}: {names}."
