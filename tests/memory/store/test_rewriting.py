import re
from difflib import ndiff

import pytest
from hypothesis import given, settings
from ruamel.yaml import YAML
from ruamel.yaml.tokens import ScalarToken

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory import Landmark, Waypoint
from mapspeak.memory.store.document import MapDocument, parse_document
from mapspeak.memory.store.records import data_of
from waypoints import waypoints

DOCK = Waypoint(
    name="dock corner",
    description="A corner beside the loading dock.",
    pose=Pose(1.2, -3.4, 1.5707963),
    safety_landmarks=(Landmark(label="fire extinguisher"),),
    geometric_features=("corner of two walls",),
)


def document(text: str) -> MapDocument:
    return parse_document(text.encode(), source="places.yaml")


def written(text: str, *places: Waypoint) -> str:
    changed = document(text)
    for place in places:
        changed = changed.with_record(place)
    return changed.text


def place(name: str, **more: object) -> Waypoint:
    return Waypoint(name=name, pose=Pose(1.0, 2.0, 0.0), **more)  # type: ignore[arg-type]


def comments(text: str) -> list[str]:
    """Gives the comments that are numbered; what a value says is no comment."""
    characters = list(text)
    for token in YAML(typ="safe", pure=True).scan(text):
        if isinstance(token, ScalarToken):
            begin, end = token.start_mark.index, token.end_mark.index
            if token.style in ("|", ">"):  # its first line may end with a comment
                begin = text.index("\n", begin)
            characters[begin:end] = " " * (end - begin)
    return sorted(re.findall(r"#\d+", "".join(characters)))


def test_the_first_waypoint_makes_the_file_of_the_paper() -> None:
    text = document("").bound_to("warehouse-3f9a").with_record(DOCK).text

    assert (
        text
        == """\
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
    )


def test_long_texts_and_landmarks_with_more_than_a_label_stand_below() -> None:
    tap = Landmark(label="tap", purpose="water, cold", bearing_rad=0.5, range_m=2.25)
    text = written("", place("hall", description="Long.\n\nWide.", functional_landmarks=(tap,)))

    assert (
        """\
    description: |-
      Long.

      Wide.
"""
        in text
    )
    assert (
        """\
    functional_landmarks:
      - {label: tap, bearing_deg: 28.65, range_m: 2.25, purpose: "water, cold"}
"""
        in text
    )


HAND_WRITTEN = """\
# places of the night shift #1
version: 1   #2
waypoints:   #3
  # by the gate #4

  - owner: anna    #5
    name: Dock   #6
    # pose: measured twice #7
    pose: {x: 1.0, y: 2, yaw_deg: 270}  #8
    safety_landmarks:   #9
      - exit sign  #10
      # between - the two #11
      - label: hose #12
        range_m: 3   #13
        inspected: 2026-01-02
      - 'alarm' #14
    functional_landmarks: [
        tap,   #15
        rack,
    ]   #16
    description: |   #17
      A hall.
    geometric_features: #18
    # end of Dock #19
# before Hall #20
  - {name: Hall, pose: {x: 0, y: 0, yaw_deg: 0}, lit: yes}  #21

tail: [1, 2]  #22
"""


def test_an_update_changes_its_values_and_nothing_else() -> None:
    update = Waypoint(
        name="dock",
        pose=Pose(1.0, 5.0, -1.5707963),
        description="A hall.",
        safety_landmarks=(
            Landmark(label="exit sign"),
            Landmark(label="hose", range_m=4.5),
            Landmark(label="alarm"),
        ),
        functional_landmarks=(Landmark(label="tap"), Landmark(label="rack")),
        geometric_features=("wide", "high"),
    )

    changed = written(HAND_WRITTEN, update)

    difference = ndiff(HAND_WRITTEN.splitlines(), changed.splitlines())
    assert [line for line in difference if line[:1] in "+-"] == [
        "-     name: Dock   #6",
        "+     name: dock  #6",
        "-     pose: {x: 1.0, y: 2, yaw_deg: 270}  #8",
        "+     pose: {x: 1.0, y: 5.00, yaw_deg: 270}  #8",
        "+       - {label: hose, range_m: 4.50, inspected: 2026-01-02}  #12  #13",
        "-       - label: hose #12",
        "-         range_m: 3   #13",
        "-         inspected: 2026-01-02",
        "-     geometric_features: #18",
        "+     geometric_features: [wide, high]  #18",
    ]


def test_landmarks_that_are_gone_leave_their_comments() -> None:
    changed = written(HAND_WRITTEN, place("Dock", functional_landmarks=(Landmark(label="rack"),)))

    assert comments(changed) == comments(HAND_WRITTEN)
    assert "inspected" not in changed
    assert "owner: anna    #5" in changed


def test_a_record_in_braces_stays_in_braces() -> None:
    changed = written(HAND_WRITTEN, place("Hall", geometric_features=("wide", "a, b")))

    assert (
        "  - {name: Hall, pose: {x: 1.00, y: 2.00, yaw_deg: 0}, lit: yes, geometric_features: "
        '[wide, "a, b"]}  #21\n' in changed
    )


def test_a_new_waypoint_stands_behind_the_last_one() -> None:
    changed = written(HAND_WRITTEN, place("Gate"))

    head, _, rest = changed.partition("lit: yes}  #21\n")
    assert head == HAND_WRITTEN.partition("lit: yes}  #21\n")[0]
    assert rest.startswith("  - name: Gate\n")
    assert rest.endswith("    geometric_features: []\n\ntail: [1, 2]  #22\n")


@pytest.mark.parametrize(
    "text",
    [
        "# mine\n",
        "# mine",
        "version: 1",
        "waypoints: []  # none yet\n",
        "waypoints:   # none yet\n\n# end\n",
        "map: a\nwaypoints: []\nmine: 3",
        "waypoints: null",
    ],
)
def test_a_waypoint_is_written_into_a_file_without_any(text: str) -> None:
    changed = document(written(text, DOCK, place("hall")))

    assert [place.name for place in changed.places.waypoints] == ["dock corner", "hall"]
    assert re.findall(r"#[^\n]*", changed.text) == (re.findall(r"#[^\n]*", text))


def test_line_ends_and_the_byte_order_mark_of_windows_stay() -> None:
    text = "\ufeffwaypoints:\r\n  - name: a  # mine\r\n    pose: {x: 0, y: 0, yaw_deg: 0}\r\n"

    content = document(text).with_record(place("a", description="A.\nB.")).content.decode()

    assert content.startswith("\ufeffwaypoints:\r\n  - name: a  # mine\r\n")
    assert content.count("\n") == content.count("\r\n") > 3


def test_lines_of_a_file_with_both_ends_end_as_most_did() -> None:
    text = "# mine\n# ours\nwaypoints: []\r\n"

    assert "\r" not in document(text).with_record(place("a")).content.decode()


@pytest.mark.parametrize(
    "text",
    [
        "waypoints: [{name: a, pose: {x: 1, y: 2, yaw_deg: 0}}]\n",
        '{"waypoints": []}\n',
        "{}\n",
        " waypoints:\n   - name: a\n     pose: {x: 1, y: 2, yaw_deg: 0}\n",
        "a: 1\n...\n",
    ],
)
def test_a_layout_that_cannot_be_written_to_is_refused(text: str) -> None:
    with pytest.raises(SemanticMapError, match=r"cannot write to it.*Nothing was written"):
        written(text, place("a", description="new"))


def test_the_map_is_named_without_moving_anything_else() -> None:
    for text, named in [
        ("waypoints: []\n", "map: b1\nwaypoints: []\n"),
        ("# mine\nmap:  # which?\nwaypoints: []\n", "# mine\nmap: b1  # which?\nwaypoints: []\n"),
        ("version: 1\n", "version: 1\nmap: b1\n"),
    ]:
        assert document(text).bound_to("b1").text == named


@settings(max_examples=40)
@given(waypoints(has_poses=True))
def test_any_waypoint_is_read_back_as_it_was_written(waypoint: Waypoint) -> None:
    document_ = document("").with_record(waypoint)

    (back,) = parse_document(document_.content, source="places.yaml").places.waypoints

    assert data_of(back) == data_of(waypoint)
    assert back.name == waypoint.name
    assert back.description == waypoint.description
    assert [mark.label for mark in back.landmarks] == [mark.label for mark in waypoint.landmarks]
    assert back.pose.point.distance_to(waypoint.pose.point) < 0.001


@settings(max_examples=25)
@given(waypoints(has_poses=True), waypoints(has_poses=True))
def test_any_update_keeps_comments_and_own_keys(first: Waypoint, second: Waypoint) -> None:
    changed = HAND_WRITTEN
    for update in (first, second):
        data = {name: getattr(update, name) for name in Waypoint.__slots__ if name != "name"}
        changed = written(changed, Waypoint(name="Dock", **data), Waypoint(name="Hall", **data))
        assert comments(changed) == comments(HAND_WRITTEN)
        assert "owner: anna" in changed
        assert "lit: yes" in changed


@settings(max_examples=25)
@given(waypoints(has_poses=True), waypoints(has_poses=True))
def test_what_mapspeak_wrote_can_be_updated_to_anything(first: Waypoint, second: Waypoint) -> None:
    once = document("").with_record(first)
    data = {name: getattr(second, name) for name in Waypoint.__slots__ if name != "name"}

    (back,) = once.with_record(Waypoint(name=first.name, **data)).places.waypoints

    assert data_of(back) == {**data_of(second), "name": first.name}


def test_a_pose_that_is_the_places_own_is_not_repeated() -> None:
    pose = Pose(3.0, 0.0, 0.0)
    tap = Landmark(label="tap", bearing_rad=0.5, pose=pose)
    dock = Waypoint(name="dock", pose=pose, functional_landmarks=(tap,))

    assert "seen_from" not in written("", dock)
