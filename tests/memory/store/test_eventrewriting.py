"""Laws of events in a file, for any words at all and any layout of what stands around them."""

from datetime import UTC, datetime

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Waypoint
from mapspeak.memory.events import Effect, Event
from mapspeak.memory.store.document import MapDocument, parse_document
from mapspeak.memory.store.eventschema import event_data
from mapspeak.memory.store.rewriting import moved, with_event, with_waypoint
from mapspeak.memory.store.schema import record_data
from waypoints import _LINES, waypoints

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

    after, written = with_event(before, event)

    assert list(after.events) == [*before.events, written.id]
    again = document_of(after.text).events[written.id].event
    assert again == written
    assert {**event_data(event), "id": written.id} == event_data(again)
    assert after.records.keys() == before.records.keys()


@given(EVENTS, EVENTS, st.sampled_from(LAYOUTS))
def test_any_event_can_become_any_other(event: Event, other: Event, layout: str) -> None:
    first, written = with_event(document_of(layout), event)
    values = {key: getattr(other, key) for key in Event.__slots__}

    second, changed = with_event(first, Event(**{**values, "id": written.id}))

    assert event_data(changed) == {**event_data(other), "id": written.id}
    assert list(second.events) == list(first.events)


@settings(deadline=None, max_examples=40)
@given(
    st.lists(waypoints(), min_size=1, max_size=4, unique_by=lambda each: each.name.casefold()),
    EVENTS,
    st.builds(Pose, st.floats(-99, 99), st.floats(-99, 99), st.floats(-3, 3)),
)
def test_a_move_and_its_inverse_leave_all_where_it_was(
    places: list[Waypoint], event: Event, motion: Pose
) -> None:
    document = document_of("")
    for place in places:
        document = with_waypoint(document, place)
    document, _ = with_event(document, event)

    there = moved(document, motion, entries={"snapshot": "map-2.yaml"})
    back = moved(there, motion.inverse(), entries={"snapshot": "map-3.yaml"})

    assert there.find_entry("snapshot") == "map-2.yaml"
    for one, other in zip(document.records.values(), back.records.values(), strict=True):
        before, after = one.waypoint, other.waypoint
        # Hundredths of a degree and millimetres are what the file holds.
        assert after.pose.point.distance_to(before.pose.point) < 0.01 + 1e-3 * abs(motion.x)
        said, again = record_data(before), record_data(after)
        # Ids of rooms mean nothing on another map.
        assert {**said, "pose": None, "room_id": None} == {**again, "pose": None, "room_id": None}
        assert after.room_id is None


@pytest.mark.parametrize(
    "layout",
    ["{events: [{text: x}]}", "events: [{text: x}]\n", "events: some words\n"],
)
def test_a_layout_that_cannot_be_written_to_is_refused(layout: str) -> None:
    with pytest.raises(SemanticMapError):
        with_event(document_of(layout), Event(text="new"))


def test_the_files_own_keys_are_changed_wherever_they_stand() -> None:
    document = document_of(LAYOUTS[-1])

    after = moved(document, Pose(1.0, 0.0), entries={"map": "b2", "snapshot": "map-2.yaml"})

    assert after.map_id == "b2"
    assert after.find_entry("snapshot") == "map-2.yaml"
    assert after.text.count("map: ") == 1
    assert after.records["dock"].waypoint.pose == Pose(2.0, 2.0, 0.0)
