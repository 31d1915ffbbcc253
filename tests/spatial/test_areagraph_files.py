"""Area graphs in files: what others find in them, and what is refused when they are damaged."""

import json
import math
import xml.etree.ElementTree as ET

import pytest

from drawing import grid_from_text
from mapspeak.errors import MapError
from mapspeak.geometry import Point
from mapspeak.spatial.areagraph import AreaGraph, LatLon, MapAnchor, build_area_graph
from mapspeak.spatial.areagraph.files import from_json, to_geojson, to_json, to_osm
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


@pytest.fixture(scope="module")
def graph() -> AreaGraph:
    return build_area_graph(
        find_rooms(grid_from_text(TWO_ROOMS, resolution_m=0.5)), name="Büro 北 <&\"'>"
    )


def tags_of(element: ET.Element) -> dict[str, str]:
    return {tag.attrib["k"]: tag.attrib["v"] for tag in element.iter("tag")}


def osm_of(graph: AreaGraph, anchor: MapAnchor | None = None) -> ET.Element:
    return ET.fromstring(to_osm(graph, anchor=anchor))  # noqa: S314 - our own text


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


def test_a_map_across_the_date_line_keeps_its_places(graph: AreaGraph) -> None:
    anchor = MapAnchor(lat_deg=-17.0, lon_deg=179.99999)

    feature = json.loads(to_geojson(graph, anchor=anchor))["features"][1]
    corners = feature["geometry"]["coordinates"][0]
    assert min(lon_deg for lon_deg, _ in corners) < -179.9
    assert max(lon_deg for lon_deg, _ in corners) <= 180.0
    found = tuple(anchor.point_at(LatLon(lat_deg, lon_deg)) for lon_deg, lat_deg in corners)
    assert found == graph.areas[1].polygons[0].outer


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


@pytest.mark.parametrize(
    "text",
    ["", "null", "[]", "{}", "<osm/>", "<html></html>", "[" * 100_000, "\x00", "\ud800", "<osm>"],
)
def test_something_else_is_refused_with_a_hint(text: str) -> None:
    with pytest.raises(MapError) as refused:
        from_json(text)
    assert refused.value.hint


def test_a_file_that_was_cut_off_is_refused(graph: AreaGraph) -> None:
    text = to_json(graph)
    for length in range(0, len(text) - 2, 97):
        with pytest.raises(MapError):
            from_json(text[:length])


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
def test_a_file_that_contradicts_itself_is_refused(graph: AreaGraph, old: str, new: str) -> None:
    text = to_json(graph)
    assert old in text

    with pytest.raises(MapError):
        from_json(text.replace(old, new, 1))


def test_places_on_earth_come_back_to_the_micrometre() -> None:
    anchor = MapAnchor(lat_deg=84.9, lon_deg=-180.0, yaw_rad=-2.0)
    point = Point(-12345.678901, 0.000001)

    assert anchor.point_at(anchor.locate(point)) == point
    assert anchor.point_at(LatLon(84.9, 180.0)) == Point(0.0, 0.0)
