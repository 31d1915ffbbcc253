"""The tools that answer about places: one in full, how far, and whether the robot can go there."""

from typing import Annotated

from pydantic import Field

from mapspeak.places.relations.choosing import check_place, find_place
from mapspeak.server.reports.robot import GoalAnswer
from mapspeak.server.text.world.blocked import describe_blocked
from mapspeak.server.text.world.descriptions import describe_place
from mapspeak.server.text.world.measures import describe_measures
from mapspeak.server.tools.toolset import ToolEffect, tool
from mapspeak.session import Session

MOST_PLACES = 30

OnePlace = Annotated[
    str,
    Field(
        description='an id, a name, "robot", "x, y, yaw_deg" or a phrase: "left of W3", '
        '"second-smallest room"',
        max_length=200,
    ),
]
Places = Annotated[
    list[Annotated[str, Field(max_length=200)]] | None,
    Field(
        description='ids, names, points or phrases: "the two nearest doors", "every remembered '
        'extinguisher"; all rooms when left out',
        max_length=MOST_PLACES,
    ),
]
Start = Annotated[str, Field(description="where from", max_length=200)]


class PlaceTools:
    """Describing places, measuring between them, checking goals."""

    def __init__(self, session: Session) -> None:
        self._session = session

    @tool("One place in full", ToolEffect.READS)
    async def describe_place(self, place: OnePlace) -> str:
        """Describe one room, corridor, door, frontier, remembered place or point of the map.

        Use it for shape, doors along a corridor, what was seen there, how to get there.
        """
        world = await self._session.fetch_world_model()
        return await self._session.compute(lambda: describe_place(world, find_place(world, place)))

    @tool("Measure ways and sizes", ToolEffect.READS)
    async def measure(self, places: Places = None, start: Start = "robot") -> str:
        """Measure on the map: path and straight distance, the rooms and doors on the way, sizes.

        Use it to compare rooms or doors, and for any way; sorted.
        """
        world = await self._session.fetch_world_model()
        return await self._session.compute(
            lambda: describe_measures(world, start=start, places=places)
        )

    @tool(
        "Check a goal",
        ToolEffect.READS,
        has_report=True,
        leads="{navigate_to} checks its goal itself.",
    )
    async def check_goal(self, place: OnePlace) -> GoalAnswer:
        """Check whether the robot can drive to a place, without driving: verdict, clearance, path.

        Use it to compare goals.
        """
        world = await self._session.fetch_world_model()

        def check() -> GoalAnswer:
            goal = check_place(world, find_place(world, place))
            return GoalAnswer.of(goal, room=world.find_room_id(goal.pose.point))

        return await self._session.compute(check)

    @tool("What is blocked", ToolEffect.READS)
    async def what_is_blocked(self) -> str:
        """Say all that is in the robot's way: closures, rooms without a way, failed goals.

        Each with why and until when. Use it for "is anything blocked?".
        """
        session = self._session
        world = await session.fetch_world_model()

        def describe() -> str:
            return describe_blocked(
                world,
                events=session.recall_events(),
                failed=session.drives.failed,
                held_by=None if session.guard is None else session.guard.hold.read(),
                now=session.find_wall_time(),
                now_s=session.robot.now_s,
            )

        return await session.compute(describe)
