import base64
import io
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcp.client import Client
from PIL import Image

from drawing import grid_from_text
from fakes import FakeRobot, two_rooms
from mapspeak.cli.serving.command import serve
from mapspeak.geometry import Pose
from mapspeak.memory import SemanticMapStore
from mapspeak.server.app import build_server
from mapspeak.server.reports.representations import Representation
from mapspeak.session import Session
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.picture import draw_robot_pose
from served import MODES, connect, pictures_of, text_of

pytestmark = pytest.mark.anyio

ANSWERS_WITH_A_PICTURE = {
    Representation.PICTURE_TABLE: True,
    Representation.TABLE: False,
    Representation.PICTURE_ROOMS: True,
    Representation.PICTURE_NUMBERS: True,
    Representation.PAPER_PICTURE: True,
    Representation.RAW_GRID: False,
}


async def look(
    folder: Path,
    representation: Representation,
    *,
    grid: OccupancyGrid | None = None,
    mode: str = "auto",
    **arguments: object,
) -> tuple[str, bytes | None]:
    """Gives text and picture of one look at a map."""
    robot = FakeRobot(two_rooms() if grid is None else grid)
    async with connect(robot, folder, mode=mode, representation=representation) as client:
        result = await client.call_tool("look_at_map", arguments)
    assert not result.is_error, text_of(result)
    pictures = pictures_of(result)
    assert len(pictures) <= 1
    return text_of(result), base64.b64decode(pictures[0].data) if pictures else None


def grid_in(text: str) -> dict[str, Any]:
    """Reads the JSON at the end of an answer."""
    return dict(json.loads(text.splitlines()[-1]))


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("representation", Representation)
async def test_each_representation_says_where_the_robot_is(
    tmp_path: Path, representation: Representation, mode: str
) -> None:
    text, picture = await look(tmp_path, representation, mode=mode)
    assert re.search(r'x 1\.50, y 1\.40|"x":1\.5,"y":1\.4', text)
    assert (picture is not None) == ANSWERS_WITH_A_PICTURE[representation]
    assert len(text) < 20_000


async def test_nothing_said_is_the_picture_with_tables(tmp_path: Path) -> None:
    session = Session(
        FakeRobot(two_rooms()), SemanticMapStore(tmp_path / "memory.yaml"), lease_s=60.0
    )
    async with Client(build_server(session)) as client:
        usual = await client.call_tool("look_at_map", {})
    text, picture = await look(tmp_path, Representation.PICTURE_TABLE)
    assert text_of(usual) == text
    assert base64.b64decode(pictures_of(usual)[0].data) == picture


async def test_the_table_is_the_same_without_the_picture(tmp_path: Path) -> None:
    usual, _ = await look(tmp_path, Representation.PICTURE_TABLE)
    text, _ = await look(tmp_path, Representation.TABLE)
    assert usual.startswith(text.removesuffix("There is no picture."))


async def test_the_picture_with_rooms_is_the_same_without_tables(tmp_path: Path) -> None:
    _, usual = await look(tmp_path, Representation.PICTURE_TABLE)
    text, picture = await look(tmp_path, Representation.PICTURE_ROOMS)
    assert picture == usual
    assert " | " not in text


@pytest.mark.parametrize(
    "representation",
    [Representation.PICTURE_NUMBERS, Representation.PAPER_PICTURE, Representation.RAW_GRID],
)
async def test_what_shows_no_rooms_names_none(
    tmp_path: Path, representation: Representation
) -> None:
    text, picture = await look(tmp_path, representation)
    _, with_rooms = await look(tmp_path, Representation.PICTURE_ROOMS)
    assert not re.search(r"\b[RCDFW]\d", text)
    assert picture != with_rooms


async def test_the_papers_picture_is_the_one_its_tool_draws(tmp_path: Path) -> None:
    _, picture = await look(tmp_path, Representation.PAPER_PICTURE)
    assert picture == draw_robot_pose(two_rooms(), FakeRobot().pose).png


async def test_the_papers_picture_says_that_it_cannot_be_zoomed(tmp_path: Path) -> None:
    text, _ = await look(tmp_path, Representation.PAPER_PICTURE, around="robot")
    assert "always shows the whole map" in text


async def test_the_numbered_picture_can_be_zoomed(tmp_path: Path) -> None:
    text, picture = await look(tmp_path, Representation.PICTURE_NUMBERS, around="robot", radius_m=1)
    assert "x 0.5 to 2.5" in text
    assert max(Image.open(io.BytesIO(picture or b"")).size) <= 1000


async def test_a_small_grid_is_given_value_by_value(tmp_path: Path) -> None:
    text, _ = await look(tmp_path, Representation.RAW_GRID)
    given = grid_in(text)
    assert given["data"] == two_rooms().cells.tolist()
    assert (given["resolution_m"], given["n_rows"], given["n_cols"]) == (0.25, 11, 30)
    assert "coarser" not in text


async def test_a_grid_that_is_too_large_becomes_coarser_and_says_so(tmp_path: Path) -> None:
    cells = np.zeros((300, 400), dtype=np.int8)
    cells[:, 200] = 100
    cells[:, 300:] = -1
    cells[0, 399] = 0
    grid = OccupancyGrid(cells=cells, resolution_m=0.05, origin=Pose(-1.0, -2.0))
    text, _ = await look(tmp_path, Representation.RAW_GRID, grid=grid)
    given = grid_in(text)
    n_side = round(given["resolution_m"] / 0.05)
    assert f"{n_side} x {n_side} cells of 0.05 m" in text
    assert len(text) < 20_000
    assert {row[200 // n_side] for row in given["data"]} == {100}
    assert {row[0] for row in given["data"]} == {0}
    assert given["data"][1][-1] == -1
    assert given["origin"] == {"x": -1.0, "y": -2.0, "yaw_deg": 0.0}


async def test_a_zoomed_grid_lies_where_it_says(tmp_path: Path) -> None:
    grid = grid_from_text("####\n#..#\n#..#\n####")
    text, _ = await look(
        tmp_path, Representation.RAW_GRID, grid=grid, around="2.5, 2.5", radius_m=0.5
    )
    given = grid_in(text)
    assert given["data"] == [[0]]
    assert given["origin"] == {"x": 2.0, "y": 2.0, "yaw_deg": 0.0}


async def test_a_grid_zoomed_in_on_nothing_is_refused(tmp_path: Path) -> None:
    robot = FakeRobot(two_rooms())
    async with connect(robot, tmp_path, representation=Representation.RAW_GRID) as client:
        result = await client.call_tool("look_at_map", {"around": "80, 80", "radius_m": 1})
    assert result.is_error
    assert "No cell of the map" in text_of(result)


async def test_no_other_tool_changes(tmp_path: Path) -> None:
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        usual = await client.list_tools()
    for representation in Representation:
        async with connect(
            FakeRobot(two_rooms()), tmp_path, representation=representation
        ) as client:
            assert await client.list_tools() == usual


def test_the_commands_help_names_every_representation() -> None:
    option = next(each for each in serve.params if each.name == "representation")
    help_text = getattr(option, "help", "")
    assert all(each in help_text for each in Representation)
