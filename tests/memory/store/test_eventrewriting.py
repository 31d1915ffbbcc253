"""Laws of events in a file, for any words at all and any layout of what stands around them."""

from dataclasses import replace
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point
from mapspeak.memory.events import Effect, Event
from mapspeak.memory.store.document import MapDocument, parse_document
from mapspeak.memory.store.records import data_of
from waypoints import _LINES

_POINTS = st.builds(Point, st.floats(-1e4, 1e4), st.floats(-1e4, 1e4))
_OUTLINES = st.lists(_POINTS, min_size=3, max_size=5).map(tuple)
_TIMES = st.datetimes(datetime(2000, 1, 1), datetime(2030, 1, 1), timezones=st.just(UTC))  # noqa: DTZ001 - the bounds take no zone
EVENTS = st.builds(
    Event,
    text=_LINES,
    place=_LINES,
    effect=st.sampled_from(Effect),
    at=st.none() | _POINTS,
    outlines=st.lists(_OUTLINES, max_size=2).map(tuple),
    begins=st.none(),
    until=st.none() | _TIMES,
    source=st.just("") | _LINES,
    recorded_at=st.none() | _TIMES,
)

LAYOUTS = [
    "",
    "version: 1\nwaypoints:\n",
    "events:\n- text: old one\n# behind\nwaypoints: []\n",
    "events: []  # none yet\nwaypoints:\n- name: dock\n  pose: {x: 1, y: 2, yaw_deg: 0}\n",
    "waypoints:\n  - name: dock\n    pose: {x: 1, y: 2, yaw_deg: 0}\nevents:\n   -   text: old\n",
    "waypoints:\n- name: dock\n  pose: {x: 1, y: 2, yaw_deg: 0}\nevents:\n",
    "waypoints:\n- name: dock\n  pose: {x: 1, y: 2, yaw_deg: 0}\nmap: b1",
]


def document_of(text: str) -> MapDocument:
    return parse_document(text.encode(), source="places.yaml")


@given(EVENTS, st.sampled_from(LAYOUTS))
def test_any_event_reads_back_from_any_layout(event: Event, layout: str) -> None:
    before = document_of(layout)

    after = before.with_record(replace(event, id="E9"))

    assert list(after.lists["events"]) == [*before.lists["events"], "E9"]
    again = document_of(after.text).find("events", "E9")
    assert again is not None
    assert again == after.find("events", "E9")
    assert {**data_of(event), "id": "E9"} == data_of(again)
    assert after.lists["waypoints"].keys() == before.lists["waypoints"].keys()


@given(EVENTS, EVENTS, st.sampled_from(LAYOUTS))
def test_any_event_can_become_any_other(event: Event, other: Event, layout: str) -> None:
    first = document_of(layout).with_record(replace(event, id="E9"))

    second = first.with_record(replace(other, id="E9"))

    changed = second.find("events", "E9")
    assert changed is not None
    assert data_of(changed) == {**data_of(other), "id": "E9"}
    assert list(second.lists["events"]) == list(first.lists["events"])


@pytest.mark.parametrize(
    "layout",
    ["{events: [{text: x}]}", "events: [{text: x}]\n", "events: some words\n"],
)
def test_a_layout_that_cannot_be_written_to_is_refused(layout: str) -> None:
    with pytest.raises(SemanticMapError):
        document_of(layout).with_record(Event(id="E9", text="new"))
