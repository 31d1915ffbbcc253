# ruff: noqa: INP001 - a script beside the documents
"""Draws the maps of `docs/explanation/six-maps.md` as `look_at_map` shows them: `./run docs`.

The page and its pictures are written whole; what to check by eye stands here.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from benchmarks.look import draw_building
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMap
from mapspeak.server.reports.mappicture import draw_world
from mapspeak.server.text.world.look import MapLook, view_of
from mapspeak.server.text.world.tables import describe_world
from mapspeak.simulator import TrueFloor, load_world
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.mapfiles import load_map
from mapspeak.spatial.rooms import find_rooms
from mapspeak.worldmodel.model import WorldModel

ROOT = Path(__file__).parents[1]
PICTURES = ROOT / "docs" / "pictures"
PAGE = ROOT / "docs" / "explanation" / "six-maps.md"
MAPS = ROOT / "tests" / "maps"
RADIUS_M = 0.2

HEAD = """# Six maps, to check by eye

Each map is drawn as `look_at_map` draws it, with the text beside it: the same ids and facts.
All six go through one setting; nothing is tuned to any of them.
The robot in them has a radius of 0.2 m.
Written by `./run docs`.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Plate:
    """One map of the page.

    Attributes:
        name: Of its picture's file.
        title: Of its section.
        build: Gives the map.
        remark: Where it is from, and what to check.
    """

    name: str
    title: str
    build: Callable[[], OccupancyGrid]
    remark: str


def _plan(world: str) -> Callable[[], OccupancyGrid]:
    return lambda: TrueFloor(load_world(world)).visible


def _file(path: str) -> Callable[[], OccupancyGrid]:
    return lambda: load_map(MAPS / path).grid


PLATES = (
    Plate(
        name="plan-office",
        title="A plan: the office world",
        build=_plan("office"),
        remark="Drawn from the world file of the simulator, everything seen.\n"
        "Count the rooms off the corridor, and compare the smallest with its neighbours.",
    ),
    Plate(
        name="plan-warehouse",
        title="A plan: the warehouse world",
        build=_plan("warehouse"),
        remark="Drawn from the world file of the simulator: shelves in a hall are no rooms.",
    ),
    Plate(
        name="real-house",
        title="A flat, mapped by a TurtleBot 3",
        build=_file("aws_small_house/map.yaml"),
        remark="AWS RoboMaker's small house (MIT-0), mapped in simulation with its furniture.",
    ),
    Plate(
        name="real-freiburg",
        title="An office building, mapped by a real robot",
        build=_file("freiburg79/whole.yaml"),
        remark="Building 79 of the University of Freiburg, as published with ROSE2 (MIT).\n"
        "Furniture, glass and open doors are in the map as the laser saw them.",
    ),
    Plate(
        name="half-freiburg",
        title="The same building half-explored",
        build=_file("freiburg79/half.yaml"),
        remark="The same run, earlier.\n"
        "Each triangle is a frontier: it should stand on floor, in front of grey.",
    ),
    Plate(
        name="large",
        title="A large building: 4000 x 4000 cells, 200 x 200 m",
        build=lambda: draw_building(4000, seed=0),
        remark="Drawn by `benchmarks/look.py`: hundreds of furnished rooms, a third of it unseen.\n"
        "An overview; `around` and `radius_m` show any part of it under the same ids.",
    ),
)


def main() -> None:
    """Draws every map and writes the page."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    PAGE.write_text("\n".join([HEAD, *map(_section, PLATES)]), encoding="utf-8")


def _section(plate: Plate) -> str:
    grid = plate.build()
    world = WorldModel(grid, _stand(grid), SemanticMap(), radius_m=RADIUS_M)
    view = view_of(world, MapLook())
    picture = draw_world(view)
    (PICTURES / f"{plate.name}.png").write_bytes(picture.png)
    text = f"{describe_world(view)}\n\n{picture.caption}"
    return "\n".join(
        [
            f"## {plate.title}",
            "",
            plate.remark,
            "",
            f"![{plate.title}](../pictures/{plate.name}.png)",
            "",
            "<details><summary>The text beside it</summary>",
            "",
            "```",
            text,
            "```",
            "",
            "</details>",
            "",
        ]
    )


def _stand(grid: OccupancyGrid) -> Pose:
    """Return the middle of the largest region, looking along x."""
    largest = max(find_rooms(grid).regions, key=lambda region: region.floor_area_m2)
    return Pose(largest.widest.x, largest.widest.y, 0.0)


if __name__ == "__main__":
    main()
