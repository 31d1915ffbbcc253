import math

import pytest

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory import Confidence, Landmark, SemanticMap, Waypoint

HERE = Pose(1.0, 2.0, 0.5)


def test_a_name_and_a_pose_are_all_that_a_waypoint_needs() -> None:
    waypoint = Waypoint(name="dock", pose=HERE)

    assert waypoint.description == ""
    assert waypoint.landmarks == ()
    assert waypoint.geometric_features == ()


def test_landmarks_are_the_safety_ones_and_then_the_functional_ones() -> None:
    hose, tap = Landmark(label="fire hose"), Landmark(label="tap", purpose="water")

    waypoint = Waypoint(
        name="dock", pose=HERE, functional_landmarks=(tap,), safety_landmarks=(hose,)
    )

    assert waypoint.landmarks == (hose, tap)


def test_names_and_labels_are_one_line_without_unprintable_characters() -> None:
    waypoint = Waypoint(name=" dock\n\tcorner\x00\ud800 ", pose=HERE)

    assert waypoint.name == "dock corner"
    assert Landmark(label="exit\x1b[31m  sign").label == "exit [31m sign"


def test_a_description_keeps_its_lines() -> None:
    waypoint = Waypoint(name="dock", pose=HERE, description="\n A  corner.\r\n\n\tCold.\n\n")

    assert waypoint.description == "A corner.\n\nCold."


def test_an_empty_purpose_or_note_is_none() -> None:
    landmark = Landmark(label="tap", purpose=" ", note="")

    assert landmark.purpose is None
    assert landmark.note is None


def test_a_bearing_is_wrapped() -> None:
    bearing_rad = Landmark(label="tap", bearing_rad=math.radians(270)).bearing_rad

    assert bearing_rad == pytest.approx(math.radians(-90))


@pytest.mark.parametrize("name", ["", "  ", "\n", "\x00"])
def test_a_name_without_a_visible_character_is_refused(name: str) -> None:
    with pytest.raises(SemanticMapError, match="visible character"):
        Waypoint(name=name, pose=HERE)


def test_a_landmark_has_the_time_and_picture_of_its_waypoint_unless_it_says_its_own() -> None:
    tap = Landmark(label="tap", confidence=Confidence.LIKELY)
    sign = Landmark(label="exit sign", picture="P2.jpg")
    hose = Landmark(label="fire hose", stamp_s=3.0)
    waypoint = Waypoint(
        name="dock", pose=HERE, functional_landmarks=(tap,), stamp_s=9.0, picture="P1.jpg"
    )

    assert (waypoint.dated(tap).stamp_s, waypoint.dated(tap).picture) == (9.0, "P1.jpg")
    assert (waypoint.dated(sign).stamp_s, waypoint.dated(sign).picture) == (9.0, "P2.jpg")
    assert waypoint.dated(hose) == hose


def test_an_empty_room_or_picture_is_none() -> None:
    waypoint = Waypoint(name="dock", pose=HERE, room_id=" ", picture="\n")

    assert (waypoint.room_id, waypoint.picture) == (None, None)
    assert Landmark(label="tap", picture="").picture is None


def test_a_place_is_found_by_its_name_whatever_its_case_and_spaces() -> None:
    dock = Waypoint(name="Dock corner", pose=HERE)
    places = SemanticMap(waypoints=(Waypoint(name="hall", pose=HERE), dock))

    assert places.find_waypoint(" DOCK  Corner ") is dock
    assert places.find_waypoint("dock") is None
