"""How the script explores and records, with nothing but what tools answer: the paper's Task 1."""

import math
import re
from dataclasses import dataclass, field

from mapspeak.evaluation.client import ToolClient
from mapspeak.evaluation.observer import describe_view, read_sightings
from mapspeak.evaluation.reading import MapReading, Row, read_map_picture, read_map_text
from mapspeak.evaluation.survey import find_viewpoint
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import OccupancyGrid

__all__ = ["ExplorationPolicy", "is_room"]

MOST_GOALS = 80
WAIT_S = 20.0
LEAST_ROOM_M2 = 3.0
MOST_VIEWPOINTS = 60
MARGIN_M = 0.45
"""A viewpoint keeps this clear of walls: as much as the robot needs and a little more."""
LOOK_AROUND_EVERY_M = 4.0
LOOK_AROUND_DEG = (90.0, 180.0, 270.0)
FINAL_STATES = ("arrived", "blocked", "cancelled", "preempted", "rejected", "lost")


@dataclass(slots=True)
class ExplorationPolicy:
    """Explores, and records what is seen on the way.

    Attributes:
        tools: Where calls go.
    """

    tools: ToolClient
    _n_goals: int = 0
    _n_records: int = 0
    _looked_at: list[Point] = field(default_factory=list)
    _grid: OccupancyGrid = field(init=False)

    async def explore(self) -> None:
        """Drive to frontiers and record what is seen, until none is left to reach.

        It explores once more after the survey: by then more is known.
        """
        view = await self._look()
        await self._record_surroundings(view.pose)
        view = await self._follow_frontiers(view)
        await self._survey(view.pose)
        await self._follow_frontiers(await self._look())

    async def _follow_frontiers(self, view: MapReading) -> MapReading:
        """Let the robot explore, one frontier at a time, until none is left that it can reach."""
        while self._n_goals < MOST_GOALS and (n_goals := await self._explore_one()):
            self._n_goals += n_goals
            view = await self._look()
            await self._record_surroundings(view.pose)
        return view

    async def _explore_one(self) -> int:
        """Return how many frontiers the robot set out to, none where nothing is left."""
        state = "driving"
        while state == "driving":
            report = (await self.tools.demand("explore", n_goals=1, wait_s=WAIT_S)).report
            state = str(report["state"])
        return int(report["n_goals"])

    async def _survey(self, pose: Pose) -> None:
        """Look around wherever floor has not been looked at from near."""
        for _ in range(MOST_VIEWPOINTS):
            point = find_viewpoint(self._grid, pose.point, self._looked_at, radius_m=MARGIN_M)
            if point is None:
                return
            answer = await self._drive_to_point(point)
            pose = (await self._look()).pose
            if answer == "arrived":
                await self._record_surroundings(pose)
            self._looked_at.append(point)

    async def _look(self) -> MapReading:
        plain = await self.tools.demand("subscribe_map_as_image")
        answer = await self.tools.demand("look_at_map")
        self._grid = read_map_picture(plain.text, plain.pictures[0].data)
        return read_map_text(answer.text)

    async def _drive_to_point(self, point: Point) -> str:
        """Drive to a point, wait until that has ended, and return how."""
        answer = await self.tools.call("navigate_to", x=point.x, y=point.y, wait_s=WAIT_S)
        while not answer.is_error and answer.report["state"] not in FINAL_STATES:
            answer = await self.tools.call(
                "wait_for_goal", goal_id=answer.report["goal_id"], wait_s=WAIT_S
            )
        return "refused" if answer.is_error else str(answer.report["state"])

    async def _record_surroundings(self, pose: Pose) -> None:
        """Record what is ahead and, where it has not looked around near by, to all sides."""
        await self._record()
        if any(pose.point.distance_to(place) < LOOK_AROUND_EVERY_M for place in self._looked_at):
            return
        self._looked_at.append(pose.point)
        for turn_deg in LOOK_AROUND_DEG:
            yaw_deg = math.remainder(pose.yaw_deg + turn_deg, 360.0)
            await self.tools.call("navigate_to", x=pose.x, y=pose.y, yaw_deg=yaw_deg)
            await self._record()

    async def _record(self) -> None:
        sightings = read_sightings((await self.tools.demand("look_through_camera")).text)
        place = (await self.tools.demand("get_robot_pose")).report
        self._n_records += 1
        record = describe_view(self._n_records, place["place"], sightings)
        await self.tools.demand("write_semantic_data", **record)


def is_room(row: Row, doors: tuple[Row, ...]) -> bool:
    """Return True for a room.

    What furniture cuts off is tiny, or open to one neighbour several times.
    """
    names = re.findall(r"D\d+", row.cells["doors"])
    ways_in = [
        door.cells["joins"]
        for door in doors
        if door.id in names and not door.cells["path m"].startswith("no way")
    ]
    is_nook = len(ways_in) > len(set(ways_in))
    is_large_enough = row.number("floor m2") >= LEAST_ROOM_M2
    return row.cells["kind"] == "room" and is_large_enough and not is_nook
