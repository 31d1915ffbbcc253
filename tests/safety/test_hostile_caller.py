"""How the long benchmark judges what a hostile caller got done."""

import pytest

from benchmarks.safety import find_busiest_minute
from mapspeak.safety import AuditLine
from mapspeak.safety.commands import CommandKind
from mapspeak.safety.guard import RateLog


def line(robot_s: float, *, verdict: str = "allowed") -> AuditLine:
    return AuditLine(
        number=1,
        run="a",
        robot="",
        wall_time="",
        robot_s=robot_s,
        event="decision",
        client="",
        tool="",
        kind="drive",
        what="",
        verdict=verdict,
        said="",
        details={},
    )


@pytest.mark.parametrize("first_s", [0.0, 4.1, 90.2, 844.4])
def test_drives_a_minute_apart_are_not_within_a_minute(first_s: float) -> None:
    assert find_busiest_minute([line(first_s), line(round(first_s + 60.0, 3))]) == 1
    assert find_busiest_minute([line(first_s), line(round(first_s + 59.95, 3))]) == 2


def test_what_was_refused_is_no_drive() -> None:
    assert find_busiest_minute([line(1.0), line(2.0, verdict="refused")]) == 1
    assert find_busiest_minute([]) == 0


def test_judge_and_guard_agree_on_every_tick_of_a_simulated_clock() -> None:
    for n_ticks in range(2_000):
        first_s, then_s = n_ticks * 0.05, (n_ticks + 1200) * 0.05
        rates = RateLog()
        rates.note(CommandKind.DRIVE, first_s)
        judged = find_busiest_minute([line(round(first_s, 3)), line(round(then_s, 3))])
        assert judged <= rates.count(CommandKind.DRIVE, then_s) + 1
