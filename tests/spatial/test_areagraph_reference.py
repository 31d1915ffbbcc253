import json
import re
from pathlib import Path

from mapspeak.spatial.areagraph.files import from_json, to_json, to_osm

REFERENCE = Path(__file__).parents[2] / "docs" / "reference" / "area-graph.md"


def example() -> str:
    (text,) = re.findall(r"```json\n(.*?)```", REFERENCE.read_text(encoding="utf-8"), re.DOTALL)
    return str(text)


def test_the_reference_shows_a_file_as_it_is_written() -> None:
    graph = from_json(example())

    assert to_json(graph) == example()


def test_the_reference_explains_every_key_of_areas_and_passages() -> None:
    text = REFERENCE.read_text(encoding="utf-8")
    explained = set(re.findall(r"`(\w+)`", text))

    document = json.loads(example())
    for entry in (*document["areas"], *document["passages"]):
        assert set(entry) <= explained


def test_the_reference_names_every_tag_of_osmag() -> None:
    tags = set(re.findall(r'k="(?!mapspeak:|type)([\w:]+)"', to_osm(from_json(example()))))

    assert all(f"`{tag}" in REFERENCE.read_text(encoding="utf-8") for tag in tags)
