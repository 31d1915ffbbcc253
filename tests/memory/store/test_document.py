from datetime import UTC, datetime

import pytest

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory import Confidence, Landmark, SemanticMap
from mapspeak.memory.store.document import parse_document


def read(text: str) -> SemanticMap:
    return parse_document(text.encode(), source="places.yaml").places


def fault(text: str) -> str:
    with pytest.raises(SemanticMapError) as caught:
        read(text)
    return str(caught.value)


PAPERS_LAYOUT = """\
# mapspeak semantic map. Edit freely: comments and order are kept.
version: 1
map: warehouse-3f9a
waypoints:
  - name: dock corner
    description: A corner beside the loading dock.
    pose: {x: 1.20, y: -3.40, yaw_deg: 90.0}
    safety_landmarks: [fire extinguisher]
    functional_landmarks: []
    geometric_features: [corner of two walls]
"""


def test_the_papers_record_is_read() -> None:
    places = read(PAPERS_LAYOUT)

    assert places.map_id == "warehouse-3f9a"
    (dock,) = places.waypoints
    assert dock.name == "dock corner"
    assert dock.description == "A corner beside the loading dock."
    assert (dock.pose.x, dock.pose.y) == (1.2, -3.4)
    assert dock.pose.yaw_deg == pytest.approx(90.0)
    assert dock.safety_landmarks == (Landmark(label="fire extinguisher"),)
    assert dock.functional_landmarks == ()
    assert dock.geometric_features == ("corner of two walls",)
    assert dock.map_id == "warehouse-3f9a"
    assert places.warnings == ()


@pytest.mark.parametrize(
    "text",
    ["", "\n", "# nothing yet\n", "version: 1\n", "waypoints:\n", "waypoints: []\n", "\ufeff"],
)
def test_a_file_that_says_nothing_is_an_empty_map(text: str) -> None:
    assert read(text).waypoints == ()


def test_a_landmark_is_a_label_or_a_mapping() -> None:
    (place,) = read(
        """\
waypoints:
  - name: hall
    pose: {x: 0, y: 0, yaw_deg: 0}
    functional_landmarks:
      - pallet rack
      - {label: tap, purpose: drinking water, bearing_deg: -90, range_m: 2.5, note: leaks}
      - label: lift
        range_m: 4
"""
    ).waypoints

    rack, tap, lift = place.functional_landmarks
    assert rack == Landmark(label="pallet rack")
    assert (tap.label, tap.purpose, tap.range_m, tap.note) == (
        "tap",
        "drinking water",
        2.5,
        "leaks",
    )
    assert tap.bearing_rad == pytest.approx(-1.5708, abs=1e-4)
    assert lift == Landmark(label="lift", range_m=4.0)


def test_confidence_picture_time_and_room_are_read() -> None:
    (place,) = read(
        """\
waypoints:
  - name: hall
    pose: {x: 0, y: 0, yaw_deg: 0}
    functional_landmarks:
      - {label: tap, confidence: likely, picture: P3.jpg, stamp_s: 4.5}
      - {label: lift, recorded_at: 2026-11-02T10:30:00+00:00, confidence: unsure}
    room_id: R3
    picture: P4.jpg
"""
    ).waypoints

    tap, lift = place.functional_landmarks
    assert tap == Landmark(label="tap", confidence=Confidence.LIKELY, picture="P3.jpg", stamp_s=4.5)
    assert lift.recorded_at == datetime(2026, 11, 2, 10, 30, tzinfo=UTC)
    assert lift.confidence is Confidence.UNSURE
    assert (place.room_id, place.picture) == ("R3", "P4.jpg")


@pytest.mark.parametrize("name", ["101", "0101", "1.5", "yes", "on", "2026-11-02", "1e3"])
def test_a_name_is_what_stands_there_even_if_yaml_knows_a_number_of_that_spelling(
    name: str,
) -> None:
    (place,) = read(f"waypoints:\n- name: {name}\n  pose: {{x: 0, y: 0, yaw_deg: 0}}\n").waypoints

    assert place.name == name


@pytest.mark.parametrize(
    "text",
    [
        "waypoints: [{name: a, pose: {x: 1, y: 2, yaw_deg: 0}}]\n",
        '{"waypoints": [{"name": "a", "pose": {"x": 1, "y": 2, "yaw_deg": 0}}]}',
        "'waypoints':\n  - name: a\n    pose: {x: 1, y: 2, yaw_deg: 0}\n",
        " waypoints:\n   - name: a\n     pose: {x: 1, y: 2, yaw_deg: 0}\n",
        "waypoints:\n- name: a\n  pose: {x: 1, y: 2, yaw_deg: 0}\nversion: 1\n",
        "waypoints:\n\n # b\n -\n  pose:\n   x: 1\n   y: 2\n   yaw_deg: 0\n  name: >-\n   a\n",
        "---\nwaypoints: #\r\n  -   name:  'a'\r\n      pose: {x: 1, y: 2, yaw_deg: 0}\r\n...\n",
        "waypoints:\n  - {name: a, pose: {x: 1.0, y: 2.0,\n\n  # odd\n   yaw_deg: 0}}\n",
    ],
)
def test_other_layouts_of_yaml_say_the_same(text: str) -> None:
    (place,) = read(text).waypoints

    assert place.name == "a"
    assert place.pose == Pose(1.0, 2.0, 0.0)


def test_a_waypoint_after_a_comment_or_a_dash_in_a_text_is_not_cut_wrongly() -> None:
    first, second = read(
        """\
waypoints:
  - name: a
    description: |
      - name: not a waypoint

      # not a comment
    pose: {x: 0, y: 0, yaw_deg: 0}
    note: "- name: nor this
      - name: this"
# a comment
  # another
  - name: b
    pose: {x: 0, y: 0, yaw_deg: 0}
"""
    ).waypoints

    assert first.description == "- name: not a waypoint\n\n# not a comment"
    assert second.name == "b"


def test_peoples_own_keys_are_ignored_silently() -> None:
    places = read(
        """\
building: B7
waypoints:
  - name: a
    pose: {x: 0, y: 0, yaw_deg: 0}
    owner: night shift
    safety_landmarks: [{label: hose, inspected: {by: anna, on: [2026-01-01]}}]
"""
    )

    assert [place.name for place in places.waypoints] == ["a"]
    assert places.warnings == ()


def test_a_key_that_looks_misspelt_is_reported_with_its_line() -> None:
    places = read(
        """\
waypoints:
  - name: a
    pose: {x: 0, y: 0, yaw_deg: 0}
    decription: cold
    rooom_id: R1
    safety_landmarks: [{label: hose, range: 3, confidense: likely}]
"""
    )

    assert places.warnings == (
        'The key "decription" of "a" (line 2) is not used; \'description\' would be.',
        'The key "rooom_id" of "a" (line 2) is not used; \'room_id\' would be.',
        'The key "range" of "a" (line 2) is not used; \'range_m\' would be.',
        'The key "confidense" of "a" (line 2) is not used; \'confidence\' would be.',
    )


def test_many_misspelt_keys_are_counted() -> None:
    rows = (
        f"- {{name: {i}, pose: {{x: 0, y: 0, yaw_deg: 0}}, geometry_features: []}}"
        for i in range(9)
    )

    warnings = read("waypoints:\n" + "\n".join(rows)).warnings

    assert len(warnings) == 6
    assert warnings[-1] == "4 more keys look misspelt."


@pytest.mark.parametrize(
    ("line", "place", "reason"),
    [
        ("pose: {x: abc, y: 0, yaw_deg: 0}", "line 3, column 15", 'pose.x, "abc", is not a number'),
        ("pose: {x: .nan, y: 0, yaw_deg: 0}", "line 3, column 15", 'pose.x, ".nan", is not a num'),
        ("pose: {x: nan, y: 0, yaw_deg: 0}", "line 3, column 15", "is not a finite number"),
        ("pose: {x: 0, y: -inf, yaw_deg: 0}", "line 3, column 21", "is not a finite number"),
        ("pose: {x: 0, y: 0}", "line 3, column 11", "pose.yaw_deg is missing"),
        (
            "pose: {x: 0, y: 0, yaw: 1.57}",
            "line 3, column 29",
            'pose.yaw, "1.57", is not a key that belongs here. 1 more fault follows',
        ),
        ("pose: {x: 0, y: 0, yaw_deg: 0, z: 0}", "line 3, column 39", "pose.z"),
        ("pose: {x: 0, y: 0, yaw_deg: [0]}", "line 3, column 33", "pose.yaw_deg is not a number"),
        (
            "pose: {x: 0, y: 0, yaw_deg: 900}",
            "line 3, column 33",
            'pose.yaw_deg, "900", is not an angle from -360 to 360 degrees',
        ),
        ("pose: [1, 2, 3]", "line 3, column 11", "pose is not a mapping"),
        ("pose:", "line 3, column 10", "pose is not a mapping"),
        ("description: none", "line 2, column 5", "pose is missing"),
        (
            "pose: {x: 1,5, y: 1, yaw_deg: 0}",
            "line 3, column 19",
            "pose.5 is not a key that belongs here",
        ),
        ("pose: {x: 1, y: 1, x: 2, yaw_deg: 0}", "line 3, column 24", '"x" stands here twice'),
        ("pose: {x: 1, y: 1, yaw_deg: 0", "line 4, column 1", "not YAML"),
        ("\tpose: {x: 1, y: 1, yaw_deg: 0}", "line 3, column 5", "tab"),
        ("pose: &p {x: 1, y: *q, yaw_deg: 0}", "line 3, column 24", "no aliases, and *q is one"),
        ("? [a]\n    : b", "line 3, column 7", "A key is a list"),
    ],
)
def test_a_faulty_line_is_reported_with_its_place_and_an_example(
    line: str, place: str, reason: str
) -> None:
    message = fault(f"waypoints:\n  - name: dock\n    {line}\n")

    assert message.startswith(f"places.yaml, {place}: ")
    assert reason in message


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("name: ", "name is not text"),
        ("name: ' '", 'name, "", is empty'),
        ('name: "\\0"', "not at least one visible character"),
        ("name: [a]", "name is not text"),
        ("safety_landmarks: hose", 'safety_landmarks, "hose", is not a list'),
        ("safety_landmarks: [{purpose: x}]", "safety_landmarks.0.label is missing"),
        ("safety_landmarks: [{label: x, range_m: -1}]", 'range_m, "-1", is below zero'),
        ("safety_landmarks: [{label: x, bearing_deg: 400}]", '"400", is not an angle from -360'),
        ("safety_landmarks: [[a]]", "safety_landmarks.0 is not a mapping"),
        ("geometric_features: [{label: x}]", "geometric_features.0 is not text"),
        ("recorded_at: 2026-11-02 10:30", "is not a date and time with a time zone"),
        ("recorded_at: 9999-12-31T23:59:59+00:00", "before the year 9999"),
        ("stamp_s: now", 'stamp_s, "now", is not a number'),
        ("room_id: [R1]", "room_id is not text"),
        ("picture: {}", "picture is not text"),
        (
            "safety_landmarks: [{label: x, confidence: high}]",
            'confidence, "high", is none of certain, likely, unsure. Write it like `confidence: l',
        ),
        ("safety_landmarks: [{label: x, stamp_s: now}]", '0.stamp_s, "now", is not a number'),
    ],
)
def test_a_wrong_value_is_reported_with_what_is_expected(line: str, reason: str) -> None:
    key = line.partition(":")[0]
    lines = {"name": "name: dock", "pose": "pose: {x: 0, y: 0, yaw_deg: 0}", key: line}

    message = fault("waypoints:\n  - " + "\n    ".join(lines.values()) + "\n")

    assert reason in message
    assert f"line {2 + list(lines).index(key)}" in message or "visible" in message


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("version: 2\nwaypoints: []\n", 'line 1, column 10: version, "2", is not a version'),
        ("map: [a]\n", "line 1, column 6: map is not text"),
        ("waypoints: nothing\n", 'line 1, column 12: waypoints, "nothing", is not a list'),
        ("waypoints: {a: b}\n", "line 1, column 12: waypoints is not a list"),
        ("- name: a\n", "line 1, column 1: The file is not a mapping"),
        ("hello\n", "line 1, column 1: The file is not a mapping"),
        ("waypoints:\n  - hello\n", 'line 2, column 5: The record, "hello", is not a mapping'),
        ("waypoints:\n  -\n", "line 2"),
        (
            "a: 1\na: 2\n",
            'line 2, column 1: The key "a" stands here twice. The other one is on line 1',
        ),
        ("a: 1\n---\na: 2\n", "line 2, column 1: A second YAML document"),
        ("a: \x07\n", "line 1, column 4: This is not YAML: the character U+0007"),
        ("%YAML 1.9\n---\na: 1\n", "not YAML"),
        ('a: "\\UFFFFFFFF"\n', "not YAML"),
        ("a: " + "[" * 100_000, "nested more than 20 deep"),
        ("a: &a [x, x]\nb: &b [*a, *a]\n", "line 2, column 8: A semantic map has no aliases"),
        ("waypoints:\n  - name: 'a\n\n  - b\n", "line 2, column 11: This is not YAML"),
    ],
)
def test_a_faulty_file_is_reported(text: str, reason: str) -> None:
    assert reason in fault(text)


def test_keys_behind_the_records_are_reported_with_their_own_line() -> None:
    text = PAPERS_LAYOUT + "# end\nmap: other\n"

    assert (
        'line 12, column 1: The key "map" stands here twice. The other one is on line 3'
        in fault(text)
    )


def test_two_waypoints_of_one_name_are_reported_with_both_lines() -> None:
    pose = "    pose: {x: 0, y: 0, yaw_deg: 0}\n"

    message = fault(f"waypoints:\n  - name: Dock\n{pose}  - name: ' dock'\n{pose}")

    assert "line 4" in message
    assert 'Two waypoints are called "dock". The other one is on line 2.' in message


def test_an_event_without_an_id_gets_one_that_no_other_names() -> None:
    text = "events:\n  - text: wet\n  - text: dark\n  - {text: dry, id: E1}\n"

    document = parse_document(text.encode(), source="places.yaml")

    assert list(document.lists["events"]) == ["E2", "E3", "E1"]


def test_a_byte_that_is_not_utf_8_is_reported_with_its_line() -> None:
    with pytest.raises(SemanticMapError, match=r"places.yaml, line 2: byte 14 is not UTF-8"):
        parse_document(b"version: 1\na: \xe9\n", source="places.yaml")


def test_an_unchanged_record_is_not_read_again() -> None:
    before = parse_document(PAPERS_LAYOUT.encode(), source="places.yaml")
    more = PAPERS_LAYOUT + "  - {name: b, pose: {x: 0, y: 0, yaw_deg: 0}}\n"

    after = parse_document(more.encode(), source="places.yaml", previous=before)

    assert after.places.waypoints[0] is before.places.waypoints[0]
    assert len(after.lists["waypoints"]) == 2
