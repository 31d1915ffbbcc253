"""The page about world files says what is true."""

from pathlib import Path

from mapspeak.simulator import load_world, world_names
from mapspeak.simulator.worlds.models import find_kind, kind_names

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "world-files.md"


def line_that_starts_with(start: str) -> str:
    return next(line for line in PAGE.read_text("utf-8").splitlines() if line.startswith(start))


def test_the_example_is_a_world(tmp_path: Path) -> None:
    example = PAGE.read_text("utf-8").split("```yaml\n")[1].split("```")[0]
    path = tmp_path / "example.yaml"
    path.write_text(example, encoding="utf-8")

    assert [room.name for room in load_world(path).rooms] == ["workshop", "store"]


def test_every_kind_is_listed_where_it_belongs() -> None:
    hanging = line_that_starts_with("Kinds that hang")
    standing = line_that_starts_with("Kinds that stand")

    for kind in kind_names():
        assert (f"`{kind}`" in hanging) == find_kind(kind).is_wall_hung, kind
        assert (f"`{kind}`" in standing) != find_kind(kind).is_wall_hung, kind


def test_every_world_that_comes_with_mapspeak_is_named() -> None:
    named = line_that_starts_with("Give its path")

    assert all(f"`{name}`" in named for name in world_names())


def test_the_table_says_of_each_world_what_its_file_says() -> None:
    for name in world_names():
        assert line_that_starts_with(f"| `{name}` |") == f"| `{name}` | {load_world(name).title} |"
