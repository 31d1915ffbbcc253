"""Composed errands of the scripted policy: parse them into a mission and run it."""

import io
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
        label = part["label"]
        if label is not None and not await driver.find_things(label):
            await search(driver, label)
            await _note_found(driver, label)
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


async def _note_found(driver: ToolDriver, label: str) -> None:
    """Remember what is seen beside a thing, once the detector reports the thing itself."""
    seen = await driver.see()
    for _ in range(MOST_LOOKS - 1):
        if any(label in each.label for each in seen):
            break
        seen = await driver.see()
    await driver.record(seen)


async def _go(
    driver: ToolDriver, part: re.Match[str], *, has_shut_door: bool
) -> list[dict[str, Any]]:
    """Return the steps to a place; where a door may be shut, by the door, which is opened first."""
    if part["label"] is not None:
        return [{"drive": f"nearest {part['label']}"}]
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
