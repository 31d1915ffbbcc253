"""Moments as models write them."""

import re
from datetime import UTC, datetime, timedelta

import pytest

from mapspeak.errors import SemanticMapError
from mapspeak.server.text.memory import AHEAD, PAST, read_moment

NOW = datetime(2026, 11, 23, 12, 0, tzinfo=UTC)


@pytest.mark.parametrize("written", re.split(r", | or ", AHEAD))
def test_what_the_schema_of_an_event_names_is_read(written: str) -> None:
    assert read_moment(written, NOW, is_ahead=True) is not None


@pytest.mark.parametrize("written", re.split(r", | or ", PAST))
def test_what_the_schema_of_a_search_names_is_read_as_past(written: str) -> None:
    moment = read_moment(written, NOW)
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
    assert read_moment(written, NOW, is_ahead=True) == NOW + timedelta(seconds=ahead_s)


@pytest.mark.parametrize(
    ("written", "ahead_s"), [("2h", -7200), ("2h ago", -7200), ("now", 0), ("in 2h", 7200)]
)
def test_a_span_is_counted_back_for_episodes_unless_it_says_in(
    written: str, ahead_s: float
) -> None:
    assert read_moment(written, NOW) == NOW + timedelta(seconds=ahead_s)


@pytest.mark.parametrize("written", ["", "yesterday", "in", "in 2h ago", "2x", "9" * 400 + "h"])
def test_what_is_no_time_is_refused_with_what_is_one(written: str) -> None:
    with pytest.raises(SemanticMapError, match="is no time") as error:
        read_moment(written, NOW, is_ahead=True)
    assert AHEAD in error.value.hint
