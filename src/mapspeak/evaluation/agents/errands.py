"""Composed errands of the scripted policy: parse them into a mission and run it."""

import io
import math
import re
from collections.abc import Awaitable, Callable
from typing import Any

from ruamel.yaml import YAML

from mapspeak.evaluation.agent import AgentEnd, gave_up
from mapspeak.evaluation.agents.driver import ToolDriver
from mapspeak.geometry import Point

PLACE = re.compile(
    r"[Gg]o to the (?:space around \((?P<x>-?[\d.]+), (?P<y>-?[\d.]+)\)|nearest (?P<label>[^.]+?)) "
    r'and say "(?P<words>[^"]+)" there'
)
LOW = re.compile(r"battery is below (\d+) %.+ to (\d+) % before", re.DOTALL)
STATE = re.compile(r"\): (\w+) after")
WITHIN_MIN = 50.0
Search = Callable[[ToolDriver, str], Awaitable[AgentEnd]]
MOST_WAITS = 150
SPEAK_TRIES = 3
MOST_TRIED = 3
SAME_M = 2.5
"""What is seen so near to where a thing was noted is that thing: one look places it roughly."""
MOST_LOOKS = 3
"""A detector misses one thing in five."""
DOCK = "nearest charging dock"


async def do_errand(driver: ToolDriver, errand: str, search: Search) -> AgentEnd:
    """Run an errand as one mission, and return how that ended.

    Args:
        search: Finds a thing that is not remembered, and drives to it.
    """
    steps: list[Any] = []
    if low := LOW.search(errand):
        charge = {"sequence": [{"drive": DOCK}, {"dock": float(low[2])}]}
        is_charged = {"check": {"battery_above": float(low[1]) / 100}}
        steps.append({"fallback": [is_charged, charge]})
    for part in PLACE.finditer(errand):
        if part["label"] is not None:
            steps.append({"drive": await _find(driver, part["label"], search)})
        else:
            steps += await _go(driver, part, has_shut_door="door that is shut" in errand)
        steps.append({"retry": SPEAK_TRIES, "do": [{"speak": part["words"]}]})
    tree = io.StringIO()
    YAML(typ="safe", pure=True).dump(steps, tree)
    run = await driver.tools.demand(
        "run_mission", tree=tree.getvalue(), within_min=WITHIN_MIN, wait_s=driver.wait_s
    )
    said = run.text
    for _ in range(MOST_WAITS):
        state = STATE.search(said)
        if state is None:
            return gave_up(said)
        if state[1] != "running":
            return AgentEnd(answer=f"The mission {state[1]}.")
        said = (await driver.tools.demand("skill_status", wait_s=driver.wait_s)).text
    return gave_up("The mission does not end.")


async def _find(driver: ToolDriver, label: str, search: Search) -> str:
    """Return the nearest thing that two looks have shown; search where none is to be seen."""
    found = await _find_known(driver, label)
    if found is None:
        await search(driver, label)
        found = await _find_known(driver, label)
    return found or f"nearest {label}"


async def _find_known(driver: ToolDriver, label: str) -> str | None:
    """Return the nearest remembered thing that is there; look at one that one look has shown."""
    for thing in (await driver.find_things(label))[:MOST_TRIED]:
        if len(thing["seen_from"]) > 1 or thing["position"] is None:
            return str(thing["id"])
        at = Point(*thing["position"])
        place = await _see_again(driver, label, thing["id"], near=at)
        if place is not None and place.distance_to(at) <= SAME_M:
            return await _find_at(driver, label, place)
    return None


async def _see_again(driver: ToolDriver, label: str, thing: str, *, near: Point) -> Point | None:
    """Look at a thing until the detector reports it, at last to all sides.

    Remember all of its kind that are seen, and return where the one is that is nearest to a point.
    """
    looks: list[tuple[str, dict[str, Any]]] = [
        ("look_at", {"place": thing, "wait_s": driver.wait_s}),
        *[("look_through_camera", {})] * (MOST_LOOKS - 1),
        ("look_around", {}),
    ]
    for tool, look in looks:
        places = []
        for pose, sightings in await driver.look_with(tool, **look):
            if seen := tuple(each for each in sightings if label in each.label):
                await driver.record(seen, name=label, taken_at=pose)
                places += [
                    pose.point_at(math.radians(each.bearing_deg), each.range_m) for each in seen
                ]
        if places:
            return min(places, key=near.distance_to)
    return None


async def _find_at(driver: ToolDriver, label: str, place: Point) -> str:
    """Return the id of the remembered thing that lies nearest to a place."""
    things = [each for each in await driver.find_things(label) if each["position"]]
    things.sort(key=lambda each: Point(*each["position"]).distance_to(place))
    return str(things[0]["id"]) if things else f"nearest {label}"


async def _go(
    driver: ToolDriver, part: re.Match[str], *, has_shut_door: bool
) -> list[dict[str, Any]]:
    """Return the steps to a point; where a door may be shut, by the door, which is opened first."""
    point = Point(float(part["x"]), float(part["y"]))
    goal = {"drive": f"{point.x:.2f}, {point.y:.2f}"}
    if not has_shut_door:
        return [goal]
    region = await driver.find_region(point)
    rows = (await driver.look()).rows("Doors")
    doors = [row.id for row in rows if re.search(rf"\b{region}\b", row.cells["joins"])]
    open_each: list[dict[str, Any]] = [
        {"sequence": [{"drive": f"in front of {door}"}, "open_door"]} for door in doors
    ]
    return [{"fallback": [*open_each, {"wait": 1}]}, goal]
