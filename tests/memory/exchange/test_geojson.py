import json
import math
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory import Landmark, SemanticMap, Waypoint, name_key
from mapspeak.memory.exchange.geojson import from_geojson, to_geojson
from mapspeak.memory.frames import Frames, MapFrame
from mapspeak.memory.store.records import data_of
from mapspeak.spatial.areagraph import MapAnchor
from waypoints import waypoints

DOCK = Waypoint(
    name="dock corner",
    description="By the gate.\nTwo lines.",
    pose=Pose(1.2, -3.4, math.radians(90)),
    safety_landmarks=(Landmark(label="exit sign"),),
    functional_landmarks=(
        Landmark(label="tap", bearing_rad=math.radians(-20), range_m=3.1, purpose="water"),
        Landmark(label="101"),
    ),
    geometric_features=("corner of two walls",),
    recorded_at=datetime(2026, 11, 2, 10, 30, tzinfo=UTC),
)
PLACES = SemanticMap(map_id="hall", waypoints=(DOCK,))
ANCHOR = MapAnchor(lat_deg=48.0, lon_deg=7.8, yaw_rad=0.3)


def memories() -> st.SearchStrategy[SemanticMap]:
    places = st.lists(
        waypoints(has_poses=True), min_size=1, max_size=4, unique_by=lambda w: name_key(w.name)
    )
    map_ids = st.sampled_from([None, "hall", "101", "a;b"])
    return st.builds(SemanticMap, map_id=map_ids, waypoints=places.map(tuple))


def said(places: SemanticMap) -> tuple[object, Sequence[object]]:
    """Gives what a semantic map file would say: to the millimetre and the hundredth of a degree."""
    return places.map_id, [data_of(place) for place in places.waypoints]


@given(places=memories())
def test_what_is_exported_and_imported_is_the_same(places: SemanticMap) -> None:
    assert said(from_geojson(to_geojson(places))) == said(places)


def test_places_come_back_from_where_they_are_on_earth() -> None:
    text = to_geojson(PLACES, anchor=ANCHOR)
    assert "7.8" in text
    assert said(from_geojson(text)) == said(PLACES)


def test_places_of_other_frames_are_where_their_alignment_puts_them_or_left_out_on_earth() -> None:
    aligned = MapFrame(id="F2", pose=Pose(5.0, 0.0))
    yard, roof = (
        replace(DOCK, name=name, frame=of) for name, of in (("yard", "F2"), ("roof", "F3"))
    )
    places = SemanticMap(waypoints=(yard, roof), frames=Frames((aligned, MapFrame(id="F3"))))

    flat, on_earth = (from_geojson(to_geojson(places, anchor=each)) for each in (None, ANCHOR))

    told = [(each.name, each.frame, each.pose.x) for each in flat.waypoints]
    assert told == [("yard", None, 6.2), ("roof", "F3", 1.2)]
    assert [(each.name, round(each.pose.x, 2)) for each in on_earth.waypoints] == [("yard", 6.2)]


def test_geojson_says_its_frame_and_has_numbers_as_numbers() -> None:
    collection = json.loads(to_geojson(PLACES))
    assert collection["mapspeak"]["coordinates"] == "x and y in metres, in the map frame"
    (feature,) = collection["features"]
    assert feature["geometry"] == {"type": "Point", "coordinates": [1.2, -3.4]}
    assert feature["properties"]["yaw_deg"] == 90.0
    assert feature["properties"]["functional_landmarks"] == [
        {"label": "tap", "bearing_deg": -20.0, "range_m": 3.1, "purpose": "water"},
        "101",
    ]


def test_a_memory_of_nothing_is_one_too() -> None:
    empty = SemanticMap(map_id="hall")
    assert from_geojson(to_geojson(empty)) == empty


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("{}", "at 'type': Field required"),
        ("[", "Invalid JSON"),
        (
            to_geojson(PLACES).replace('"yaw_deg": 90.0', '"yaw_deg": "north"'),
            r"record 1 \(dock corner\): at 'pose.yaw_deg'",
        ),
    ],
)
def test_a_file_with_a_fault_is_refused_with_its_place(text: str, reason: str) -> None:
    with pytest.raises(SemanticMapError, match=reason):
        from_geojson(text)


def test_two_places_of_one_name_are_refused() -> None:
    twice = SemanticMap(waypoints=(DOCK, Waypoint(name="Dock  Corner", pose=Pose(0.0, 0.0))))
    with pytest.raises(SemanticMapError, match="two records are called"):
        from_geojson(to_geojson(twice))
