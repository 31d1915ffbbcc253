"""Guards for tests: with a wall clock that stands where a test puts it, and files in a folder."""

import itertools
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from mapspeak.geometry import Point
from mapspeak.safety import (
    Approvals,
    AreaRule,
    AuditLine,
    AuditLog,
    Guard,
    Hold,
    Policy,
    WaitingRoom,
    read_audit,
)

MONDAY_NOON = datetime(2026, 11, 23, 12, 0, tzinfo=UTC)


class WallClock:
    """Gives the time that a test set."""

    def __init__(self, now: datetime = MONDAY_NOON) -> None:
        self.now = now

    def __call__(self) -> datetime:
        return self.now


def make_guard(
    folder: Path, policy: Policy | None = None, *, clock: WallClock | None = None
) -> Guard:
    """Gives a guard with its log, its hold and its waiting room in a folder."""
    clock = clock or WallClock()
    ticks = itertools.count()
    return Guard(
        policy=policy or Policy(),
        audit=AuditLog(folder / "audit.jsonl", wall_clock=clock),
        hold=Hold(folder / "control"),
        approvals=Approvals(
            WaitingRoom(folder / "control" / "approvals"), lambda: next(ticks) / 1e3
        ),
        wall_clock=clock,
    )


def rectangle(name: str, low: tuple[float, float], high: tuple[float, float]) -> AreaRule:
    """Gives the rule that always closes a rectangle."""
    return AreaRule(name=name, outline=corners(low, high))


def corners(low: tuple[float, float], high: tuple[float, float]) -> tuple[Point, ...]:
    """Gives the outline of a rectangle."""
    (left, bottom), (right, top) = low, high
    return (Point(left, bottom), Point(right, bottom), Point(right, top), Point(left, top))


def audit_of(folder: Path) -> Sequence[AuditLine]:
    """Gives what the guard in a folder has noted."""
    path = folder / "audit.jsonl"
    return list(read_audit(path)) if path.exists() else []
