"""Counts what was found, with how sure the shares are."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from benchmarks.requests.data import NOTHING, Request
from benchmarks.requests.methods import FIRST, Method, Reply
from mapspeak.memory.search.answer import Verdict

__all__ = ["ABSTRACT", "ALL", "Judged", "Share", "judge", "kinds_of", "shares_of"]

ALL = "all"
ABSTRACT = "abstract"
_ABSTRACT_KINDS = ("synonym", "function", "situation")
_Z = 1.96


@dataclass(frozen=True, slots=True, kw_only=True)
class Share:
    """So many of so many.

    Attributes:
        name: Of what.
        n_true: How many are so.
        n: Of how many.
    """

    name: str
    n_true: int
    n: int

    @property
    def ratio(self) -> float:
        """The share itself."""
        return self.n_true / max(self.n, 1)

    @property
    def interval(self) -> tuple[float, float]:
        """Between which two shares the true one lies, 19 times in 20 (Wilson, 1927)."""
        n = max(self.n, 1)
        middle = self.ratio + _Z**2 / (2 * n)
        half = _Z * math.sqrt(self.ratio * (1 - self.ratio) / n + _Z**2 / (4 * n**2))
        scale = 1 + _Z**2 / n
        return max(0.0, (middle - half) / scale), min(1.0, (middle + half) / scale)


@dataclass(frozen=True, slots=True)
class Judged:
    """A request and the reply to it."""

    request: Request
    reply: Reply

    @property
    def is_first_right(self) -> bool:
        """Whether the first candidate is an answer."""
        return bool(self.request.answers & {*self.reply.ids[:1]})

    @property
    def is_hit(self) -> bool:
        """Whether an answer is among the first candidates."""
        return bool(self.request.answers & {*self.reply.ids[:FIRST]})


def judge(method: Method, requests: Sequence[Request]) -> list[Judged]:
    """Ask for everything."""
    return [Judged(request, method.ask(request)) for request in requests]


def kinds_of(requests: Sequence[Request]) -> list[str]:
    """Return the kinds that have answers, all together and the abstract ones together first."""
    return [ALL, ABSTRACT, *sorted({each.kind for each in requests} - {NOTHING})]


def shares_of(judged: Sequence[Judged], kind: str) -> list[Share]:
    """Return the shares for the requests of a kind that have an answer."""
    own = [each for each in judged if _is_of(each.request.kind, kind)]
    shares = [
        _share("first is right", own, lambda each: each.is_first_right),
        _share(f"in first {FIRST}", own, lambda each: each.is_hit),
    ]
    return shares if own[0].reply.verdict is None else [*shares, *_verdicts(judged, own)]


def _verdicts(judged: Sequence[Judged], own: Sequence[Judged]) -> list[Share]:
    nothing = [each for each in judged if each.request.kind == NOTHING]
    sure = [each for each in own if each.reply.verdict is Verdict.FOUND]
    return [
        _share(
            f"in first {FIRST} and not called unremembered",
            own,
            lambda each: each.is_hit and each.reply.verdict is not Verdict.NOT_REMEMBERED,
        ),
        _share("called found", own, lambda each: each.reply.verdict is Verdict.FOUND),
        _share("right when called found", sure, lambda each: each.is_first_right),
        _share(
            "called unremembered, wrongly",
            own,
            lambda each: each.reply.verdict is Verdict.NOT_REMEMBERED,
        ),
        _share(
            "called unremembered, rightly (kind nothing)",
            nothing,
            lambda each: each.reply.verdict is Verdict.NOT_REMEMBERED,
        ),
        _share(
            "called found, wrongly (kind nothing)",
            nothing,
            lambda each: each.reply.verdict is Verdict.FOUND,
        ),
        _share(
            "called found, wrongly (with kind nothing)",
            [*own, *nothing],
            lambda each: each.reply.verdict is Verdict.FOUND and not each.is_first_right,
        ),
    ]


def _is_of(kind: str, wanted: str) -> bool:
    if wanted == ALL:
        return kind != NOTHING
    return kind in _ABSTRACT_KINDS if wanted == ABSTRACT else kind == wanted


def _share(name: str, own: Sequence[Judged], is_so: Callable[[Judged], bool]) -> Share:
    return Share(name=name, n_true=sum(map(is_so, own)), n=len(own))
