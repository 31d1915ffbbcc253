"""Area graphs in files: what others find in them, and what is refused when they are damaged."""

import json
import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from drawing import grid_from_text
from mapspeak.errors import MapError
from mapspeak.geometry import Point
from mapspeak.spatial.areagraph import AreaGraph, LatLon, MapAnchor, build_area_graph
from mapspeak.spatial.areagraph.jsonforms import from_geojson, from_json, to_geojson, to_json
from mapspeak.spatial.areagraph.osm import from_osm, read_area_graph, to_osm
from mapspeak.spatial.rooms import find_rooms

TWO_ROOMS = """
    ##############
    #......#.....#
    #......#.....#
    #.............
    #......#.....#
    #..#...#.....#
    #......#.....#
    ##############
"""

BOMB = """<?xml version="1.0"?>
<!DOCTYPE osm [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>
<osm version="0.6"><node id="-1" lat="0" lon="0"><tag k="name" v="&b;"/></node></osm>
"""


@pytest.fixture(scope="module")
def graph() -> AreaGraph:
    return build_area_graph(
        find_rooms(grid_from_text(TWO_ROOMS, resolution_m=0.5)), name="Büro 北 <&\"'>"
    )


@dataclass(frozen=True, slots=True)
class Form:
    """A text form with how it is written and read."""

    write: Callable[[AreaGraph], str]
    read: Callable[[str], AreaGraph]


FORMS = {
    ".json": Form(to_json, from_json),
    ".geojson": Form(to_geojson, from_geojson),
    ".osm": Form(to_osm, from_osm),
}


def tags_of(element: ET.Element) -> dict[str, str]:
    return {tag.attrib["k"]: tag.attrib["v"] for tag in element.iter("tag")}


def osm_of(graph: AreaGraph, anchor: MapAnchor | None = None) -> ET.Element:
    return ET.fromstring(to_osm(graph, anchor=anchor))  # noqa: S314 - our own text


@pytest.mark.parametrize("suffix", FORMS)
def test_a_file_is_read_by_its_ending(graph: AreaGraph, tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"graph{suffix}"
    path.write_text("\ufeff" + FORMS[suffix].write(graph), encoding="utf-8")

    assert read_area_graph(path) == graph


def test_json_has_a_version_and_a_line_for_each_area_and_passage(graph: AreaGraph) -> None:
    text = to_json(graph)

    document = json.loads(text)
    assert (document["format"], document["version"]) == ("mapspeak area graph", 1)
    assert document["areas"][0]["polygons"][0][0][0] == [0.5, 0.5]
    assert len(text.splitlines()) == 10 + len(graph.areas) + len(graph.passages)


def test_geojson_has_a_polygon_for_each_area_and_a_line_for_each_door(graph: AreaGraph) -> None:
    collection = json.loads(to_geojson(graph))

    found = {each["id"]: each["geometry"]["type"] for each in collection["features"]}
    assert found == {"R1": "Polygon", "R2": "Polygon", "D1": "LineString"}
    assert "metres" in collection["mapspeak"]["coordinates"]


def test_an_anchored_map_lies_where_its_anchor_says(graph: AreaGraph) -> None:
    north_up = MapAnchor(lat_deg=48.0, lon_deg=9.0, yaw_rad=0.0)
    turned = MapAnchor(lat_deg=48.0, lon_deg=9.0, yaw_rad=math.pi / 2)

    place = north_up.locate(Point(100.0, 0.0))
    assert place.lat_deg == 48.0
    assert place.lon_deg == pytest.approx(9.0 + 100 / 74_625, abs=1e-7)
    place = turned.locate(Point(100.0, 0.0))
    assert place.lat_deg == pytest.approx(48.0 + 100 / 111_200, abs=1e-7)
    corner = json.loads(to_geojson(graph, anchor=north_up))["features"][0]["geometry"]
    assert corner["coordinates"][0][0] == pytest.approx([9.0000067, 48.0000045], abs=1e-7)


def test_a_map_across_the_date_line_comes_back_whole(graph: AreaGraph) -> None:
    anchor = MapAnchor(lat_deg=-17.0, lon_deg=179.99999)

    assert from_osm(to_osm(graph, anchor=anchor)) == graph
    assert from_geojson(to_geojson(graph, anchor=anchor)) == graph


@pytest.mark.parametrize("lat_deg", [86.0, -90.0, math.nan, math.inf])
def test_an_anchor_near_a_pole_is_refused(lat_deg: float) -> None:
    with pytest.raises(MapError, match="latitude from -85 to 85"):
        MapAnchor(lat_deg=lat_deg)


def test_a_map_too_far_from_its_anchor_is_refused() -> None:
    with pytest.raises(MapError, match="too far"):
        MapAnchor().locate(Point(0.0, 1e8))


def test_osm_begins_with_the_root_node_at_the_anchor(graph: AreaGraph) -> None:
    root = osm_of(graph, MapAnchor(lat_deg=31.5, lon_deg=121.5))[0]

    assert root.tag == "node"
    assert (float(root.attrib["lat"]), float(root.attrib["lon"])) == (31.5, 121.5)
    assert tags_of(root)["name"] == "root"


def test_osm_speaks_of_areas_and_passages_as_osmag_does(graph: AreaGraph) -> None:
    osm = osm_of(graph)
    ways = [tags_of(way) for way in osm.iter("way") if tags_of(way)]

    areas = [tags for tags in ways if tags["osmAG:type"] == "area"]
    (passage,) = [tags for tags in ways if tags["osmAG:type"] == "passage"]
    assert [(tags["name"], tags["osmAG:areaType"], tags["indoor"]) for tags in areas] == [
        ("R1", "room", "room"),
        ("R2", "room", "room"),
    ]
    assert {passage["osmAG:from"], passage["osmAG:to"]} == {"R1", "R2"}
    assert osm.attrib["version"] == "0.6"
    assert all(int(each.attrib["id"]) < 0 for each in osm)


def test_the_ends_of_a_passage_are_nodes_of_both_areas(graph: AreaGraph) -> None:
    ways = [way for way in osm_of(graph).iter("way") if tags_of(way)]

    first, second, passage = ({nd.attrib["ref"] for nd in way.iter("nd")} for way in ways)
    assert len(passage) == 2
    assert passage <= first & second


def test_an_osm_file_saved_by_an_editor_comes_back_to_a_few_micrometres(graph: AreaGraph) -> None:
    anchor = MapAnchor(lat_deg=48.7, lon_deg=9.1, yaw_rad=0.4)
    eleven_decimals = re.sub(r'(l(?:at|on)="-?\d+\.\d{11})\d+', r"\1", to_osm(graph, anchor=anchor))
    edited = eleven_decimals.replace('action="modify"', 'action="modify" timestamp="2026-01-01"')

    outline = from_osm(edited).areas[0].polygons[0].outer
    exact = graph.areas[0].polygons[0].outer
    assert max(a.distance_to(b) for a, b in zip(outline, exact, strict=True)) < 5e-6


def test_a_node_moved_in_an_editor_moves_the_outline(graph: AreaGraph) -> None:
    anchor = MapAnchor()
    corner = graph.areas[0].polygons[0].outer[0]
    old, new = anchor.locate(corner), anchor.locate(Point(corner.x + 1, corner.y))
    text = to_osm(graph)
    assert f'lon="{old.lon_deg:.13f}"' in text
    moved = from_osm(
        text.replace(
            f'lat="{old.lat_deg:.13f}" lon="{old.lon_deg:.13f}"',
            f'lat="{new.lat_deg:.13f}" lon="{new.lon_deg:.13f}"',
        )
    )

    assert moved.areas[0].polygons[0].outer[0] == Point(corner.x + 1, corner.y)


def test_what_was_deleted_in_an_editor_is_gone(graph: AreaGraph) -> None:
    text = to_osm(graph)
    (way_id,) = re.findall(r'<way id="(-\d+)"(?:(?!</way>).)*osmAG:from', text, re.DOTALL)[-1:]
    deleted = text.replace(
        f'<way id="{way_id}" action="modify"', f'<way id="{way_id}" action="delete"'
    )

    with pytest.raises(MapError, match="names other doors"):
        from_osm(deleted)


def test_a_document_type_is_refused_before_any_entity_is_expanded() -> None:
    with pytest.raises(MapError, match="document type"):
        from_osm(BOMB)


@pytest.mark.parametrize("suffix", FORMS)
@pytest.mark.parametrize(
    "text",
    ["", "null", "[]", "{}", "<osm/>", "<html></html>", "[" * 100_000, "\x00", "\ud800", "<osm>"],
)
def test_something_else_is_refused_with_a_hint(suffix: str, text: str) -> None:
    with pytest.raises(MapError) as refused:
        FORMS[suffix].read(text)
    assert refused.value.hint


@pytest.mark.parametrize("suffix", FORMS)
def test_a_file_that_was_cut_off_is_refused(graph: AreaGraph, suffix: str) -> None:
    text = FORMS[suffix].write(graph)
    for length in range(0, len(text) - 2, 97):
        with pytest.raises(MapError):
            FORMS[suffix].read(text[:length])


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"version": 1', '"version": 2'),
        ('"id": "R1", "label"', '"id": "R2", "label"'),
        ('"id": "R1", "label"', '"id": "", "label"'),
        ('"id": "R1", "label"', '"id": "R1;R2", "label"'),
        ('"joins": ["R1", "R2"]', '"joins": ["R1", "R9"]'),
        ('"joins": ["R1", "R2"]', '"joins": ["R1", "R1"]'),
        ('"joins": ["R1", "R2"]', '"joins": ["R1"]'),
        ('"doors": ["D1"]', '"doors": []'),
        ("[0.5, 0.5]", "[0.5, NaN]"),
        ("[0.5, 0.5]", "[0.5, 1e999]"),
        ("[0.5, 0.5]", "[0.5]"),
        ("[0.5, 0.5]", "[0.6, 0.5]"),
        ('"kind": "room"', '"kind": "cave"'),
        ('"clearance_m": ', '"clearance_m": "wide", "x": '),
        ('"reason": "', '"reason": "\\u0007'),
    ],
)
@pytest.mark.parametrize("suffix", [".json", ".geojson"])
def test_a_file_that_contradicts_itself_is_refused(
    graph: AreaGraph, suffix: str, old: str, new: str
) -> None:
    text = FORMS[suffix].write(graph)
    assert old in text

    with pytest.raises(MapError):
        FORMS[suffix].read(text.replace(old, new, 1))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('lat="', 'lat="9'),
        ('lat="', 'lat="nan" x="'),
        ('<nd ref="', '<nd ref="7'),
        ('<nd ref="', '<nd ref="x'),
        ('<node id="', '<node id="x'),
        ('<tag k="name"', '<tag key="name"'),
        ('k="name" v="root"', 'k="name" v="tree"'),
        ('k="mapspeak:version" v="1"', 'k="mapspeak:version" v="2"'),
        ('k="osmAG:to" v="', 'k="osmAG:to" v="X'),
        ('k="mapspeak:centre" v="', 'k="mapspeak:centre" v="1;'),
        ('k="mapspeak:label" v="', 'k="mapspeak:label" v="one'),
        ('k="name" v="R2"', 'k="name" v="R1"'),
    ],
)
def test_an_osm_file_that_contradicts_itself_is_refused(
    graph: AreaGraph, old: str, new: str
) -> None:
    text = to_osm(graph)
    assert old in text

    with pytest.raises(MapError):
        from_osm(text.replace(old, new, 1))


def test_outlines_that_another_program_turned_round_are_read(graph: AreaGraph) -> None:
    collection = json.loads(to_geojson(graph))
    for feature in collection["features"]:
        if feature["geometry"]["type"] == "Polygon":
            for ring in feature["geometry"]["coordinates"]:
                ring.reverse()

    outline = from_geojson(json.dumps(collection)).areas[0].polygons[0]
    assert outline.area_m2 == graph.areas[0].polygons[0].area_m2


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("missing.json", None, "cannot be read"),
        ("graph.xml", b"<osm/>", "ends in .geojson, .json, .osm"),
        ("graph.osm", b"\xff\xfe\x00", "not UTF-8"),
    ],
)
def test_a_file_that_cannot_be_read_is_refused(
    tmp_path: Path, name: str, content: bytes | None, says: str
) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)

    with pytest.raises(MapError, match=says):
        read_area_graph(path)


def test_places_on_earth_come_back_to_the_micrometre() -> None:
    anchor = MapAnchor(lat_deg=84.9, lon_deg=-180.0, yaw_rad=-2.0)
    point = Point(-12345.678901, 0.000001)

    assert anchor.point_at(anchor.locate(point)) == point
    assert anchor.point_at(LatLon(84.9, 180.0)) == Point(0.0, 0.0)
