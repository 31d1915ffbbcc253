"""What can be asked of the memory, and what comes back."""

from dataclasses import dataclass
from datetime import datetime

from mapspeak.geometry import Point, Pose
from mapspeak.semantic.consistency import Trust
from mapspeak.semantic.retrieval import EntryKind, Verdict

__all__ = ["Recall", "RecallCandidate", "RecallQuery"]

NEAR_M = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RecallQuery:
    """What is looked for among what passes every filter that is given.

    Attributes:
        words: What people say: a name, a thing, what it is for, what is the matter.
        near: Not farther than `near_m` from this point of the map frame.
        near_m: How near, straight.
        room_id: In this room or corridor.
        since: Last seen at this moment or later.
        until: Last seen before.
        kind: Only places, or only things.
        n: How many candidates, at most.
    """

    words: str
    near: Point | None = None
    near_m: float = NEAR_M
    room_id: str | None = None
    since: datetime | None = None
    until: datetime | None = None
    kind: EntryKind | None = None
    n: int = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class RecallCandidate:
    """A place or a thing that may be meant.

    Attributes:
        id: "T1" or "W1": a goal for the robot.
        kind: A place or a thing.
        name: What it is called in the memory.
        score_ratio: How alike it and the request are; 1 for its very name.
        evidence: Why it is here, in words.
        seen_from: Ids of the places that it was seen from; of a place, its own.
        pictures: That it was seen in, by their relative names.
        position: Where it is; None where nobody noted a direction.
        uncertainty_m: The radius around that which holds it with 90 %; None without a position,
            and for a place.
        room_ids: The rooms it may be in.
        pose: Where the robot would stand: of a thing, near it and facing it where it can.
        is_faced: True when it would stand near it and face it.
        faced_ratio: The share of where a thing may be that it would face there.
        problem: Why the robot cannot drive there; empty where it can.
        path_m: The way there; None where there is none.
        last_seen: By the calendar; None where nobody noted it.
        trust: How far to trust it, and why.
    """

    id: str
    kind: EntryKind
    name: str
    score_ratio: float
    evidence: str
    seen_from: tuple[str, ...]
    pictures: tuple[str, ...]
    position: Point | None
    uncertainty_m: float | None
    room_ids: tuple[str, ...]
    pose: Pose
    is_faced: bool
    faced_ratio: float
    problem: str
    path_m: float | None
    last_seen: datetime | None
    trust: Trust


@dataclass(frozen=True, slots=True, kw_only=True)
class Recall:
    """What is remembered of a request.

    Attributes:
        verdict: How far the first candidate may be taken for what is meant.
        advice: The same in words, with what to do next.
        candidates: The likeliest first; of equally likely ones the nearest by path. Where nothing
            is remembered they are the nearest in meaning, and probably none is meant.
        n_meant: How many, of all that passes the filters, fit as well as the first.
        n_searched: How many places and things pass the filters.
        understood: The request with misspelt words put right.
        limits: What the search could not do, in words; None where nothing was missing.
    """

    verdict: Verdict
    advice: str
    candidates: tuple[RecallCandidate, ...]
    n_meant: int
    n_searched: int
    understood: str
    limits: str | None
