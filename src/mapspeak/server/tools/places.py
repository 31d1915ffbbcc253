"""The tools that find places and answer about them: remembered, measured, reachable, blocked."""

from datetime import datetime
from typing import Annotated

from mcp_types import CallToolResult, TextContent
from pydantic import Field

from mapspeak.driving.drivereport import find_failed
from mapspeak.errors import GoalError
from mapspeak.memory.search.answer import EntryKind
from mapspeak.places.asking import Recall, RecallQuery, leave_out_beside, recall
from mapspeak.places.recall.events import (
    find_events_at,
    find_speaking_events,
    leave_out_events,
    say_events,
)
from mapspeak.places.relations.choosing import check_place, find_place, name_room
from mapspeak.places.things import split_room
from mapspeak.server.reports.memory import RecallAnswer
from mapspeak.server.reports.robot import GoalAnswer
from mapspeak.server.text.findings import say_moved
from mapspeak.server.text.moments import read_past
from mapspeak.server.text.recall import say_phrase
from mapspeak.server.text.world.descriptions import describe_place
from mapspeak.server.text.world.notices import say_elsewhere
from mapspeak.server.text.world.reported import say_reported
from mapspeak.server.text.world.ways import describe_blocked, describe_measures
from mapspeak.server.tools.toolset import ToolEffect, tool
from mapspeak.session import Session
from mapspeak.spatial.rooms import Region
from mapspeak.worldmodel.model import WorldModel

MOST_PLACES = 30

OnePlace = Annotated[
    str,
    Field(
        description='an id, a name, "robot", "x, y, yaw_deg" or a phrase: "left of W3"',
        max_length=200,
    ),
]
Places = Annotated[
    list[Annotated[str, Field(max_length=200)]] | None,
    Field(
        description='ids, names, points or phrases: "every remembered extinguisher"; else all '
        "rooms",
        max_length=MOST_PLACES,
    ),
]
Start = Annotated[str, Field(description="where from", max_length=200)]
Query = Annotated[str, Field(description="name or purpose", min_length=1, max_length=300)]
Near = Annotated[str | None, Field(description="place, within 5 m", max_length=200)]
Room = Annotated[str | None, Field(description="id", max_length=200)]
Since = Annotated[str | None, Field(description="yesterday, 2h ago", max_length=40)]
Until = Annotated[str | None, Field(description="seen before", max_length=40)]
Kind = Annotated[EntryKind | None, Field(description="only these")]
Count = Annotated[int, Field(description="most", ge=1, le=20, strict=True)]


class PlaceTools:
    """Describing places, measuring between them, checking goals."""

    def __init__(self, session: Session) -> None:
        self._session = session

    @tool("One place in full", ToolEffect.READS)
    async def describe_place(self, place: OnePlace) -> str:
        """Describe one room, corridor, door, frontier, remembered place or point.

        Use it for shape, doors along a corridor, what was seen there, how to get there.
        """
        session = self._session
        world, now = await session.fetch_world_model(), session.find_wall_time()

        def describe() -> str:
            found = find_place(world, place)
            noted: tuple[str, ...] = ()
            if now is not None:
                events = find_events_at(session.recall_events(), world, found, now)
                noted = say_events(events, now)
            ids = session.pictures.short_ids
            return describe_place(world, found, picture_ids=ids, noted=noted)

        return await session.compute(describe)

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
            room = world.find_room_id(goal.pose.point)
            return GoalAnswer.of(goal, robot=world.robot.point, room=room)

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
                failed=find_failed(session.drives.ended),
                held_by=None if session.guard is None else session.guard.hold.read(),
                now=session.find_wall_time(),
                now_s=session.robot.now_s,
            )

        return await session.compute(describe)


class FindTools:
    """Finding what is remembered."""

    def __init__(self, session: Session) -> None:
        self._session = session

    # Its report is not declared: a schema of answers would cost more than all its arguments.
    @tool("Find in memory", ToolEffect.READS)
    async def find_place(
        self,
        query: Query,
        near: Near = None,
        room: Room = None,
        since: Since = None,
        until: Until = None,
        kind: Kind = None,
        k: Count = 5,
    ) -> CallToolResult:
        """Find a remembered place or thing by name or purpose. Take this first to find anything.

        It says where and how sure, or that several may be meant.
        """
        session = self._session
        now = session.find_wall_time()
        world = await session.fetch_world_model(needs_memory=True)
        ids = session.pictures.short_ids

        def ask() -> RecallAnswer:
            words, room_id = split_room(world, name_room(world, query))
            begin, end = read_past(since, until, now)
            wanted = RecallQuery(
                words=words if room is None else query,
                near=None if near is None else find_place(world, near).point,
                room_id=room_id if room is None else find_room(world, room),
                since=begin,
                until=end,
                kind=kind,
                n=k,
            )
            answer = leave_out_beside(recall(world, wanted))
            warnings = self._say_warnings(world, query, now)
            report = RecallAnswer.of(answer, now=now, picture_ids=ids, warnings=warnings)
            advice = say_phrase(world, query) or self._say_seen(world, answer, report, now)
            return report.model_copy(update={"advice": advice})

        report = await session.compute(ask)
        await session.keep_vectors()
        warning = await say_moved(session.compute(session.keeper.compare))
        if warning:
            report = report.model_copy(update={"warnings": [warning, *report.warnings]})
        return CallToolResult(
            content=[TextContent(type="text", text=report.text)],
            structured_content=report.model_dump(mode="json"),
        )

    def _say_seen(
        self, world: WorldModel, answer: Recall, report: RecallAnswer, now: datetime | None
    ) -> str:
        """Return the advice with what the detector reported and nobody wrote down."""
        if now is None:
            return report.advice
        store, find = self._session.episodes.store, self._session.find_episodes
        return f"{report.advice} {say_reported(world, store, find, answer, now=now)}".rstrip()

    def _say_warnings(self, world: WorldModel, query: str, now: datetime | None) -> tuple[str, ...]:
        """Say what a reader should know first; of events those that have to do with a request."""
        events = self._session.recall_events()
        others = leave_out_events(world.memory.warnings, events, world.map, now)
        noted = [] if now is None else say_events(find_speaking_events(events, query, now), now)
        return (*(f"Noted: {each}" for each in noted), *others, *say_elsewhere(world.memory))


def find_room(world: WorldModel, words: str) -> str:
    """Return the id of a named room, or of the room that a place lies in.

    Raises:
        GoalError: There is no such place, or it lies in no room.
    """
    place = find_place(world, words)
    if isinstance(place.thing, Region):
        return place.thing.id
    room_id = world.find_room_id(place.point)
    if room_id is None:
        raise GoalError(f"{place.name} lies in no room.", hint="Give a room by its id, as R1.")
    return room_id
