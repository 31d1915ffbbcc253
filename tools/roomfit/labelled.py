"""Maps whose rooms are known: by people's hands, or because the building was drawn."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.rooms.drawn import draw_worlds, number_spaces
from benchmarks.rooms.people import read_classes
from mapspeak.simulator import TrueFloor
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.mapfiles import load_picture

Truth = NDArray[np.uint16]
DRAWN = "drawn"
_SAME_BUILDING = {
    "Freiburg101_scan": "freiburg_101",
    "freiburg_building101": "freiburg_101",
    "freiburg_building79": "freiburg_79",
    "lab_a_scan": "lab_a",
    "lab_c_scan": "lab_c",
    "lab_d_scan": "lab_d",
}
_ONE_BUILDING = {"rose2_partial_fr79": "freiburg_79", "gdc": "gdc"}


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LabelledMap:
    """A map and its rooms.

    Attributes:
        group: The set it belongs to.
        building: Maps of one building are fitted on together or left out together.
        truth: The number of the room of each cell of the grid; 0 where nobody said.
        classes: "room" or "hallway" of the rooms of which people said it.
    """

    grid: OccupancyGrid
    truth: Truth
    group: str
    name: str
    building: str
    classes: dict[int, str] = field(default_factory=dict)


def name_building(group: str, name: str) -> str:
    """Return the building that a map is of, which may stand in several sets."""
    return _ONE_BUILDING.get(group) or _SAME_BUILDING.get(name) or name.split("__", maxsplit=1)[0]


def read_maps(folders: Sequence[Path]) -> Iterator[LabelledMap]:
    """Read maps, each a folder with map.png, rooms.png and meta.json."""
    for folder in folders:
        meta = json.loads((folder / "meta.json").read_text())
        numbers = cv2.imread(str(folder / "rooms.png"), cv2.IMREAD_UNCHANGED)
        group = folder.parent.name
        yield LabelledMap(
            grid=load_picture(folder / "map.png", resolution_m=meta["resolution"]).grid,
            truth=np.asarray(numbers, np.uint16)[::-1],
            group=group,
            name=folder.name,
            building=name_building(group, folder.name),
            classes=read_classes(meta),
        )


def draw_maps(seed: int) -> list[LabelledMap]:
    """Draw a building of each style, and map it as a perfect robot would."""
    maps = []
    for world in draw_worlds([seed]):
        grid = TrueFloor(world).visible
        truth, _ = number_spaces(world, grid)
        maps.append(
            LabelledMap(
                grid=grid,
                truth=truth.astype(np.uint16),
                group=DRAWN,
                name=world.name,
                building=world.name,
            )
        )
    return maps
