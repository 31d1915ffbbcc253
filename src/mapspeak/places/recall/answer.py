"""What can be asked of the memory, and what comes back, with how far to trust it."""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum

from mapspeak.geometry import Point, Pose
from mapspeak.memory.consistency import Trust
from mapspeak.memory.search import Answer, EntryCandidate, EntryKind, Verdict
from mapspeak.places.goalcheck import GoalCheck

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
        match: How it matches the request; None where nothing was asked.
        away_m: From the point that the request is near to, straight; None where it has none.
        seen_from: Ids of the places that it was seen from; of a place, its own.
        pictures: That it was seen in, by their relative names.
        position: Where it is; None where nobody noted a direction.
        uncertainty_m: The radius around that which holds it with 90 %; None without a position,
            and for a place.
        room_ids: The rooms it may be in.
        pose: Where the robot would stand: of a thing, near it and facing it where it can.
        is_faced: True when it would stand near it and face it.
        faced_ratio: The share of where a thing may be that it would face there.
        check: Whether the robot can drive there, and how far it is.
        last_seen: By the calendar; None where nobody noted it.
        trust: How far to trust it, and why.
    """

    id: str
    kind: EntryKind
    name: str
    score_ratio: float
    match: EntryCandidate | None
    away_m: float | None
    seen_from: tuple[str, ...]
    pictures: tuple[str, ...]
    position: Point | None
    uncertainty_m: float | None
    room_ids: tuple[str, ...]
    pose: Pose
    is_faced: bool
    faced_ratio: float
    check: GoalCheck
    last_seen: datetime | None
    trust: Trust


class RecallDoubt(StrEnum):
    """Why what was found may still be wrong."""

    DOUBTFUL_RECORD = "doubtful_record"
    NOT_NOTED = "not_noted"
    CONTRADICTED = "contradicted"
    FEW_VIEWS = "few_views"
    IMPRECISE = "imprecise"
    OTHER_ROOM = "other_room"
    OUT_OF_SIGHT = "out_of_sight"
    HARDLY_IN_SIGHT = "hardly_in_sight"


@dataclass(frozen=True, slots=True, kw_only=True)
class Recall:
    """What is remembered of a request.

    Attributes:
        query: The request; a room that its words named is a filter.
        answer: What the search found among all that passes the filters.
        candidates: The likeliest first; of equally likely ones the nearest by path. Where nothing
            is remembered they are the nearest in meaning, and probably none is meant.
        n_searched: How many places and things pass the filters.
        is_empty: Nothing is remembered at all.
        doubt: Why the first candidate may still be wrong; None where nothing speaks for that.
    """

    query: RecallQuery
    answer: Answer
    candidates: tuple[RecallCandidate, ...]
    n_searched: int
    is_empty: bool
    doubt: RecallDoubt | None

    @property
    def verdict(self) -> Verdict:
        """How far the first candidate may be taken for what is meant."""
        return Verdict.LIKELY if self.doubt else self.answer.verdict


SURE_RATIO = 0.98
"""A thing that two good views agree on is surer than that, and one view alone is not."""
DOUBTFUL_RATIO = 0.5
LARGEST_OFF_M = 1.2
"""A thing whose place is known no better is not sure to be ahead of who goes there."""
LEAST_FACED_RATIO = 0.3
"""Of where a thing may be, less than that ahead is too little to promise that it will be faced."""


def find_doubt(first: RecallCandidate, *, room_id: str | None) -> RecallDoubt | None:
    """Return why what was found may still be wrong; None where nothing speaks for that.

    Args:
        first: The only one that is meant.
        room_id: Where it was asked for.
    """
    doubts = _doubt_thing(first, room_id) if first.kind is EntryKind.THING else _doubt_place(first)
    return next(doubts, None)


def _doubt_place(first: RecallCandidate) -> Iterator[RecallDoubt]:
    if first.trust.ratio < DOUBTFUL_RATIO:
        yield RecallDoubt.DOUBTFUL_RECORD


def _doubt_thing(first: RecallCandidate, room_id: str | None) -> Iterator[RecallDoubt]:
    if first.position is None or first.uncertainty_m is None:
        yield RecallDoubt.NOT_NOTED
        return
    if first.trust.ratio < DOUBTFUL_RATIO:
        yield RecallDoubt.CONTRADICTED
    if first.trust.ratio < SURE_RATIO:
        yield RecallDoubt.FEW_VIEWS
    if first.uncertainty_m > LARGEST_OFF_M:
        yield RecallDoubt.IMPRECISE
    if room_id is not None and set(first.room_ids) != {room_id}:
        yield RecallDoubt.OTHER_ROOM
    if not first.check.is_ok:
        return
    if not first.is_faced:
        yield RecallDoubt.OUT_OF_SIGHT
    elif first.faced_ratio < LEAST_FACED_RATIO:
        yield RecallDoubt.HARDLY_IN_SIGHT
