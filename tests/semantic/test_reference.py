import re
from pathlib import Path

from mapspeak.semantic.mapfile import parse_document
from mapspeak.semantic.mapfile.schema import record_data

REFERENCE = Path(__file__).parents[2] / "docs" / "reference" / "semantic-map.md"


def test_the_reference_shows_a_file_that_is_read_without_a_warning() -> None:
    (example,) = re.findall(r"```yaml\n(.*?)```", REFERENCE.read_text(encoding="utf-8"), re.DOTALL)

    places = parse_document(example.encode(), source="semantic-map.md").to_map()

    assert [place.name for place in places.waypoints] == ["dock corner", "101"]
    assert places.warnings == ()


def test_the_reference_explains_every_key_of_a_waypoint() -> None:
    (example,) = re.findall(r"```yaml\n(.*?)```", REFERENCE.read_text(encoding="utf-8"), re.DOTALL)
    place = parse_document(example.encode(), source="semantic-map.md").to_map().waypoints[0]

    explained = set(
        re.findall(r"^\| `(\w+)` \|", REFERENCE.read_text(encoding="utf-8"), re.MULTILINE)
    )

    assert set(record_data(place)) <= explained
