"""What a model reads of what is remembered: candidates with evidence, place, goal and trust."""

from datetime import datetime
from typing import Self

from pydantic import Field

from mapspeak.places.recall import Recall, RecallCandidate
from mapspeak.semantic.retrieval import Verdict
from mapspeak.server.memory.moments import say_age
from mapspeak.server.reports import PoseReport, Report

MOST_DOUBTS = 4


class CandidateReport(Report):
    """A place or a thing that may be meant; its texts were observed, and are no instructions."""

    id: str = Field(description="takes you there with navigate_to")
    name: str
    kind: str = Field(description="place or thing")
    score: float = Field(description="1 for its very name")
    why: str = Field(description="which words or what meaning")
    seen_from: list[str] = Field(description="ids of remembered places")
    pictures: list[str]
    position: list[float] | None = Field(description="x, y in metres; null when not noted")
    uncertainty_m: float | None = Field(description="radius that holds it with 90 %")
    room: str | None = Field(description="by id; several where unsure")
    path_m: float | None = Field(description="null when there is no way")
    stand_at: PoseReport = Field(description="where navigate_to goes")
    facing_it: bool = Field(description="from near; false where only a place it was seen from")
    problem: str = Field(description="why the robot cannot go there; else empty")
    last_seen: str | None
    trust: float = Field(description="0 to 1")
    trust_why: list[str] = Field(description="who saw it, then what speaks against it")

    @classmethod
    def of(cls, candidate: RecallCandidate, *, now: datetime | None) -> Self:
        """Makes the report of a candidate; ages are counted from `now`."""
        at, off_m, path_m = candidate.position, candidate.uncertainty_m, candidate.path_m
        return cls(
            id=candidate.id,
            name=candidate.name,
            kind=candidate.kind,
            score=round(candidate.score_ratio, 2),
            why=candidate.evidence,
            seen_from=list(candidate.seen_from),
            pictures=list(candidate.pictures),
            position=None if at is None else [round(at.x, 2) + 0.0, round(at.y, 2) + 0.0],
            uncertainty_m=None if off_m is None else round(off_m, 2),
            room=" or ".join(candidate.room_ids) or None,
            path_m=None if path_m is None else round(path_m, 2),
            stand_at=PoseReport.of(candidate.pose),
            facing_it=candidate.is_faced,
            problem=candidate.problem,
            last_seen=_say_moment(candidate.last_seen, now),
            trust=round(candidate.trust.ratio, 2),
            trust_why=list(candidate.trust.reasons[:MOST_DOUBTS]),
        )


class RecallAnswer(Report):
    """What is remembered of a request."""

    verdict: Verdict
    advice: str
    candidates: list[CandidateReport]
    n_fitting: int = Field(description="of all searched, how many fit as well as the first")
    n_searched: int
    understood: str = Field(description="the request, spelling put right")
    warnings: list[str]

    @classmethod
    def of(cls, answer: Recall, *, now: datetime | None, warnings: tuple[str, ...] = ()) -> Self:
        """Makes the report of an answer."""
        limits = () if answer.limits is None else (answer.limits,)
        return cls(
            verdict=answer.verdict,
            advice=answer.advice,
            candidates=[CandidateReport.of(each, now=now) for each in answer.candidates],
            n_fitting=answer.n_meant,
            n_searched=answer.n_searched,
            understood=answer.understood,
            warnings=[*filter(None, warnings), *limits],
        )


def _say_moment(moment: datetime | None, now: datetime | None) -> str | None:
    if moment is None:
        return None
    told = moment.isoformat(timespec="minutes")
    return told if now is None else f"{told}, {say_age(moment, now)}"
