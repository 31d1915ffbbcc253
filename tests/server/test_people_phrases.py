"""Places as people say them, through the tools: superlatives, several at once, looking back."""

import math
import re
from collections.abc import AsyncGenerator
from pathlib import Path
from typing import Any

import pytest
from mcp.client import Client

from drawing import grid_from_text
from fakes import FakeRobot
from guarding import make_guard
from mapspeak.geometry import Pose
from mapspeak.spatial import OccupancyGrid
from served import connect, report_of, text_of

pytestmark = pytest.mark.anyio

TOOLSETS = ("places", "drive", "routes", "memory", "paper")
FOUR_ROOMS = """
#############################################
#............#..............#...............#
#............#..............#...............#
#............#..............#...............#
#............#..............#...............#
#............#..............#...............#
#............#..............#...............#
######...#########...###########...##########
#...........................................#
#...........................................#
#...........................................#
#...........................................#
#############...#############################
            #.................#
            #.................#
            #.................#
            #.................#
            #.................#
            #.................#
            #.................#
            #.................#
            #.................#
            #.................#
            ###################
"""


def _four_rooms() -> OccupancyGrid:
    return grid_from_text(FOUR_ROOMS, resolution_m=0.25)


@pytest.fixture(name="client")
async def _client(tmp_path: Path) -> AsyncGenerator[Client]:
    robot = FakeRobot(_four_rooms(), pose=Pose(1.5, 4.5))
    guard = make_guard(tmp_path)
    async with connect(robot, tmp_path, toolsets=TOOLSETS, guard=guard) as client:
        yield client


async def _sizes(client: Client) -> list[str]:
    """Return the ids of the rooms as the table of sizes has them, smallest first."""
    text = text_of(await client.call_tool("measure", {}))
    rows = text.split("## Sizes, smallest first")[1].splitlines()
    return [row.split(" | ")[0] for row in rows if re.match(r"R\d+ \| \d", row)]


async def _ways(client: Client, places: list[str]) -> list[str]:
    text = text_of(await client.call_tool("measure", {"places": places}))
    rows = text.split("## Sizes")[0].splitlines()
    return [row.split(" | ")[0] for row in rows if re.match(r"[RCDOTW]\d+ \|", row)]


async def _goal(client: Client, place: str) -> dict[str, Any]:
    return report_of(await client.call_tool("check_goal", {"place": place}))


@pytest.mark.parametrize(
    ("words", "at"),
    [
        ("smallest room", 0),
        ("the second-smallest room", 1),
        ("third smallest room", 2),
        ("largest room", -1),
        ("the biggest room", -1),
        ("the second largest room", -2),
    ],
)
async def test_a_room_is_meant_by_its_size(client: Client, words: str, at: int) -> None:
    by_size = await _sizes(client)
    assert len(by_size) == 4
    text = text_of(await client.call_tool("measure", {"places": [words]}))
    assert f"\n{by_size[at]} | " in text
    assert (await _goal(client, words))["room"] == by_size[at]


async def test_the_answer_says_why_it_is_that_room(client: Client) -> None:
    smallest = (await _sizes(client))[0]
    text = text_of(await client.call_tool("measure", {"places": ["smallest room"]}))
    assert re.search(rf"{smallest} is the smallest of 4 rooms, \d+\.\d m2; then R\d, ", text)


async def test_a_rank_that_there_is_not_names_those_there_are(client: Client) -> None:
    answer = await client.call_tool("check_goal", {"place": "fifth-largest room"})
    assert answer.is_error
    assert "fourth-largest room" in text_of(answer)


async def test_the_farthest_of_a_kind_is_the_last_of_those_by_way(client: Client) -> None:
    doors = await _ways(client, ["all doors"])
    farthest = text_of(await client.call_tool("measure", {"places": ["farthest door"]}))
    assert f"{doors[-1]} is the farthest door of {len(doors)}" in farthest
    assert await _ways(client, ["the two nearest doors"]) == doors[:2]
    assert await _ways(client, ["second-nearest door"]) == doors[1:2]


async def test_what_is_read_off_the_map_is_told_also_where_a_memory_is_asked(
    client: Client,
) -> None:
    found = report_of(await client.call_tool("find_place", {"query": "the smallest room"}))
    assert re.fullmatch(
        r'"the smallest room" is R\d on the map. navigate_to and measure take such words.',
        found["advice"],
    )


async def test_who_speaks_of_doors_is_offered_no_place_whose_note_names_one(
    client: Client,
) -> None:
    await client.call_tool(
        "write_semantic_data", {"name": "shop", "description": "It has a door into the corridor."}
    )
    doors = {"places": ["doors into the corridor from the west"]}
    assert "is meant, use" not in text_of(await client.call_tool("measure", doors))


async def test_who_closes_a_remembered_place_hears_how_little_of_the_room_that_is(
    client: Client,
) -> None:
    where = {"x": 6.0, "y": 5.0, "yaw_deg": 0.0}
    described = {"name": "corridor", "description": "A wide corridor.", **where}
    await client.call_tool("write_semantic_data", described)
    corridor = report_of(await client.call_tool("check_goal", {"place": "corridor"}))["room"]
    closed = {"text": "wet paint", "place": "corridr", "effect": "closed"}
    told = text_of(await client.call_tool("note_event", closed))
    assert "0.5 m around corridor at 6.00, 5.00" in told
    assert f"not all of {corridor}: for all of it give {corridor} as place" in told


async def test_between_the_two_nearest_doors_is_between_these(client: Client) -> None:
    first, second, *_ = await _ways(client, ["all doors"])
    asked = await _goal(client, "between the two nearest doors")
    meant = await _goal(client, f"between {first} and {second}")
    assert asked["pose"] == meant["pose"]


@pytest.mark.parametrize("words", ["all rooms", "every room", "each of the rooms"])
async def test_all_rooms_are_measured_at_once(client: Client, words: str) -> None:
    assert sorted(await _ways(client, [words])) == sorted(await _sizes(client))


async def test_where_one_place_is_wanted_several_are_named(client: Client) -> None:
    answer = await client.call_tool("navigate_to", {"place": "all rooms"})
    assert answer.is_error
    assert "means 4 places" in text_of(answer)
    assert all(room in text_of(answer) for room in await _sizes(client))
    assert text_of(answer).endswith(" follow_route visits them all. measure compares them all.")


async def test_the_toolset_of_what_visits_several_is_named_where_it_is_not_offered(
    tmp_path: Path,
) -> None:
    robot = FakeRobot(_four_rooms(), pose=Pose(1.5, 4.5))
    async with connect(robot, tmp_path, toolsets=("drive",)) as client:
        answer = text_of(await client.call_tool("navigate_to", {"place": "all rooms"}))
    assert "To visit all: follow_route is not offered here." in answer
    assert "--toolsets +routes" in answer


async def test_a_drive_to_a_room_by_its_size_tells_it_with_its_name_and_the_next(
    client: Client,
) -> None:
    smallest, second, *_ = await _sizes(client)
    middle = (await _goal(client, smallest))["pose"]
    shop = {"name": "shop", "description": "", "x": middle["x"], "y": middle["y"]}
    await client.call_tool("write_semantic_data", shop)
    driven = report_of(await client.call_tool("navigate_to", {"place": "smallest room"}))
    asked = report_of(await client.call_tool("wait_for_goal", {}))
    size = r"\d+\.\d m2"
    said = f'{smallest}: the smallest of 4 rooms, {size}, with W1 "shop"; then {second}, {size}'
    assert re.fullmatch(said, driven["place"])
    assert asked["place"] == smallest


async def test_how_a_phrase_was_read_is_said_by_the_drive_and_not_again(client: Client) -> None:
    words = "between the two nearest doors"
    driven = report_of(await client.call_tool("navigate_to", {"place": words}))
    asked = report_of(await client.call_tool("wait_for_goal", {}))
    assert driven["place"].startswith(f"{words}: between D")
    assert asked["place"] == words


@pytest.mark.parametrize("words", ["shortest tour of all rooms", "eastern half of C1"])
async def test_what_shares_a_word_alone_is_not_offered_where_words_cannot_be_read(
    client: Client, words: str
) -> None:
    labels = ("fire extinguisher", "second copier", "meeting table")
    seen = [{"label": each, "bearing_deg": 90, "range_m": 0.6} for each in labels]
    hall = {"name": "hall", "description": "The eastern half of the hall, with copiers."}
    await client.call_tool("write_semantic_data", {**hall, "functional_landmarks": seen})
    found = report_of(await client.call_tool("find_place", {"query": words}))
    text = text_of(await client.call_tool("measure", {"places": [words]}))
    assert found["verdict"] not in ("found", "likely", "several")
    assert "is meant, use" not in text
    assert "Such words can be read: " in text


@pytest.mark.parametrize("words", ["things", "everything seen", "last ten minutes", "all"])
async def test_words_that_say_nothing_of_what_is_meant_find_nothing_and_sound_like_nothing(
    client: Client, words: str
) -> None:
    table = {"label": "meeting table", "bearing_deg": 90, "range_m": 0.6}
    hall = {"name": "hall", "description": "A hall.", "functional_landmarks": [table]}
    await client.call_tool("write_semantic_data", hall)
    answer = await client.call_tool("find_place", {"query": words})
    assert report_of(answer)["verdict"] == "not_remembered"
    assert "sounds like" not in text_of(answer)


async def test_several_of_a_name_are_told_apart_by_what_each_is_called(client: Client) -> None:
    for label, x in (("extinguisher 1", 2.0), ("extinguisher 2", 9.0)):
        thing = {"label": label, "bearing_deg": 90, "range_m": 0.6}
        place = {
            "name": label,
            "description": "",
            "functional_landmarks": [thing],
            "x": x,
            "y": 4.5,
        }
        await client.call_tool("write_semantic_data", place)
    text = text_of(await client.call_tool("navigate_to", {"place": "extinguisher"}))
    assert 'T1 "extinguisher 1" in ' in text
    assert 'T2 "extinguisher 2" in ' in text


async def test_a_route_past_all_rooms_goes_to_the_nearest_next(client: Client) -> None:
    rooms = await _sizes(client)
    answer = report_of(await client.call_tool("follow_route", {"stops": ["all rooms"]}))
    told = [*answer["done"], answer["next"], *answer["remaining"]]
    assert sorted(filter(None, told)) == sorted(rooms)
    assert len(answer["legs_m"]) == 4


async def test_a_room_without_a_way_is_left_out_of_all_rooms_and_told(client: Client) -> None:
    last = (await _ways(client, ["all rooms"]))[-1]
    closing = {"text": "painted", "place": last, "effect": "closed"}
    assert not (await client.call_tool("note_event", closing)).is_error
    answer = report_of(await client.call_tool("follow_route", {"stops": ["all rooms"]}))
    assert [each.split(":")[0] for each in answer["skipped"]] == [last]
    assert "closed by event E1" in answer["skipped"][0]


async def test_every_remembered_extinguisher_is_meant_at_once(client: Client) -> None:
    for name, x in (("west", 2.0), ("east", 9.0)):
        thing = {"label": "fire extinguisher", "bearing_deg": 90, "range_m": 0.6}
        place = {"name": name, "description": "", "safety_landmarks": [thing], "x": x, "y": 4.5}
        assert not (await client.call_tool("write_semantic_data", place)).is_error
    for words in ("every remembered extinguisher", "all fire extinguishers"):
        assert sorted(await _ways(client, [words])) == ["T1", "T2"]
    answer = report_of(
        await client.call_tool("follow_route", {"stops": ["every extinguisher"], "wait_s": 25})
    )
    told = [*answer["done"], answer["next"].split(":")[0], *answer["remaining"]]
    assert sorted(each.split(",")[0] for each in told if each) == ["T1", "T2"]


async def test_a_name_that_reads_like_all_of_a_kind_is_the_name(client: Client) -> None:
    place = {"name": "all rooms", "description": "A sign.", "x": 2.0, "y": 4.5}
    await client.call_tool("write_semantic_data", place)
    assert (await _goal(client, "all rooms"))["pose"]["x"] == 2.0


@pytest.mark.parametrize("words", ["looking back through its door", "facing its door"])
async def test_a_room_can_be_looked_back_out_of(client: Client, words: str) -> None:
    room = (await _sizes(client))[0]
    doors = await _ways(client, [f"all doors of {room}"])
    goal = await _goal(client, f"{room} {words}")
    assert (goal["room"], goal["verdict"]) == (room, "ok")
    facing = await _goal(client, f"{room} facing {doors[0]}")
    assert goal["pose"]["yaw_deg"] == pytest.approx(facing["pose"]["yaw_deg"], abs=15)
    assert math.isfinite(goal["path_m"])


async def test_who_looks_back_stands_straight_before_the_door(client: Client) -> None:
    for room in await _sizes(client):
        goal = await _goal(client, f"{room} looking back through its door")
        # All doors here are in walls from west to east.
        assert abs(goal["pose"]["yaw_deg"]) == pytest.approx(90, abs=15)


async def test_of_some_rooms_the_smallest_is_told_as_that_of_these(client: Client) -> None:
    first, second, *_ = await _sizes(client)
    one = text_of(await client.call_tool("measure", {"places": [second]}))
    two = text_of(await client.call_tool("measure", {"places": [first, second]}))
    assert f"The only room of these: {second} (" in one
    assert f"The smaller room of these is {first} (" in two


async def test_an_end_of_a_corridor_is_the_farther_one_unless_it_is_said_which(
    client: Client,
) -> None:
    corridor = (await _ways(client, ["largest corridor"]))[0]
    far, near, west = [
        (await _goal(client, f"{end} of {corridor}"))
        for end in ("the end", "near end", "the west end")
    ]
    assert near["pose"]["x"] < 3.0
    assert far["pose"]["x"] > 9.0
    assert west["pose"] == near["pose"]
    assert "farther one by path" in far["reason"]
    room = (await _sizes(client))[0]
    refused = await client.call_tool("check_goal", {"place": f"end of {room}"})
    assert f"the middle of {room}" in text_of(refused)


async def test_the_left_door_is_the_left_one_as_the_robot_sees_it(client: Client) -> None:
    corridor = (await _ways(client, ["largest corridor"]))[0]
    doors = await _ways(client, [f"all doors of {corridor}"])
    await client.call_tool("navigate_to", {"x": 5.5, "y": 3.5, "yaw_deg": 0})
    told = [
        text_of(await client.call_tool("measure", {"places": [words]}))
        for words in (f"left door of {corridor}", "the right hand door")
    ]
    left, right = re.findall(r"^(D\d+) is the (?:left|right) one", "\n".join(told), re.MULTILINE)
    await client.call_tool("turn", {"by_deg": 180})
    behind = text_of(await client.call_tool("measure", {"places": ["the left door"]}))
    assert {left, right} <= set(doors)
    assert left != right
    assert all("as seen from the robot, looking east" in each for each in told)
    assert "looking west" in behind
    assert f"{left} is the left one" not in behind


@pytest.mark.parametrize(
    ("words", "x"),
    [
        ("the south door of {}", 3.6),
        ("door in the southern wall of {}", 3.6),
        ("the west door of {}", 1.9),
        ("the door on the east side of {}", 8.4),
        ("door east of {}", 8.4),
    ],
)
async def test_a_door_is_meant_by_the_side_of_a_room_that_it_is_on(
    client: Client, words: str, x: float
) -> None:
    corridor = (await _ways(client, ["largest corridor"]))[0]
    goal = await _goal(client, words.format(corridor))
    assert goal["pose"]["x"] == pytest.approx(x, abs=0.6)


async def test_a_side_with_several_doors_or_none_is_told_with_the_ids_to_choose_from(
    client: Client,
) -> None:
    corridor = (await _ways(client, ["largest corridor"]))[0]
    doors = await _ways(client, [f"all doors of {corridor}"])
    room = (await _sizes(client))[0]
    several = text_of(await client.call_tool("check_goal", {"place": f"north door of {corridor}"}))
    assert "3 doors in the north" in several
    assert len(set(re.findall(r"D\d+", several)) & set(doors)) == 3
    none = text_of(await client.call_tool("check_goal", {"place": f"the north door of {room}"}))
    assert "no door in the north" in none
    assert re.search(r"D\d", none)


async def test_rooms_are_meant_by_how_many_doors_they_have(client: Client) -> None:
    assert sorted(await _ways(client, ["rooms with one door"])) == sorted(await _sizes(client))
    none = text_of(await client.call_tool("measure", {"places": ["rooms with two doors"]}))
    assert "No room has 2 doors" in none


@pytest.mark.parametrize("words", ["start", "where I started", "the starting point"])
async def test_start_is_where_the_robot_was_first(client: Client, words: str) -> None:
    began = (await _goal(client, "robot"))["pose"]
    await client.call_tool("navigate_to", {"place": "largest room"})
    back = report_of(await client.call_tool("navigate_to", {"place": words}))
    assert (back["robot"]["x"], back["robot"]["y"]) == (began["x"], began["y"])


@pytest.mark.parametrize("words", ["2 m to my left", "left of me"])
async def test_who_says_me_is_told_how_the_robot_is_meant(client: Client, words: str) -> None:
    answer = await client.call_tool("check_goal", {"place": words})
    assert "left of the robot" in text_of(answer)


@pytest.mark.parametrize(
    "words",
    [
        "the red door",
        "a quiet room",
        "somewhere to the left",
        "the biggest of them",
        "where the lift is",
        "every spaceship",
        "the north side of R2",
    ],
)
async def test_words_that_cannot_be_read_are_answered_with_phrases_that_can(
    client: Client, words: str
) -> None:
    place = {"name": "sink corner", "description": "A corner.", "x": 2.0, "y": 4.5}
    await client.call_tool("write_semantic_data", place)
    answer = await client.call_tool("check_goal", {"place": words})
    assert answer.is_error
    told = re.search(r"Such words can be read: (.+?)\.(?: |$)", text_of(answer))
    assert told is not None, text_of(answer)
    phrases = re.findall(r"'([^']+)'", told[1])
    assert 2 <= len(phrases) <= 3
    for phrase in phrases:
        assert not (await client.call_tool("measure", {"places": [phrase]})).is_error, phrase
