"""The scripted mapspeak policy: every task from what tools answer, and nothing else."""

import math
import re
from collections.abc import Awaitable, Callable

from mapspeak.errors import MapspeakError
from mapspeak.evaluation.agent import (
    AgentEnd,
    Assignment,
    OutOfBudgetError,
    ToolClient,
    gave_up,
)
from mapspeak.evaluation.agents.driver import (
    ARRIVED,
    WAIT_S,
    MapReading,
    Row,
    ToolDriver,
    find_label,
)
from mapspeak.evaluation.agents.errands import do_errand
from mapspeak.evaluation.agents.inspecting import diagnose
from mapspeak.evaluation.trials import TrialState
from mapspeak.geometry import Point, wrap_angle
from mapspeak.places.standing import point_ahead

BESIDE_M = 1.5
"""Distance at which it stops before a thing that it has found by itself."""
NUMBER = r"-?\d+(?:\.\d+)?"
SIDES_DEG = {"to the left of": 90.0, "to the right of": -90.0, "in front of": 0.0, "behind": 180.0}
COMPASS_DEG = {"east": 0.0, "north": 90.0, "west": 180.0, "south": -90.0}
ASIDE_M = (1.2, 2.0, 3.0)
MOST_ASIDE = 3
MOST_TRIED = 3
MOST_LOOKS = 120
"""In one search: it looks on until all is seen."""
SEARCH = "search_for"

Deed = Callable[[ToolDriver, re.Match[str]], Awaitable[AgentEnd]]


async def follow_script(
    task: Assignment,
    tools: ToolClient,
    *,
    sight_m: float = math.inf,
    tells_ranges: bool = True,
) -> AgentEnd:
    """Read the prompt by its words and do what fits.

    Args:
        sight_m: Range up to which it uses the detector's reports; it reads all text.
        tells_ranges: It records how far things are, and checks what one look has shown; else it
            records directions alone, and takes the first drive to a thing for the last.
    """
    driver = ToolDriver(tools, sight_m=sight_m, tells_ranges=tells_ranges)
    try:
        for pattern, deed in DEEDS:
            match = re.search(pattern, task.prompt)
            if match is not None:
                return await deed(driver, match)
        label = find_label(task.prompt)
        if label is None:
            return gave_up("I know no word of this.")
        return await _go_to_thing(driver, label)
    except OutOfBudgetError:
        raise
    except MapspeakError as error:
        return gave_up(f"A tool did not give what I need: {error}")


# --- exploring -----------------------------------------------------------------------------------


MOST_STOPS = 200
LOOK_AROUND_EVERY_M = 4.0


async def _explore(driver: ToolDriver, _match: re.Match[str]) -> AgentEnd:
    """Let the robot explore until pictures show all walls, and record what is seen at each stop.

    Where it has not looked around near by it looks to all sides, for what no wall is behind.
    """
    looked_from: list[Point] = []
    state = ""
    for _ in range(MOST_STOPS):
        here = (await driver.find_pose()).point
        is_new = all(here.distance_to(place) >= LOOK_AROUND_EVERY_M for place in looked_from)
        if state != "driving" and is_new:
            looked_from.append(here)
            await driver.record_around()
        answer = await driver.tools.demand(
            "explore", cover="camera", stops_at_goals=True, wait_s=driver.wait_s
        )
        if answer.pictures:
            await driver.record(driver.note(answer.text))
        for pose, sightings in driver.read_passed(answer.report["on_the_way"]):
            await driver.record(sightings, taken_at=pose)
        state = answer.report["state"]
        if state not in ("driving", "at_goal"):
            break
    return AgentEnd(answer=f"I explored: {state}. {answer.report['reason']}")


# --- rooms ---------------------------------------------------------------------------------------


async def _go_to_room_by_size(driver: ToolDriver, match: re.Match[str]) -> AgentEnd:
    size = "-".join(filter(None, (match["ordinal"], match["end"])))
    return await _go_to_region(driver, f"{size} room")


async def _go_to_longest_corridor(driver: ToolDriver, _: re.Match[str]) -> AgentEnd:
    corridors = (await driver.look()).rows("Corridors")
    if not corridors:
        return gave_up("There is no corridor.")
    longest = max(corridors, key=lambda row: row.number("size m"))
    return await _go_to_region(driver, longest.id)


async def _go_to_region(driver: ToolDriver, place: str) -> AgentEnd:
    state = await driver.drive(place=place)
    return AgentEnd(answer=f"{place}: {state}.")


async def _go_by_note(driver: ToolDriver, match: re.Match[str]) -> AgentEnd:
    """Go by where a note says that a room lies, not by the id that it once had."""
    room = await driver.find_region(Point(float(match["x"]), float(match["y"])))
    return await _go_to_region(driver, room)


async def _go_into_room_around(driver: ToolDriver, match: re.Match[str]) -> AgentEnd:
    """Drive to a point of a room, else beside it; where no way leads there, say so."""
    middle = Point(float(match["x"]), float(match["y"]))
    if await driver.drive(x=middle.x, y=middle.y) == ARRIVED:
        return AgentEnd(answer="ANSWER: there")
    room = await driver.find_region(middle)
    aside = [
        point_ahead(middle, math.radians(heading_deg), away_m)
        for away_m in ASIDE_M
        for heading_deg in COMPASS_DEG.values()
    ]
    inside = [point for point in aside if await driver.find_region(point) == room]
    for point in inside[:MOST_ASIDE]:
        if await driver.drive(x=point.x, y=point.y) == ARRIVED:
            return AgentEnd(answer="ANSWER: there")
    return AgentEnd(answer="ANSWER: unreachable")


# --- things --------------------------------------------------------------------------------------


async def _go_to_thing(driver: ToolDriver, label: str) -> AgentEnd:
    """Drive up to the nearest remembered one; what one look has shown is checked."""
    if not driver.tells_ranges:
        return AgentEnd(answer=f"It {await driver.drive(place=f'nearest {label}')}.")
    for thing in (await driver.find_things(label))[:MOST_TRIED]:
        if await driver.drive(place=thing["id"]) != ARRIVED:
            continue
        if len(thing["seen_from"]) == 1:
            if not await _is_there(driver, thing["id"], label):
                continue
            await driver.drive(place=thing["id"])
        return AgentEnd(answer=f"I stand before {thing['id']}, a {label}.")
    return await _search(driver, label)


async def _is_there(driver: ToolDriver, thing: str, label: str) -> bool:
    """Look at a remembered thing from where it should be in view."""
    views = await driver.look_with("look_at", place=thing, wait_s=driver.wait_s)
    return any(label in sighting.label for _, sightings in views for sighting in sightings)


async def _search(driver: ToolDriver, label: str) -> AgentEnd:
    """Let the robot look about until the detector reports the thing, and goes there."""
    if not await driver.is_offered(SEARCH):
        return gave_up(f"I know no way to a {label}, and am offered no search.")
    bounds = {"thing": label, "max_looks": MOST_LOOKS, "wait_s": WAIT_S}
    answer = await driver.tools.call(SEARCH, **bounds)
    for _ in range(MOST_LOOKS):
        if answer.is_error:
            return gave_up(answer.text)
        found = [each for each in driver.note(answer.text) if label in each.label]
        if found:
            await driver.record(tuple(found), name=label)
            return await _approach(driver, label, found[0].bearing_deg, found[0].range_m)
        if answer.report["state"] not in ("driving", "look", "reported"):
            return gave_up(f"There is no {label} to be found: {answer.report['reason']}")
        more = {} if answer.report["state"] == "driving" else {"seen": False}
        answer = await driver.tools.call(SEARCH, **bounds, **more)
    return gave_up(f"I have looked long enough for a {label}.")


async def _approach(driver: ToolDriver, label: str, bearing_deg: float, range_m: float) -> AgentEnd:
    """End the search and drive up to what was seen; look again where it was far off."""
    await driver.tools.call(SEARCH, thing=label, seen=True)
    pose = await driver.find_pose()
    heading_rad = pose.yaw_rad + math.radians(bearing_deg)
    for left_m in (BESIDE_M, 2 * BESIDE_M, range_m / 2):
        if range_m <= left_m:
            break
        way = point_ahead(pose.point, heading_rad, range_m - left_m)
        yaw_deg = math.degrees(wrap_angle(heading_rad))
        if await driver.drive(x=way.x, y=way.y, yaw_deg=yaw_deg) == ARRIVED:
            break
    return AgentEnd(answer=f"I stand beside the {label}.")


# --- relations and routes ------------------------------------------------------------------------


async def _go_beside_pose(driver: ToolDriver, match: re.Match[str]) -> AgentEnd:
    heading_rad = math.radians(float(match["yaw"]) + SIDES_DEG[match["side"]])
    person = Point(float(match["x"]), float(match["y"]))
    goal = point_ahead(person, heading_rad, float(match["away"]))
    return AgentEnd(answer=f"It {await driver.drive(x=goal.x, y=goal.y)}.")


async def _go_beside_thing(driver: ToolDriver, match: re.Match[str]) -> AgentEnd:
    things = await driver.find_things(match["label"])
    if not things:
        return gave_up(f"I remember no {match['label']}.")
    heading_rad = math.radians(COMPASS_DEG[match["direction"]])
    goal = point_ahead(Point(*things[0]["position"]), heading_rad, float(match["away"]))
    return AgentEnd(answer=f"It {await driver.drive(x=goal.x, y=goal.y)}.")


async def _go_by_way(driver: ToolDriver, match: re.Match[str]) -> AgentEnd:
    return await _go_to_region(driver, f"{match['order']} {match['label']}")


async def _take_picture(driver: ToolDriver, match: re.Match[str]) -> AgentEnd:
    """Look at those that are remembered until one is seen."""
    for thing in (await driver.find_things(match["label"]))[:MOST_TRIED]:
        if await _is_there(driver, thing["id"], match["label"]):
            return AgentEnd(answer=f"The picture shows {thing['id']}.")
    return await _search(driver, match["label"])


async def _follow(driver: ToolDriver, match: re.Match[str]) -> AgentEnd:
    for label in re.findall(r"to any ([a-z -]+?)(?=, then|\.|$)", match.group()):
        end = await _go_to_thing(driver, label)
        if end.state is TrialState.GAVE_UP:
            return end
    return AgentEnd(answer="I have been everywhere.")


# --- questions ------------------------------------------------------------------------------------

POINT = re.compile(r"\((-?\d+\.\d+), (-?\d+\.\d+)\)")
UNTOLD = "The map does not say."
CHOICE = re.compile(r"\b([A-H]) \((-?\d+\.\d+), (-?\d+\.\d+)\)")


async def _answer_question(driver: ToolDriver, question: str) -> AgentEnd:
    """Answer a question in the form that it asks for."""
    if "drive next" in question:
        return await _say_where_to_explore(driver)
    if "have to drive" in question:
        return await _say_way(driver, question)
    region = await _region_at(driver, POINT.findall(question)[-1])
    if "lie in the same" in question:
        return await _choose(driver, question, {region})
    view = await driver.look()
    rows = (row for table in view.tables.values() for row in table if "floor m2" in row.cells)
    row = next((row for row in rows if row.id == region), None)
    if row is None:
        return gave_up(UNTOLD)
    doors = _ways_out(view, row)
    if "square metres" in question or "How many doors" in question:
        is_area = "square metres" in question
        return _answer(f"{row.number('free m2'):.1f} m2" if is_area else str(len(doors)))
    return await _choose(driver, question, {*doors.values()})


async def _choose(driver: ToolDriver, question: str, regions: set[str]) -> AgentEnd:
    """Answer with the letters of the points that lie in some regions."""
    letters = [
        letter
        for letter, x, y in CHOICE.findall(question)
        if await _region_at(driver, (x, y)) in regions
    ]
    return _answer(", ".join(sorted(letters)) or "none")


async def _say_where_to_explore(driver: ToolDriver) -> AgentEnd:
    frontiers = (await driver.look()).rows("Frontiers")
    if not frontiers:
        return gave_up(UNTOLD)
    x, y, *_ = frontiers[0].cells["go to x, y"].split(", ")
    return _answer(f"{x}, {y}")


async def _say_way(driver: ToolDriver, question: str) -> AgentEnd:
    x, y = POINT.findall(question)[0]
    text = (await driver.tools.demand("describe_place", place=f"{x}, {y}")).text
    match = re.search(r"is (\d+(?:\.\d+)?) m away by path", text)
    return gave_up(UNTOLD) if match is None else _answer(f"{match[1]} m")


async def _region_at(driver: ToolDriver, point: tuple[str, str]) -> str:
    return await driver.find_region(Point(float(point[0]), float(point[1])))


def _ways_out(view: MapReading, row: Row) -> dict[str, str]:
    """Return the doors that the robot can drive through, and where each leads."""
    closed = {door.id for door in view.rows("Doors") if door.cells["path m"].startswith("no way")}
    found = dict(re.findall(r"(D\d+)>(\w+)", row.cells["doors"]))
    return {door: there for door, there in found.items() if door not in closed}


def _answer(said: str) -> AgentEnd:
    return AgentEnd(answer=f"ANSWER: {said}")


# --- what is done for which words -----------------------------------------------------------------

BESIDE_POSE = (
    rf"stands at \((?P<x>{NUMBER}), (?P<y>{NUMBER})\) and looks along a yaw of "
    rf"(?P<yaw>{NUMBER}) deg\. Go to the place (?P<away>{NUMBER}) m "
    r"(?P<side>to the left of|to the right of|in front of|behind)"
)
DEEDS: tuple[tuple[str, Deed], ...] = (
    (r"^Inspect the robot's ROS\.", lambda driver, match: diagnose(driver.tools, match.string)),
    (r"^Errand, ", lambda driver, match: do_errand(driver, match.string, _search)),
    (r"Answer without driving\.", lambda driver, match: _answer_question(driver, match.string)),
    (r"^Update the map", _explore),
    (rf"around \((?P<x>{NUMBER}), (?P<y>{NUMBER})\) by its sketch", _go_by_note),
    (r"^Take a picture of any (?P<label>.+?) and stay", _take_picture),
    (r"^Go to the (?P<order>nearest|farthest) (?P<label>.+?), by the way", _go_by_way),
    (r"^Go to the (?:(?P<ordinal>\w+) )?(?P<end>smallest|largest) room", _go_to_room_by_size),
    (r"^Go to the longest corridor", _go_to_longest_corridor),
    (
        rf"^Go (?:in)?to the room around \((?P<x>{NUMBER}), (?P<y>{NUMBER})\)",
        _go_into_room_around,
    ),
    (
        r"^Find any (?P<label>.+?) and stop",
        lambda driver, match: _go_to_thing(driver, match["label"]),
    ),
    (BESIDE_POSE, _go_beside_pose),
    (
        rf"^Go to the place (?P<away>{NUMBER}) m (?P<direction>\w+) of the (?P<label>.+?)\.",
        _go_beside_thing,
    ),
    (
        r"^Go to the (?P<label>.+?), stop at most .* look straight",
        lambda driver, match: _go_to_thing(driver, match["label"]),
    ),
    (r"^Go first to any .+?\.", _follow),
)
