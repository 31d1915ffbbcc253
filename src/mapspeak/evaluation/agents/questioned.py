"""The scripted policy's answers to questions, read from tables and descriptions."""

import re

from mapspeak.evaluation.driver import ToolDriver, gave_up
from mapspeak.evaluation.reading import MapReading, Row
from mapspeak.evaluation.trials import AgentEnd
from mapspeak.geometry import Point

POINT = re.compile(r"\((-?\d+\.\d+), (-?\d+\.\d+)\)")
UNTOLD = "The map does not say."
CHOICE = re.compile(r"\b([A-H]) \((-?\d+\.\d+), (-?\d+\.\d+)\)")


async def answer_question(driver: ToolDriver, question: str) -> AgentEnd:
    """Answer a question in the form that it asks for."""
    if "drive next" in question:
        return await _say_where_to_explore(driver)
    if "have to drive" in question:
        return await _say_way(driver, question)
    view = await driver.look()
    choices = {letter: (x, y) for letter, x, y in CHOICE.findall(question)}
    asked = next(reversed(POINT.findall(question)))
    region = await _region_at(driver, asked)
    row = _row_of(view, region)
    if row is None:
        return gave_up(UNTOLD)
    if "square metres" in question:
        return _answer(f"{row.number('free m2'):.1f} m2")
    doors = _ways_out(view, row)
    if "How many doors" in question:
        return _answer(str(len(doors)))
    beside = [
        letter
        for letter, point in choices.items()
        if await _region_at(driver, point) in doors.values()
    ]
    return _answer(", ".join(sorted(beside)) or "none")


async def _say_where_to_explore(driver: ToolDriver) -> AgentEnd:
    frontiers = (await driver.look()).rows("Frontiers")
    if not frontiers:
        return gave_up(UNTOLD)
    x, y, *_ = frontiers[0].cells["go to x, y, yaw"].split(", ")
    return _answer(f"{x}, {y}")


async def _say_way(driver: ToolDriver, question: str) -> AgentEnd:
    x, y = next(iter(POINT.findall(question)))
    text = (await driver.tools.demand("describe_place", place=f"{x}, {y}")).text
    match = re.search(r"is (\d+(?:\.\d+)?) m away by path", text)
    return gave_up(UNTOLD) if match is None else _answer(f"{match[1]} m")


async def _region_at(driver: ToolDriver, point: tuple[str, str]) -> str:
    return await driver.find_region(Point(float(point[0]), float(point[1])))


def _row_of(view: MapReading, region: str) -> Row | None:
    rows = [row for table in view.tables.values() for row in table]
    return next((row for row in rows if row.id == region and "floor m2" in row.cells), None)


def _ways_out(view: MapReading, row: Row) -> dict[str, str]:
    """Return the doors that the robot can drive through, and where each leads."""
    closed = {door.id for door in view.rows("Doors") if door.cells["path m"].startswith("no way")}
    found = dict(re.findall(r"(D\d+)>(\w+)", row.cells["doors"]))
    return {door: there for door, there in found.items() if door not in closed}


def _answer(said: str) -> AgentEnd:
    return AgentEnd(answer=f"ANSWER: {said}")
