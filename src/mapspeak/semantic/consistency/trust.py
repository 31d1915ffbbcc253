"""How far a remembered thing may be trusted, and why."""

from collections.abc import Iterable
from dataclasses import dataclass

from mapspeak.semantic.consistency.findings import Finding
from mapspeak.semantic.quoting import quote_name
from mapspeak.semantic.things import Thing

__all__ = ["Trust", "judge_trust"]


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
