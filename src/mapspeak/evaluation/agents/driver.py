"""What scripts do over and over: look at the map, recall, drive to the end of a drive."""

import math
import re
from dataclasses import dataclass
from typing import Any

from mapspeak.evaluation.agent import ToolClient
from mapspeak.evaluation.agents.reading import (
    DetectedThing,
    MapReading,
    describe_view,
    read_map_text,
    read_sightings,
)
from mapspeak.geometry import Point, Pose
from mapspeak.places.standing import point_ahead

WAIT_S = 25.0
REGION = re.compile(r"\b[RCO]\d+\b")
FINAL_STATES = ("arrived", "blocked", "cancelled", "preempted", "rejected", "lost")
ARRIVED = "arrived"
REFUSED = "refused"


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """One thing as one remembered place has seen it.

    Attributes:
        place: The id of the remembered place.
        bearing_rad: From the place's heading; None where it was not noted.
        range_m: From the place; infinite where it was not noted.
    """

    place: str
    view: Pose
    bearing_rad: float | None
    range_m: float

    @property
    def thing(self) -> Point | None:
        """Where the thing is; None where bearing or range are not known."""
        if self.bearing_rad is None or math.isinf(self.range_m):
            return None
        return point_ahead(self.view.point, self.view.yaw_rad + self.bearing_rad, self.range_m)


@dataclass(slots=True)
class ToolDriver:
    """Calls tools in a script's name.

    Attributes:
        wait_s: How long each call waits for the end of a drive, in robot time.
    """

    tools: ToolClient
    wait_s: float = WAIT_S
    _n_views: int = 0

    async def is_offered(self, tool: str) -> bool:
        """Return True where the server offers a tool of that name."""
        return any(each.name == tool for each in await self.tools.list_tools())

    async def look(self) -> MapReading:
        """Read the map's tables."""
        return read_map_text((await self.tools.demand("look_at_map")).text)

    async def find_pose(self) -> Pose:
        """Return where the robot is."""
        robot = (await self.tools.demand("get_robot_pose")).report
        pose = robot.get("pose", robot)
        return Pose(pose["x"], pose["y"], math.radians(pose["yaw_deg"]))

    async def recall(self, label: str) -> list[Seen]:
        """Return everything remembered that bears a label, the nearest sightings first."""
        memory = (await self.tools.demand("get_semantic_data")).report
        found = [
            _seen(record, landmark)
            for record in memory["waypoints"]
            for landmark in (*record["safety_landmarks"], *record["functional_landmarks"])
            if label in landmark["label"]
        ]
        return sorted(found, key=lambda seen: seen.range_m)

    async def drive(self, **goal: object) -> str:
        """Drive to a `place`, or to `x`, `y` and perhaps `yaw_deg`; return how it ended."""
        answer = await self.tools.call("navigate_to", **goal, wait_s=self.wait_s)
        while not answer.is_error and answer.report["state"] not in FINAL_STATES:
            answer = await self.tools.call(
                "wait_for_goal", goal_id=answer.report["goal_id"], wait_s=self.wait_s
            )
        return REFUSED if answer.is_error else str(answer.report["state"])

    async def find_nearest(self, places: list[str]) -> str | None:
        """Return which of some places is the nearest by path; None where no way leads to any."""
        text = (await self.tools.demand("measure", places=places, start="robot")).text
        rows = re.findall(r"^(\w+) \| [^|]+ \| \d", text, re.MULTILINE)
        return rows[0] if rows else None

    async def find_region(self, point: Point) -> str:
        """Return the id of the room, corridor or hall at a point; empty where there is none."""
        place = f"{point.x:.2f}, {point.y:.2f}"
        text = (await self.tools.demand("describe_place", place=place)).text
        found = REGION.search(text.partition("\n")[0])
        return found.group() if found else ""

    async def see(self) -> tuple[DetectedThing, ...]:
        """Take a picture and return what the detector reports of it."""
        return read_sightings((await self.tools.demand("look_through_camera")).text)

    async def record(self, place: str, sightings: tuple[DetectedThing, ...]) -> None:
        """Remember what is seen from here, under a number."""
        self._n_views += 1
        record = describe_view(self._n_views, place, sightings)
        await self.tools.demand("write_semantic_data", **record)


def _seen(record: dict[str, Any], landmark: dict[str, Any]) -> Seen:
    pose, bearing_deg = record["pose"], landmark["bearing_deg"]
    return Seen(
        place=record["id"],
        view=Pose(pose["x"], pose["y"], math.radians(pose["yaw_deg"])),
        bearing_rad=None if bearing_deg is None else math.radians(bearing_deg),
        range_m=math.inf if landmark["range_m"] is None else landmark["range_m"],
    )


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
