"""The rigid motion that lays an old map on a new one, with the next best one beside it."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.semantic.alignment.agreement import Agreement, judge
from mapspeak.semantic.alignment.guessing import guess_transforms
from mapspeak.semantic.alignment.refining import refine
from mapspeak.semantic.alignment.surfaces import MapSurfaces

__all__ = ["Certainty", "MapFit", "find_fit"]

LEAST_AGREEMENT = 0.88
"""Other buildings reach .98 where they share a wall or two, and .83 where they share more."""
LEAST_OVERLAP = 0.35
LEAST_SHARED_M = 25.0
"""A room alone has as much wall, and rooms are alike."""
SURE_AGREEMENT, SURE_OVERLAP = 0.9, 0.5

RIVAL_EVIDENCE = 0.8
"""Another place for which so much of the evidence speaks could be meant as well."""
RIVAL_AGREEMENT, RIVAL_AGREEING_EVIDENCE = 0.05, 0.4
"""Likewise one that agrees as well as the best within the first, with less in common."""
SAME_M, SAME_RAD = 0.5, math.radians(5.0)


class Certainty(StrEnum):
    """How sure it is that a map was laid in the right place."""

    SURE = "sure"
    LIKELY = "likely"
    AMBIGUOUS = "ambiguous"
    UNSURE = "unsure"


@dataclass(frozen=True, slots=True, kw_only=True)
class MapFit:
    """Where an old map lies on a new one.

    Attributes:
        new_from_old: The transform from the old map's frame to the new one's.
        quality: How well the maps agree when it is laid so.
        rival: How well they agree in the next best place; None where there is no other.
        certainty: What follows from both.
        off_m: How far the middle of the old map's walls moves.
    """

    new_from_old: Pose
    quality: Agreement
    rival: Agreement | None
    certainty: Certainty
    off_m: float

    @property
    def is_sure_enough(self) -> bool:
        """True when poses may be moved by it."""
        return self.certainty in (Certainty.SURE, Certainty.LIKELY)

    @property
    def sentence(self) -> str:
        """The fit in words, with its figures."""
        turn = f"turned by {math.degrees(self.new_from_old.yaw_rad):.1f} degrees"
        said = (
            f"Laid on the new map {turn} and shifted so that its middle moves {self.off_m:.2f} m, "
            f"{_say(self.quality)}"
        )
        if self.rival is None:
            return f"{said}; no other place comes near. {_REASONS[self.certainty]}"
        return f"{said}; in the next best place, {_say(self.rival)}. {_REASONS[self.certainty]}"


_REASONS = {
    Certainty.SURE: "This is sure.",
    Certainty.LIKELY: "This is likely right.",
    Certainty.AMBIGUOUS: "The building looks alike in both places: which one is right cannot be "
    "told from its walls.",
    Certainty.UNSURE: "This is not enough to rely on.",
}


def find_fit(old: MapSurfaces, new: MapSurfaces) -> MapFit | None:
    """Finds where an old map lies on a new one; None where nothing can be laid on anything."""
    refined = (refine(old, new, guess) for guess in guess_transforms(old, new))
    judged = [(transform, judge(old, new, transform)) for transform in refined]
    if not judged:
        return None
    judged.sort(key=lambda each: -each[1].evidence_m)
    best, quality = judged[0]
    middle = Point(*((old.points.min(axis=0) + old.points.max(axis=0)) / 2).tolist())
    others = [each for transform, each in judged[1:] if not _is_same_place(transform, best, middle)]
    rival = _strongest(others, quality)
    return MapFit(
        new_from_old=best,
        quality=quality,
        rival=rival,
        certainty=_certainty_of(quality, rival),
        off_m=middle.distance_to(best.transform(middle)),
    )


def _strongest(others: Iterable[Agreement], best: Agreement) -> Agreement | None:
    """Gives what competes most with the best place."""
    return max(others, key=lambda each: (_is_rival(each, best), each.evidence_m), default=None)


def _is_rival(other: Agreement, best: Agreement) -> bool:
    evidence_ratio = other.evidence_m / best.evidence_m if best.evidence_m > 0 else math.inf
    agrees_as_well = other.agreement_ratio >= best.agreement_ratio - RIVAL_AGREEMENT
    return evidence_ratio >= (RIVAL_AGREEING_EVIDENCE if agrees_as_well else RIVAL_EVIDENCE)


def _certainty_of(quality: Agreement, rival: Agreement | None) -> Certainty:
    if not (
        quality.agreement_ratio >= LEAST_AGREEMENT
        and quality.overlap_ratio >= LEAST_OVERLAP
        and quality.shared_m >= LEAST_SHARED_M
    ):
        return Certainty.UNSURE
    if rival is not None and _is_rival(rival, quality):
        return Certainty.AMBIGUOUS
    is_sure = quality.agreement_ratio >= SURE_AGREEMENT and quality.overlap_ratio >= SURE_OVERLAP
    return Certainty.SURE if is_sure else Certainty.LIKELY


def _is_same_place(one: Pose, other: Pose, middle: Point) -> bool:
    turned = abs(wrap_angle(one.yaw_rad - other.yaw_rad))
    return turned < SAME_RAD and one.transform(middle).distance_to(other.transform(middle)) < SAME_M


def _say(quality: Agreement) -> str:
    return (
        f"{quality.agreement_ratio:.0%} of the walls agree, of {quality.shared_m:.0f} m that both "
        f"maps show ({quality.overlap_ratio:.0%} of the smaller map)"
    )
