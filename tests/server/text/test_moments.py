"""Moments as models write them."""

import re
from datetime import UTC, datetime, timedelta, timezone

import pytest

from mapspeak.errors import SemanticMapError
from mapspeak.server.text.moments import AHEAD, PAST, read_moment, read_past

NOW = datetime(2026, 11, 23, 12, 0, tzinfo=UTC)


@pytest.mark.parametrize("written", re.split(r", | or ", AHEAD))
def test_what_the_schema_of_an_event_names_is_read(written: str) -> None:
    assert read_moment(written, NOW) is not None


@pytest.mark.usefixtures("central_european_time")
@pytest.mark.parametrize(
    ("written", "at_utc"),
    [
        ("2026-07-01T08:00", datetime(2026, 7, 1, 6, 0, tzinfo=UTC)),
        ("tomorrow 8:00", datetime(2026, 3, 29, 6, 0, tzinfo=UTC)),
        ("7:00", datetime(2026, 3, 29, 5, 0, tzinfo=UTC)),
        ("in 24h", datetime(2026, 3, 29, 11, 0, tzinfo=UTC)),
    ],
)
def test_a_time_after_a_change_to_summer_time_is_that_of_the_wall(
    written: str, at_utc: datetime
) -> None:
    saturday = datetime(2026, 3, 28, 12, 0, tzinfo=timezone(timedelta(hours=1)))
    assert read_moment(written, saturday) == at_utc


@pytest.mark.parametrize("written", re.split(r", | or ", PAST))
def test_what_the_schema_of_a_search_names_is_read_as_past(written: str) -> None:
    moment = read_past(written, None, NOW)[0]
    assert moment is not None
    assert moment <= NOW


@pytest.mark.parametrize(
    ("written", "ahead_s"),
    [
        ("now", 0),
        ("Now", 0),
        ("in 2h", 7200),
        ("in 30s", 30),
        ("30s", 30),
        ("90 min", 5400),
        ("2 hours", 7200),
        ("in 1.5 h", 5400),
        ("1 day", 86_400),
        ("2h ago", -7200),
    ],
)
def test_a_span_is_counted_ahead_for_events_unless_it_says_ago(
    written: str, ahead_s: float
) -> None:
    assert read_moment(written, NOW) == NOW + timedelta(seconds=ahead_s)


@pytest.mark.parametrize(
    ("written", "ahead_s"), [("2h", -7200), ("2h ago", -7200), ("now", 0), ("in 2h", 7200)]
)
def test_a_span_is_counted_back_for_episodes_unless_it_says_in(
    written: str, ahead_s: float
) -> None:
    assert read_past(written, None, NOW)[0] == NOW + timedelta(seconds=ahead_s)


@pytest.mark.parametrize(
    "written",
    ["", "in", "in 2h ago", "2x", "7", "13 pm", "25:00", "last", "monday soon", "9" * 400 + "h"],
)
def test_what_is_no_time_is_refused_with_what_is_one(written: str) -> None:
    with pytest.raises(SemanticMapError, match="is no time") as error:
        read_moment(written, NOW)
    assert AHEAD in error.value.hint


MONDAY = datetime(2026, 11, 23, 0, 0, tzinfo=UTC)


@pytest.mark.parametrize(
    ("written", "begin_h", "end_h"),
    [
        ("today", 0, 24),
        ("Yesterday", -24, 0),
        ("this morning", 5, 12),
        ("yesterday afternoon", -12, -6),
        ("last night", -2, 6),
        ("Sunday", -24, 0),
        ("monday", 0, 24),
        ("last Monday", -168, -144),
        ("2026-11-22", -24, 0),
    ],
)
def test_a_period_of_the_past_is_the_whole_of_it(
    written: str, begin_h: float, end_h: float
) -> None:
    begin, end = MONDAY + timedelta(hours=begin_h), MONDAY + timedelta(hours=end_h)

    assert read_past(written, None, NOW) == (begin, end)
    assert read_past(None, written, NOW) == (None, end)


@pytest.mark.parametrize(
    ("written", "hour"),
    [
        ("3:15 pm", 15.25 - 24),
        ("3pm", 15 - 24),
        ("12 am", 0),
        ("12:30 p.m.", 12.5 - 24),
        ("noon", 12),
        ("last 10 minutes", 12 - 1 / 6),
        ("the last hour", 11),
        ("an hour ago", 11),
        ("yesterday 9:30", -14.5),
        ("Sunday 22:00", -2),
        ("2 weeks ago", 12 - 336),
    ],
)
def test_moments_are_read_as_people_say_them(written: str, hour: float) -> None:
    assert read_past(written, None, NOW) == (MONDAY + timedelta(hours=hour), None)


def test_from_a_moment_to_a_period_is_to_its_end() -> None:
    assert read_past("9:00", "this morning", NOW) == (
        MONDAY + timedelta(hours=9),
        MONDAY + timedelta(hours=12),
    )


@pytest.mark.parametrize(
    ("written", "hour"),
    [("tomorrow 8:00", 32), ("3 pm", 15), ("9 am", 33), ("Tuesday 8:00", 32), ("tonight", 22)],
)
def test_a_time_of_an_event_is_still_to_come(written: str, hour: float) -> None:
    assert read_moment(written, NOW) == MONDAY + timedelta(hours=hour)


@pytest.mark.parametrize(
    ("since", "until", "begin_h", "end_h"),
    [
        ("23:30", None, -0.5, None),
        ("23:30", "23:45", -0.5, -0.25),
        ("22:00", "in 1h", -2, 1 + 1 / 6),
        ("0:05", "14:00", 1 / 12, 14),
        (None, "14:00", None, 14),
    ],
)
def test_a_time_of_the_past_that_is_still_to_come_today_is_yesterdays(
    since: str | None, until: str | None, begin_h: float | None, end_h: float | None
) -> None:
    now = MONDAY + timedelta(minutes=10)
    begin, end = (None if h is None else MONDAY + timedelta(hours=h) for h in (begin_h, end_h))
    assert read_past(since, until, now) == (begin, end)


def test_this_monday_is_of_the_past_where_the_past_is_asked_for() -> None:
    begin, end = read_past("this Monday", None, NOW + timedelta(days=2))
    assert (begin, end) == (MONDAY, MONDAY + timedelta(days=1))


@pytest.mark.parametrize(
    ("written", "hour"),
    [
        ("in the morning", 29),
        ("this morning", 5),
        ("Monday 9:30", 7 * 24 + 9.5),
        ("today 9:30", 9.5),
    ],
)
def test_what_is_over_today_and_said_of_what_is_to_come_is_the_next_one(
    written: str, hour: float
) -> None:
    assert read_moment(written, NOW) == MONDAY + timedelta(hours=hour)


def test_a_weekdays_time_that_is_still_to_come_was_a_week_ago() -> None:
    begin = MONDAY + timedelta(hours=15 - 7 * 24)
    assert read_past("Monday 15:00", None, NOW) == (begin, None)
