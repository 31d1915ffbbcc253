"""A thing keeps its id over every end of the server, also while little of the map is seen."""

from dataclasses import replace
from pathlib import Path

import pytest
from mcp.client import Client

from fakes import FakeRobot, two_rooms
from mapspeak.memory import LaserFan, SemanticMapStore, Waypoint
from mapspeak.spatial import OccupancyGrid
from remembering import EXTINGUISHER, LADDER, look, looks_at
from served import connect, report_of, text_of

pytestmark = pytest.mark.anyio

TOOLSETS = ("places", "memory", "paper")
LOOKS = (
    look("west", 2.0, 1.0, ("ladder", LADDER), yaw_deg=180),
    *looks_at("fire extinguisher", EXTINGUISHER),
)


def _remember(folder: Path, *places: Waypoint) -> None:
    store = SemanticMapStore(folder / "semantic_map.yaml", map_id="two-rooms")
    for place in places:
        store.write(place)


def _west_room() -> OccupancyGrid:
    """Return the map before the robot has been in the east room."""
    grid = two_rooms()
    cells = grid.cells.copy()
    cells[:, 14:] = -1
    return replace(grid, cells=cells)


async def _ids(client: Client, name: str) -> set[str]:
    answer = report_of(await client.call_tool("find_place", {"query": name}))
    ids = (each["id"] for each in answer["candidates"] if each["name"] == name)
    return {each for each in ids if each.startswith("T")}


async def test_things_keep_their_ids_in_a_later_session_that_has_seen_less(tmp_path: Path) -> None:
    _remember(tmp_path, *LOOKS)
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        assert await _ids(client, "fire extinguisher") == {"T1"}
        assert await _ids(client, "ladder") == {"T2"}
    # Its name would come before that of the ladder.
    _remember(tmp_path, look("bin", 1.5, 1.4, ("bin", LADDER)))
    async with connect(FakeRobot(_west_room()), tmp_path) as client:
        assert await _ids(client, "ladder") == {"T2"}
        of_two_views = await _ids(client, "fire extinguisher")
        assert await _ids(client, "bin") | of_two_views == {"T1", "T3", "T4"}
        assert "T1" in of_two_views


async def test_an_id_of_views_that_are_of_another_thing_by_now_says_which(tmp_path: Path) -> None:
    _remember(tmp_path, *LOOKS)
    async with connect(FakeRobot(_west_room()), tmp_path) as client:
        assert len(await _ids(client, "fire extinguisher")) == 2
    async with connect(FakeRobot(two_rooms()), tmp_path) as client:
        (kept,) = await _ids(client, "fire extinguisher")
        (other,) = {"T1", "T2", "T3"} - await _ids(client, "ladder") - {kept}
        answer = await client.call_tool("describe_place", {"place": other})
    assert text_of(answer).startswith(f"{other} is {kept} now.")


async def test_a_thing_that_is_forgotten_leaves_its_id_to_none_and_has_it_back(
    tmp_path: Path,
) -> None:
    _remember(tmp_path, *LOOKS)
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=TOOLSETS) as client:
        (ladder,) = await _ids(client, "ladder")
        assert not (await client.call_tool("forget", {"what": ladder})).is_error
    _remember(tmp_path, look("bin", 1.5, 1.4, ("bin", LADDER)))
    async with connect(FakeRobot(two_rooms()), tmp_path, toolsets=TOOLSETS) as client:
        assert await _ids(client, "bin") == {"T3"}
        gone = text_of(await client.call_tool("describe_place", {"place": ladder}))
        assert gone.startswith(f"The thing {ladder} is no longer remembered.")
        again = {"what": "ladder", "undo": True}
        assert not (await client.call_tool("forget", again)).is_error
        assert await _ids(client, "ladder") == {ladder}


async def test_what_lies_off_the_map_so_far_is_where_its_record_has_it(tmp_path: Path) -> None:
    seen = ("fire extinguisher", EXTINGUISHER)
    by_range = look("east", 5.4, 1.5, seen, range_m=2.0)
    met = LaserFan.read("from -4.0 to 4.0 deg at 2.2 2.1 2.0 3.4 3.4 m")
    by_laser = replace(
        by_range,
        functional_landmarks=tuple(
            replace(each, range_m=None, laser=met) for each in by_range.functional_landmarks
        ),
    )
    for number, place in enumerate((by_range, by_laser)):
        folder = tmp_path / f"{number}"
        _remember(folder, place)
        grid = two_rooms()
        robot = FakeRobot(replace(grid, cells=grid.cells[:, :14].copy()))
        async with connect(robot, folder) as client:
            asked = {"query": "fire extinguisher"}
            found = report_of(await client.call_tool("find_place", asked))
            described = text_of(await client.call_tool("describe_place", {"place": "T1"}))
        (_, _, said) = found["advice"].partition("not sure: ")
        told = "he map does not show yet where it is; its record has it near "
        assert said.startswith(f"t{told}(7.40, 1.50).")
        assert f"T{told}7.40, 1.50." in described
        assert found["candidates"][0]["position"] is None
