import csv
import io
import json
import math
import re
from collections.abc import Sequence
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory import Landmark, SemanticMap, Waypoint, name_key
from mapspeak.memory.exchange import (
    ExchangeFormat,
    export_text,
    from_csv,
    from_geojson,
    from_osm,
    import_text,
    to_csv,
    to_geojson,
    to_osm,
)
from mapspeak.memory.mapfile.schema import record_data
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
    return places.map_id, [record_data(place) for place in places.waypoints]


@given(places=memories(), form=st.sampled_from(ExchangeFormat))
def test_what_is_exported_and_imported_is_the_same(
    places: SemanticMap, form: ExchangeFormat
) -> None:
    assert said(import_text(export_text(places, form), form)) == said(places)


@pytest.mark.parametrize("form", [ExchangeFormat.GEOJSON, ExchangeFormat.OSM])
def test_places_come_back_from_where_they_are_on_earth(form: ExchangeFormat) -> None:
    text = export_text(PLACES, form, anchor=ANCHOR)
    assert "7.8" in text
    assert said(import_text(text, form)) == said(PLACES)


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


def test_csv_has_a_row_for_the_place_and_for_each_thing() -> None:
    header, place, *things = to_csv(PLACES).replace("gate.\nTwo", "gate. Two").splitlines()
    assert header.startswith("place,kind,label,x_m,y_m,yaw_deg,bearing_deg,range_m,")
    assert place.startswith("dock corner,waypoint,,1.2,-3.4,90.0,")
    assert [row.split(",")[:3] for row in things] == [
        ["dock corner", "safety_landmarks", "exit sign"],
        ["dock corner", "functional_landmarks", "tap"],
        ["dock corner", "functional_landmarks", "101"],
        ["dock corner", "geometric_features", "corner of two walls"],
    ]


FORMULAS = (
    "=cmd|' /C calc'!A0",
    "+1",
    "-2+3",
    "@SUM(1)",
    "'=1",
    "''@x",
    "'tis",
    "\uff1d1",
    "a;=1+1",
)


@pytest.mark.parametrize("label", FORMULAS)
def test_no_cell_of_csv_is_a_formula_and_the_label_comes_back(label: str) -> None:
    thing = Landmark(label=label, note=f"x,{label}", purpose=f"x\t{label}")
    place = Waypoint(
        name=label,
        pose=Pose(-1.5, -2.0, -0.3),
        description=f"{label}\n{label}",
        safety_landmarks=(thing,),
        geometric_features=(label,),
        room_id=label,
    )
    places = SemanticMap(map_id=label, waypoints=(place,))

    text = to_csv(places)

    cells = [cell for row in csv.reader(io.StringIO(text)) for cell in row]
    parts = [part for cell in cells for part in re.split(r"[;,\t\n|]", cell)]
    formulas = [part for part in parts if re.match("[=+@\uff1d\uff0b\uff20\uff0d-]", part)]
    assert all(re.fullmatch(r"-\d+\.\d+", part) for part in formulas)
    assert said(from_csv(text)) == said(places)


def test_osm_has_a_node_for_each_place_that_can_be_moved_and_retagged() -> None:
    text = to_osm(PLACES)
    assert '<tag k="mapspeak:functional_landmarks:1:label" v="tap"/>' in text
    assert '<tag k="mapspeak:description" v="By the gate.&#10;Two lines."/>' in text
    edited = text.replace('functional_landmarks:2" v="101"', 'functional_landmarks:2" v="102"')
    (place,) = from_osm(edited).waypoints
    assert [landmark.label for landmark in place.functional_landmarks] == ["tap", "102"]


def test_a_memory_of_nothing_is_one_too() -> None:
    empty = SemanticMap(map_id="hall")
    assert from_geojson(to_geojson(empty)) == empty
    assert from_osm(to_osm(empty)) == empty
    assert from_csv(to_csv(empty)) == SemanticMap()


CSV = "place,kind,x_m,y_m,yaw_deg,label\n"


@pytest.mark.parametrize(
    ("form", "text", "reason"),
    [
        (ExchangeFormat.GEOJSON, "{}", "at 'type': Field required"),
        (ExchangeFormat.GEOJSON, "[", "Invalid JSON"),
        (
            ExchangeFormat.GEOJSON,
            to_geojson(PLACES).replace('"yaw_deg": 90.0', '"yaw_deg": "north"'),
            r"record 1 \(dock corner\): at 'pose.yaw_deg'",
        ),
        (ExchangeFormat.OSM, "<osm/>", "no root node of a memory"),
        (ExchangeFormat.OSM, "<osm>", "no memory as OSM. .* line 1"),
        (ExchangeFormat.CSV, "a,b\n1,2\n", "the columns 'place' and 'kind' are missing"),
        (ExchangeFormat.CSV, CSV + "dock,waypoint,one,2,0,\n", "line 2: x_m and y_m"),
        (ExchangeFormat.CSV, CSV + "dock,safety_landmarks,,,,exit\n", "line 2: no row of kind"),
        (ExchangeFormat.CSV, CSV + "dock,waypoint,1,2,0,\n" * 2, "line 3: a second place"),
        (ExchangeFormat.CSV, CSV + 'dock,waypoint,1,2,0,"a\n', "unexpected end of data"),
    ],
)
def test_a_file_with_a_fault_is_refused_with_its_place(
    form: ExchangeFormat, text: str, reason: str
) -> None:
    with pytest.raises(SemanticMapError, match=reason):
        import_text(text, form)


def test_two_places_of_one_name_are_refused() -> None:
    twice = SemanticMap(waypoints=(DOCK, Waypoint(name="Dock  Corner", pose=Pose(0.0, 0.0))))
    for form in (ExchangeFormat.GEOJSON, ExchangeFormat.OSM):
        with pytest.raises(SemanticMapError, match="two records are called"):
            import_text(export_text(twice, form), form)


def test_an_anchor_needs_a_format_that_can_say_it() -> None:
    with pytest.raises(SemanticMapError, match="CSV"):
        export_text(PLACES, ExchangeFormat.CSV, anchor=ANCHOR)
