"""The scripted policy: the paper's three tasks, done with nothing but what tools answer."""

import math
import re
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from mapspeak.evaluation.client import Picture, ToolAnswer, ToolClient
from mapspeak.evaluation.observer import DetectedThing, describe_view, read_sightings
from mapspeak.evaluation.reading import MapReading, Row, read_map_picture, read_map_text
from mapspeak.evaluation.survey import find_viewpoint
from mapspeak.geometry import Point, Pose
from mapspeak.spatial import OccupancyGrid

__all__ = ["PolicyResult", "ScriptedPolicy", "Stage", "Step", "is_room"]

MOST_GOALS = 80
WAIT_S = 20.0
NEAR_M = 4.5
"""A waypoint that saw its landmark from no farther leads to it, as the paper's do (3 to 4 m)."""
LEAST_ROOM_M2 = 3.0
MOST_VIEWPOINTS = 60
MARGIN_M = 0.45
"""A viewpoint keeps this clear of walls: as much as the robot needs and a little more."""
LOOK_AROUND_EVERY_M = 4.0
LOOK_AROUND_DEG = (90.0, 180.0, 270.0)
FINAL_STATES = ("arrived", "blocked", "cancelled", "preempted", "rejected", "lost")


class Stage(StrEnum):
    """Which of the paper's tasks is under way."""

    EXPLORE = "task1"
    SMALLEST_ROOM = "task2"
    FIRE_TOOL = "task3"


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A moment worth showing: a map was looked at, a picture was taken, a drive ended.

    Attributes:
        stage: The task under way.
        caption: What happened, in a sentence.
        picture: What was seen; None where nothing was.
        grid: The map that was looked at; None for anything else.
    """

    stage: Stage
    caption: str
    picture: Picture | None = None
    grid: OccupancyGrid | None = None


OnStep = Callable[[Step], Awaitable[None]]


@dataclass(frozen=True, slots=True, kw_only=True)
class PolicyResult:
    """What the policy believes it has done; scoring does not believe it.

    Attributes:
        n_goals: Places it was sent to during exploration.
        is_explored: The last map named no frontier that the robot can reach.
        smallest_room: The id it took for the smallest room.
        fire_waypoint: The remembered place it went to for the tool for fire.
    """

    n_goals: int
    is_explored: bool
    smallest_room: str | None
    fire_waypoint: str | None


@dataclass(slots=True)
class ScriptedPolicy:
    """Explores, records, and answers from map and memory.

    Attributes:
        tools: Where calls go.
        on_step: Told of everything worth showing.
    """

    tools: ToolClient
    on_step: OnStep
    _n_goals: int = 0
    _n_records: int = 0
    _looked_at: list[Point] = field(default_factory=list)
    _grid: OccupancyGrid = field(init=False)

    async def run(self) -> PolicyResult:
        """Carry out the three tasks in the paper's order."""
        is_explored = await self.explore()
        smallest_room = await self.go_to_smallest_room()
        fire_waypoint = await self.go_to_fire_tool()
        return PolicyResult(
            n_goals=self._n_goals,
            is_explored=is_explored,
            smallest_room=smallest_room,
            fire_waypoint=fire_waypoint,
        )

    async def explore(self) -> bool:
        """Task 1: drives to frontiers and records what is seen, until none is left to reach.

        It explores once more after the survey: by then more is known.
        """
        view = await self._look(Stage.EXPLORE)
        await self._record_surroundings(view.pose)
        view = await self._follow_frontiers(view)
        await self._survey(view.pose)
        view = await self._follow_frontiers(await self._look(Stage.EXPLORE))
        return not view.rows("Frontiers")

    async def _follow_frontiers(self, view: MapReading) -> MapReading:
        """Let the robot explore, one frontier at a time, until none is left that it can reach."""
        while self._n_goals < MOST_GOALS and (n_goals := await self._explore_one()):
            self._n_goals += n_goals
            view = await self._look(Stage.EXPLORE)
            await self._record_surroundings(view.pose)
        return view

    async def _explore_one(self) -> int:
        """Return how many frontiers the robot set out to, none where nothing is left."""
        state = "driving"
        while state == "driving":
            report = (await self.tools.demand("explore", n_goals=1, wait_s=WAIT_S)).report
            state = str(report["state"])
        await self.on_step(Step(stage=Stage.EXPLORE, caption=f"{state}: {report['reason']}"))
        return int(report["n_goals"])

    async def _survey(self, pose: Pose) -> None:
        """Look around wherever floor has not been looked at from near."""
        for _ in range(MOST_VIEWPOINTS):
            point = find_viewpoint(self._grid, pose.point, self._looked_at, radius_m=MARGIN_M)
            if point is None:
                return
            answer = await self._drive_to_point(point)
            pose = (await self._look(Stage.EXPLORE)).pose
            if answer == "arrived":
                await self._record_surroundings(pose)
            self._looked_at.append(point)

    async def go_to_smallest_room(self) -> str | None:
        """Task 2: the smallest row of the table of rooms that is a room and no nook."""
        view = await self._look(Stage.SMALLEST_ROOM)
        rooms = [row for row in view.rows("Rooms") if is_room(row, view.rows("Doors"))]
        if not rooms:
            return None
        smallest = min(rooms, key=lambda row: row.number("floor m2"))
        await self._drive(Stage.SMALLEST_ROOM, smallest.id)
        await self._take_picture(Stage.SMALLEST_ROOM)
        return smallest.id

    async def go_to_fire_tool(self) -> str | None:
        """Task 3: the nearest remembered place that saw an extinguisher from near.

        Nearest by the robot's pose, as the paper's models chose; from near where any did.
        """
        view = await self._look(Stage.FIRE_TOOL)
        memory = await self.tools.demand("get_semantic_data")
        ranges_m = {
            record["id"]: range_m
            for record in _records(memory)
            if (range_m := _range_of_fire_tool(record)) is not None
        }
        if not ranges_m:
            return None
        enough_m = max(NEAR_M, min(ranges_m.values()))
        places = [
            record
            for record in _records(memory)
            if ranges_m.get(record["id"], math.inf) <= enough_m
        ]
        nearest = min(places, key=lambda record: _point_of(record).distance_to(view.pose.point))
        await self._drive(Stage.FIRE_TOOL, nearest["id"])
        await self._take_picture(Stage.FIRE_TOOL)
        return str(nearest["name"])

    async def _look(self, stage: Stage) -> MapReading:
        plain = await self.tools.demand("subscribe_map_as_image")
        answer = await self.tools.demand("look_at_map")
        summary = next((line for line in answer.text.splitlines() if "Explored" in line), "")
        self._grid = read_map_picture(plain.text, plain.pictures[0].data)
        step = Step(stage=stage, caption=summary, picture=_first(answer), grid=self._grid)
        await self.on_step(step)
        return read_map_text(answer.text)

    async def _drive_to_point(self, point: Point) -> str:
        answer = await self.tools.call("navigate_to", x=point.x, y=point.y, wait_s=WAIT_S)
        return await self._see_through(Stage.EXPLORE, f"({point.x:.1f}, {point.y:.1f})", answer)

    async def _drive(self, stage: Stage, place: str) -> str:
        answer = await self.tools.call("navigate_to", place=place, wait_s=WAIT_S)
        return await self._see_through(stage, place, answer)

    async def _see_through(self, stage: Stage, place: str, answer: ToolAnswer) -> str:
        """Wait until a drive has ended, and return how."""
        while not answer.is_error and answer.report["state"] not in FINAL_STATES:
            answer = await self.tools.call(
                "wait_for_goal", goal_id=answer.report["goal_id"], wait_s=WAIT_S
            )
        state = "refused" if answer.is_error else str(answer.report["state"])
        await self.on_step(Step(stage=stage, caption=f"{place}: {state}"))
        return state

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
        sightings = await self._take_picture(Stage.EXPLORE)
        place = (await self.tools.demand("get_robot_pose")).report
        self._n_records += 1
        record = describe_view(self._n_records, place["place"], sightings)
        await self.tools.demand("write_semantic_data", **record)

    async def _take_picture(self, stage: Stage) -> tuple[DetectedThing, ...]:
        answer = await self.tools.demand("look_through_camera")
        sightings = read_sightings(answer.text)
        names = ", ".join(sighting.label for sighting in sightings) or "nothing it knows"
        caption = f"simulated detector: {names}"
        await self.on_step(Step(stage=stage, caption=caption, picture=_first(answer)))
        return sightings


def _first(answer: ToolAnswer) -> Picture | None:
    return next(iter(answer.pictures), None)


def _records(answer: ToolAnswer) -> list[dict[str, Any]]:
    return list(answer.report["waypoints"])


def is_room(row: Row, doors: tuple[Row, ...]) -> bool:
    """True for a room; what furniture cuts off is tiny, or open to one neighbour several times."""
    names = re.findall(r"D\d+", row.cells["doors"])
    ways_in = [
        door.cells["joins"]
        for door in doors
        if door.id in names and not door.cells["path m"].startswith("no way")
    ]
    is_nook = len(ways_in) > len(set(ways_in))
    is_large_enough = row.number("floor m2") >= LEAST_ROOM_M2
    return row.cells["kind"] == "room" and is_large_enough and not is_nook


def _point_of(record: dict[str, Any]) -> Point:
    return Point(record["pose"]["x"], record["pose"]["y"])


def _range_of_fire_tool(record: dict[str, Any]) -> float | None:
    """Return how far from a waypoint its fire extinguisher is; None where it names none."""
    landmarks = record["safety_landmarks"] + record["functional_landmarks"]
    ranges = [each["range_m"] for each in landmarks if re.search("extinguish", each["label"])]
    return min((math.inf if each is None else each for each in ranges), default=None)
