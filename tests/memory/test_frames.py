import math

import pytest

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory.events import Event
from mapspeak.memory.frames import Frames, MapFrame
from mapspeak.memory.store.document import MapDocument, parse_document

MOTION = Pose(3.0, -1.0, math.radians(40))
TURN = Pose(0.5, 2.0, math.radians(-70))
FRAMES = Frames(
    (MapFrame(id="F2"), MapFrame(id="F3"), MapFrame(id="F4", pose=TURN, reference="F3"))
)


def document_of(text: str) -> MapDocument:
    return parse_document(text.encode(), source="places.yaml")


def test_frames_of_which_nothing_is_known_have_no_transform() -> None:
    assert FRAMES.find_transform(of="F2", into=None) is None
    assert FRAMES.find_transform(of="F2", into="F2") == Pose(0.0, 0.0)
    assert FRAMES.find_transform(of="F9", into=None) is None


@pytest.mark.parametrize(("of", "into"), [("F4", "F2"), ("F2", "F4"), ("F4", None), (None, "F4")])
def test_all_that_lie_in_each_other_follow_one_relation(of: str | None, into: str | None) -> None:
    aligned = FRAMES.aligned(of, into, motion=MOTION)

    _assert_close(aligned.find_transform(of=of, into=into), MOTION)
    _assert_close(aligned.find_transform(of=into, into=of), MOTION.inverse())
    _assert_close(aligned.find_transform(of="F4", into="F3"), TURN)


def test_frames_that_lie_in_each_other_in_a_ring_lie_nowhere() -> None:
    ring = Frames(
        (MapFrame(id="F2", pose=TURN, reference="F3"), MapFrame(id="F3", pose=TURN, reference="F2"))
    )

    assert ring.find_transform(of="F2", into=None) is None


def test_a_frame_that_the_file_says_nothing_of_cannot_be_aligned() -> None:
    with pytest.raises(SemanticMapError, match="F9"):
        FRAMES.aligned("F9", None, motion=MOTION)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "# mine\nmap: house\nwaypoints:\n  - name: dock\n    pose: {x: 1, y: 2, yaw_deg: 0}\n",
        "frames:\n  - id: F2  # the attic\nwaypoints: []\n",
        "waypoints: []\nevents:\n  - {text: wet}\n",
    ],
)
def test_frames_are_written_beside_what_people_wrote(text: str) -> None:
    document = document_of(text)
    frames = Frames(
        (MapFrame(id="F2", map_id="house", pose=TURN), MapFrame(id="F3", walls="map-3.yaml"))
    )

    written = document
    for frame in frames.items:
        written = written.with_record(frame)
    moved = written.frames.changed("F3", pose=MOTION, reference="F2")
    again = written.with_record(moved.by_id["F3"])

    assert [each.id for each in again.frames.items] == ["F2", "F3"]
    _assert_close(again.frames.by_id["F2"].pose, TURN)
    _assert_close(again.frames.by_id["F3"].pose, MOTION)
    assert again.places.waypoints == document.places.waypoints
    for line in text.splitlines():
        for words in line.replace("[]", "").split("  "):
            assert words in again.text


def test_records_and_events_name_the_frame_that_they_were_made_in() -> None:
    text = (
        "waypoints:\n  - {name: a, pose: {x: 1, y: 2, yaw_deg: 0}, frame: F2}\n"
        "events:\n  - {text: wet, frame: F2}\n"
    )
    document = document_of(text)
    waypoint, event = document.places.waypoints[0], document.find("events", "E1")

    assert waypoint.frame == "F2"
    assert isinstance(event, Event)
    assert event.frame == "F2"
    copied = document_of("").with_record(waypoint).with_record(event)
    assert copied.places.waypoints == (waypoint,)
    assert copied.find("events", "E1") == event


@pytest.mark.parametrize(
    "frames",
    [
        "F2",
        "[{id: F2, pos: 3}]",
        "[{id: F2}, {id: F2}]",
        "[{map: house}]",
        "[{id: a b}]",
        "[{id: F2, pose: {x: 1, y: .nan, yaw_deg: 0}}]",
    ],
)
def test_mistakes_in_frames_are_told_with_their_line(frames: str) -> None:
    with pytest.raises(SemanticMapError, match="line 2, column"):
        document_of(f"# mine\nframes: {frames}\n")


def _assert_close(pose: Pose | None, to: Pose) -> None:
    assert pose is not None
    # Millimetres and fractions of a degree are what the file holds.
    assert pose.point.distance_to(to.point) < 0.002
    assert math.isclose(pose.yaw_rad, to.yaw_rad, abs_tol=1e-5)
