"""Steps that scripts share: read tool answers as a model does, recall, drive to the end.

A language model looks at the picture itself. A script cannot, so it reads the reports of the
robot's detector (in the simulator: the *simulated detector*), filtered by the paper's policy.
"""

import io
import math
import re
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from PIL import Image

from mapspeak.errors import MapError
from mapspeak.evaluation.agent import ToolClient
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import UNKNOWN, OccupancyGrid

# --- reading -------------------------------------------------------------------------------------

UNKNOWN_GREY = 127

POSE = re.compile(r"Robot: x (-?[\d.]+), y (-?[\d.]+), yaw (-?[\d.]+) deg")
PLACEMENT = re.compile(
    r"has (\d+) px per cell of ([\d.]+) m; lower left corner at x (-?[\d.]+), y (-?[\d.]+)\."
)
HEADING = re.compile(r"^## (\w+)")


@dataclass(frozen=True, slots=True)
class Row:
    """One line of a table: its first column, and every column by its heading."""

    id: str
    cells: dict[str, str]

    def number(self, column: str) -> float:
        """Return a column as a number; infinite if the table has no value."""
        match = re.match(r"-?[\d.]+", self.cells[column])
        return float(match.group()) if match else math.inf

    def goal(self) -> Point:
        """Return where a frontier's row says to go."""
        x, y = self.cells["go to x, y"].split(",")[:2]
        return Point(float(x), float(y))


@dataclass(frozen=True, slots=True, kw_only=True)
class MapReading:
    """Content of the text of `look_at_map`.

    Attributes:
        tables: Rows by the name of their table: Rooms, Doors, Frontiers, Places.
    """

    pose: Pose
    tables: dict[str, tuple[Row, ...]]

    def rows(self, table: str) -> tuple[Row, ...]:
        """Return the rows of a table; none where it is not there."""
        return self.tables.get(table, ())


def read_map_text(text: str) -> MapReading:
    """Read what `look_at_map` answered.

    Raises:
        MapError: The text names no pose.
    """
    match = POSE.search(text)
    if match is None:
        raise MapError("The text names no robot pose.", hint="Give the text of look_at_map.")
    x, y, yaw_deg = (float(part) for part in match.groups())
    return MapReading(pose=Pose(x, y, math.radians(yaw_deg)), tables=_read_tables(text))


def _read_tables(text: str) -> dict[str, tuple[Row, ...]]:
    tables: dict[str, tuple[Row, ...]] = {}
    for block in re.split(r"^(?=## )", text, flags=re.MULTILINE):
        heading = HEADING.match(block)
        lines = [line for line in block.splitlines() if " | " in line]
        if heading is None or not lines:
            continue
        columns, *rows = ([part.strip() for part in line.split(" | ")] for line in lines)
        cells = (dict(zip(columns, row, strict=False)) for row in rows)
        tables[heading.group(1)] = tuple(Row(row[columns[0]], row) for row in cells)
    return tables


def read_map_picture(text: str, picture: bytes) -> OccupancyGrid:
    """Read the grid back from `subscribe_map_as_image`, by the grey levels of the paper's eq. 1.

    Raises:
        MapError: The text does not say where whole cells lie in the picture.
    """
    match = PLACEMENT.search(text)
    if match is None:
        raise MapError(
            "The text does not say how many pixels a cell has.",
            hint="A map of more than 1000 cells along a side is drawn smaller; read its file.",
        )
    n_pixels = int(match.group(1))
    resolution_m, x, y = (float(part) for part in match.groups()[1:])
    pixels = np.flipud(np.asarray(Image.open(io.BytesIO(picture)).convert("L")))
    grey = pixels[n_pixels // 2 :: n_pixels, n_pixels // 2 :: n_pixels].astype(np.int16)
    occupancy = np.rint(100 * (255 - grey) / 255).astype(np.int8)
    return OccupancyGrid(
        cells=np.where(grey == UNKNOWN_GREY, UNKNOWN, occupancy),
        resolution_m=resolution_m,
        origin=Pose(x, y),
    )


# --- the detector --------------------------------------------------------------------------------

SIGHTING = re.compile(
    r"^- (?P<label>[^,]+), (?P<bearing>[+-][\d.]+) deg, (?P<range>[\d.]+) m",
    re.MULTILINE,
)
TAKEN = re.compile(r"taken at x (-?[\d.]+), y (-?[\d.]+), yaw (-?[\d.]+) deg")
PASSED = re.compile(r"\w+ at x (-?[\d.]+), y (-?[\d.]+), yaw (-?[\d.]+) deg: (.+)")
"""One of the pictures that an exploration took on the way."""
CLEAR_RANGE_M = 6.0
"""Farther things are left to a waypoint that is nearer to them."""

SAFETY_WORDS = ("extinguisher", "first-aid", "first aid", "exit", "eye", "hose", "fire")
"""Fixed safety equipment, by the paper's first category."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectedThing:
    """One thing the detector reported; the bearing is from the robot's heading, left positive."""

    label: str
    bearing_deg: float
    range_m: float


UNDER_WAY = "Call look_at again"
"""Said in place of a picture while the robot is on its way to where it is taken."""
View = tuple[Pose, tuple[DetectedThing, ...]]
"""Where a picture was taken, and what the detector reports in it."""


def read_sightings(text: str) -> tuple[DetectedThing, ...]:
    """Read the detector's lines in the answer of `look_through_camera`, nearest first."""
    sightings = (
        DetectedThing(
            label=match["label"],
            bearing_deg=float(match["bearing"]),
            range_m=float(match["range"]),
        )
        for match in SIGHTING.finditer(text)
    )
    return tuple(sorted(sightings, key=lambda sighting: sighting.range_m))


def describe_view(name: str, place: str, sightings: tuple[DetectedThing, ...]) -> dict[str, Any]:
    """Return the arguments of `write_semantic_data` for what is seen from here."""
    clear = [sighting for sighting in sightings if sighting.range_m <= CLEAR_RANGE_M]
    names = ", ".join(dict.fromkeys(sighting.label for sighting in clear))
    seen = f"The simulated detector reports: {names}." if names else "Nothing it knows is near."
    landmarks: dict[bool, list[dict[str, Any]]] = {True: [], False: []}
    for thing in clear:
        landmarks[any(word in thing.label for word in SAFETY_WORDS)].append(asdict(thing))
    return {
        "name": name,
        "description": f"View from {place}. {seen}",
        "safety_landmarks": landmarks[True],
        "functional_landmarks": landmarks[False],
        "geometric_features": [f"stands in {place}"],
    }


# --- driving -------------------------------------------------------------------------------------

WAIT_S = 25.0
REGION = re.compile(r"\b[RCO]\d+\b")
FINAL_STATES = ("arrived", "blocked", "cancelled", "preempted", "rejected", "lost")
ARRIVED = "arrived"
REFUSED = "refused"


@dataclass(slots=True)
class ToolDriver:
    """Calls tools for a script.

    Attributes:
        wait_s: Longest wait of each call for the end of a drive, in robot time.
        sight_m: Range up to which it uses the detector's reports; 0 for a blind one.
        tells_ranges: It records how far things are; else in which direction alone.
    """

    tools: ToolClient
    wait_s: float = WAIT_S
    sight_m: float = math.inf
    tells_ranges: bool = True
    _n_views: int = 0

    async def is_offered(self, tool: str) -> bool:
        """Return True where the server offers a tool of that name."""
        return any(each.name == tool for each in await self.tools.list_tools())

    async def look(self) -> MapReading:
        """Read the map's tables."""
        return read_map_text((await self.tools.demand("look_at_map", full=True)).text)

    async def find_pose(self) -> Pose:
        """Return where the robot is."""
        robot = (await self.tools.demand("get_robot_pose")).report
        pose = robot.get("pose", robot)
        return Pose(pose["x"], pose["y"], math.radians(pose["yaw_deg"]))

    async def find_things(self, label: str) -> list[dict[str, Any]]:
        """Return the remembered things of a name, the nearest by path first."""
        found = (await self.tools.demand("find_place", query=label)).report["candidates"]
        things = [each for each in found if each["kind"] == "thing" and label in each["name"]]
        return sorted(things, key=lambda thing: math.inf if (m := thing["path_m"]) is None else m)

    async def recall(self, label: str) -> dict[str, Point]:
        """Return the remembered places, by id, from which something of a name was seen."""
        records: list[dict[str, Any]] = []
        while True:
            page = (await self.tools.demand("get_semantic_data", from_row=len(records))).report
            records += page["waypoints"]
            if not page["waypoints"] or len(records) >= page["n_places"]:
                break
        return {
            record["id"]: Point(record["pose"]["x"], record["pose"]["y"])
            for record in records
            for landmark in (*record["safety_landmarks"], *record["functional_landmarks"])
            if label in landmark["label"]
        }

    async def drive(self, **goal: object) -> str:
        """Drive to a `place`, or to `x`, `y` and perhaps `yaw_deg`; return how it ended."""
        answer = await self.tools.call("navigate_to", **goal, wait_s=self.wait_s)
        while not answer.is_error and answer.report["state"] not in FINAL_STATES:
            answer = await self.tools.call(
                "wait_for_goal", goal_id=answer.report["goal_id"], wait_s=self.wait_s
            )
        return REFUSED if answer.is_error else str(answer.report["state"])

    async def find_region(self, point: Point) -> str:
        """Return the id of the room, corridor or hall at a point; empty without one."""
        place = f"{point.x:.2f}, {point.y:.2f}"
        text = (await self.tools.demand("describe_place", place=place)).text
        # The first answer of a session says first what is remembered.
        said = next((line for line in text.splitlines() if " is at " in line), "")
        found = REGION.search(said)
        return found.group() if found else ""

    async def see(self) -> tuple[DetectedThing, ...]:
        """Take a picture and return what the detector reports of it."""
        return self.note((await self.tools.demand("look_through_camera")).text)

    def note(self, text: str) -> tuple[DetectedThing, ...]:
        """Return what the detector reports beside a picture, as far as this one sees."""
        return tuple(each for each in read_sightings(text) if each.range_m <= self.sight_m)

    async def look_with(self, tool: str, **arguments: object) -> list[View]:
        """Take pictures with a tool, at the end of its drive if any; return what they show."""
        text = (await self.tools.call(tool, **arguments)).text
        while UNDER_WAY in text:
            text = (await self.tools.call(tool, **arguments)).text
        parts = TAKEN.split(text)
        numbers = zip(parts[1::4], parts[2::4], parts[3::4], strict=True)
        return [
            (_read_pose(of_pose), self.note(rest))
            for of_pose, rest in zip(numbers, parts[4::4], strict=True)
        ]

    def read_passed(self, lines: Iterable[str]) -> list[View]:
        """Return what the detector reports in pictures that were taken on the way."""
        found = (PASSED.match(line) for line in lines)
        return [
            (_read_pose(match.groups()[:3]), self.note("- " + match[4].replace("; ", "\n- ")))
            for match in found
            if match is not None
        ]

    async def record(
        self,
        sightings: tuple[DetectedThing, ...],
        *,
        name: str = "view",
        taken_at: Pose | None = None,
    ) -> None:
        """Remember what is seen from here, or from elsewhere, under a name and a number."""
        if taken_at is not None:
            place = await self.find_region(taken_at.point)
        else:
            place = (await self.tools.demand("get_robot_pose")).report["place"]
        await self._record(sightings, place, name, taken_at)

    async def record_around(self) -> None:
        """Look to all sides, and remember what each picture shows."""
        views = await self.look_with("look_around")
        place = (await self.tools.demand("get_robot_pose")).report["place"]
        for pose, sightings in views:
            await self._record(sightings, place, "view", pose)

    async def _record(
        self, sightings: tuple[DetectedThing, ...], place: str, name: str, taken_at: Pose | None
    ) -> None:
        self._n_views += 1
        record = describe_view(f"{name} {self._n_views}", place, sightings)
        if not self.tells_ranges:
            for thing in (*record["safety_landmarks"], *record["functional_landmarks"]):
                del thing["range_m"]
        if taken_at is not None:
            record |= {"x": taken_at.x, "y": taken_at.y, "yaw_deg": taken_at.yaw_deg}
        await self.tools.demand("write_semantic_data", **record)


def _read_pose(numbers: Iterable[str]) -> Pose:
    x, y, yaw_deg = (float(number) for number in numbers)
    return Pose(x, y, math.radians(yaw_deg))


CUES = (
    ("hand-held device|water comes from the wall", "fire hose reel"),
    ("[Ff]ire|burning|puts it out|flames|smoulder", "fire extinguisher"),
    ("bandage|plaster|bleeding", "first-aid box"),
    ("leave the building|way outside", "exit sign"),
    ("[Aa]cid|rinsed", "eye wash station"),
    ("climb", "ladder"),
    ("battery|plugged in", "charging dock"),
    ("heavy load", "forklift"),
    ("write a letter", "desk"),
    ("files are kept", "filing cabinet"),
    ("lie down", "sofa"),
    ("sketch", "whiteboard"),
    ("on paper", "printer"),
    ("kept cold", "fridge"),
    ("hot drink", "coffee machine"),
    ("wash", "sink"),
    ("privacy", "toilet"),
    ("apple", "trash bin"),
)


def find_label(wish: str) -> str | None:
    """Return the thing that is meant; None where no word is known."""
    return next((label for words, label in CUES if re.search(words, wish)), None)
