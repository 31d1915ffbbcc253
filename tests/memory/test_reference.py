import re
from datetime import UTC, datetime
from pathlib import Path

from mapspeak.geometry import Point
from mapspeak.memory.events import Effect, Event
from mapspeak.memory.store.document import parse_document
from mapspeak.memory.store.records import data_of

REFERENCE = Path(__file__).parents[2] / "docs" / "reference" / "semantic-map.md"


def test_the_reference_shows_a_file_that_is_read_without_a_warning() -> None:
    (example,) = re.findall(r"```yaml\n(.*?)```", REFERENCE.read_text(encoding="utf-8"), re.DOTALL)

    document = parse_document(example.encode(), source="semantic-map.md")
    places = document.places

    assert [getattr(each, "text", "") for each in document.records_of("events")] == [
        "painters at work"
    ]
    assert [place.name for place in places.waypoints] == ["dock corner", "101"]
    assert places.warnings == ()


def test_the_reference_explains_every_key_of_a_waypoint() -> None:
    (example,) = re.findall(r"```yaml\n(.*?)```", REFERENCE.read_text(encoding="utf-8"), re.DOTALL)
    place = parse_document(example.encode(), source="semantic-map.md").places.waypoints[0]

    explained = set(
        re.findall(r"^\| `(\w+)` \|", REFERENCE.read_text(encoding="utf-8"), re.MULTILINE)
    )

    assert set(data_of(place)) <= explained


def test_the_reference_explains_every_key_of_an_event() -> None:
    explained = set(
        re.findall(r"`(\w+)`(?:, `\w+`)? \|", REFERENCE.read_text(encoding="utf-8"), re.MULTILINE)
    )
    event = Event(
        id="E1",
        text="painters",
        place="C1",
        effect=Effect.CLOSED,
        at=Point(1.0, 2.0),
        outlines=((Point(0.0, 0.0), Point(1.0, 0.0), Point(1.0, 1.0)),),
        source="Ada",
        recorded_at=datetime(2026, 11, 22, tzinfo=UTC),
    )

    assert set(data_of(event)) <= explained
