"""A world with more things in it than its file says: written as a file of its own."""

import math
from collections.abc import Iterable
from pathlib import Path

from ruamel.yaml import YAML

from mapspeak.errors import ConfigError
from mapspeak.simulator.world import WorldObject
from mapspeak.simulator.worldfiles import read_world_text

__all__ = ["write_with_more"]


def write_with_more(name_or_path: str | Path, things: Iterable[WorldObject], path: Path) -> Path:
    """Writes a world file with some things added, and gives its path.

    Raises:
        ConfigError: The world is made from a map, which has no things.
    """
    yaml = YAML(typ="safe", pure=True)
    tree = yaml.load(read_world_text(name_or_path))
    if "image" in tree:
        raise ConfigError(
            f"{name_or_path} is a map: nothing can be put into it.", hint="Use a world file."
        )
    tree["objects"] = [*tree.get("objects", []), *map(_as_written, things)]
    with path.open("w", encoding="utf-8") as file:
        yaml.dump(tree, file)
    return path


def _as_written(thing: WorldObject) -> dict[str, object]:
    pose = thing.pose
    written: dict[str, object] = {
        "name": thing.name,
        "kind": thing.kind,
        "at": [pose.x, pose.y],
        "yaw_deg": math.degrees(pose.yaw_rad),
    }
    if thing.base_height_m is not None:
        written["base_height_m"] = thing.base_height_m
    return written
