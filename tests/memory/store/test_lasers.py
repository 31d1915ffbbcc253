"""What a laser met, in the file: read, written, moved, and told wrongly by hand."""

import math

import pytest

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory import Landmark, LaserFan, Waypoint
from mapspeak.memory.store.cutting import read_plain_record
from mapspeak.memory.store.document import MapDocument, parse_document

FAN = "from -4.0 to 4.0 deg at 2.2 2.1 - >20 3.4 m"
FILE = f"""\
waypoints:
  - name: hall
    pose: {{x: 1.00, y: 2.00, yaw_deg: 90.0}}
    functional_landmarks:
      - {{label: tap, bearing_deg: 0.0, laser: {FAN}}}  # from the dock
      - {{label: sink, bearing_deg: 20.0}}
"""


def document(text: str) -> MapDocument:
    return parse_document(text.encode(), source="places.yaml")


def read(text: str) -> Waypoint:
    (place,) = document(text).places.waypoints
    return place


def test_what_a_laser_met_is_read_and_is_left_open_where_nothing_says() -> None:
    tap, sink = read(FILE).landmarks
    assert tap.laser == LaserFan.read(FAN)
    assert sink.laser is None


def test_what_a_laser_met_is_written_on_the_line_of_its_landmark_and_read_quickly() -> None:
    tap = Landmark(label="tap", bearing_rad=0.0, laser=LaserFan.read(FAN))
    place = Waypoint(name="hall", pose=Pose(1.0, 2.0), functional_landmarks=(tap,))
    text = document("").with_record(place).text
    assert f"- {{label: tap, bearing_deg: 0.0, laser: {FAN}}}\n" in text
    assert read(text).landmarks == (tap,)
    assert read_plain_record(text[text.index("  - name") :]) is not None


def test_a_record_written_again_keeps_its_line_and_the_comment_on_it() -> None:
    before = read(FILE)
    after = Waypoint(
        name="hall",
        pose=before.pose,
        description="A hall.",
        functional_landmarks=before.functional_landmarks,
    )
    text = document(FILE).with_record(after).text
    assert f"- {{label: tap, bearing_deg: 0.0, laser: {FAN}}}  # from the dock\n" in text


def test_ranges_are_the_same_on_a_map_that_has_moved() -> None:
    (place,) = document(FILE).places.waypoints
    place = place.moved(Pose(3.0, -1.0, math.radians(40)))
    assert place.pose.yaw_deg == pytest.approx(130.0)
    assert place.landmarks[0].laser == LaserFan.read(FAN)


@pytest.mark.parametrize(
    ("laser", "reason"),
    [
        ("2.15 2.13", "should be like 'from"),
        ("from -4.0 to 4.0 deg at 2.15 far m", "beam 2 should be metres"),
        ("from 4.0 to -4.0 deg at 2.15 2.13 m", "from right to left"),
        ("[2.15, 2.13]", "no line of text"),
    ],
)
def test_a_mistake_by_hand_is_refused_with_line_reason_and_example(laser: str, reason: str) -> None:
    with pytest.raises(SemanticMapError) as raised:
        document(FILE.replace(FAN, laser))
    assert "places.yaml, line 5, column 47: functional_landmarks.0.laser" in raised.value.message
    assert reason in raised.value.message
    assert "laser: from -4.0 to 4.0 deg at" in raised.value.hint
