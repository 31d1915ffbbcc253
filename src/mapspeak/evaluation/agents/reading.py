"""What tools answer, read by scripts as a model does: tables, pose, the picture's scale, sightings.

A language model looks at the picture itself. A script cannot, so it reads what the robot's detector
(in the simulator: the *simulated detector*) reports, and sorts it by the paper's filtering policy.
"""

import io
import math
import re
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from PIL import Image

from mapspeak.errors import MapError
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import UNKNOWN, OccupancyGrid

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
        """Return a column as a number; infinite where the table says there is none."""
        match = re.match(r"-?[\d.]+", self.cells[column])
        return float(match.group()) if match else math.inf

    def goal(self) -> Point:
        """Return where a frontier's row says to go."""
        x, y = self.cells["go to x, y, yaw"].split(",")[:2]
        return Point(float(x), float(y))


@dataclass(frozen=True, slots=True, kw_only=True)
class MapReading:
    """What the text of `look_at_map` says.

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
        columns = _split(lines[0])
        rows = (dict(zip(columns, _split(line), strict=False)) for line in lines[1:])
        tables[heading.group(1)] = tuple(Row(row[columns[0]], row) for row in rows)
    return tables


def _split(line: str) -> list[str]:
    return [part.strip() for part in line.split(" | ")]


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
    r"^- (?P<label>[^,]+), bearing (?P<bearing>[+-]?[\d.]+) deg, range (?P<range>[\d.]+) m",
    re.MULTILINE,
)
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


def describe_view(number: int, place: str, sightings: tuple[DetectedThing, ...]) -> dict[str, Any]:
    """Return the arguments of `write_semantic_data` for what is seen from here."""
    clear = [sighting for sighting in sightings if sighting.range_m <= CLEAR_RANGE_M]
    names = ", ".join(dict.fromkeys(sighting.label for sighting in clear))
    seen = f"The simulated detector reports: {names}." if names else "Nothing it knows is near."
    landmarks: dict[bool, list[dict[str, Any]]] = {True: [], False: []}
    for thing in clear:
        landmarks[any(word in thing.label for word in SAFETY_WORDS)].append(asdict(thing))
    return {
        "name": f"view {number}",
        "description": f"View from {place}. {seen}",
        "safety_landmarks": landmarks[True],
        "functional_landmarks": landmarks[False],
        "geometric_features": [f"stands in {place}"],
    }
