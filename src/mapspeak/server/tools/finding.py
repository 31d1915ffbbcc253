"""The tool that finds what is remembered; in the default toolsets, and in that of the memory."""

from typing import Annotated

from mcp_types import CallToolResult, TextContent
from pydantic import Field

from mapspeak.errors import GoalError
from mapspeak.geometry import Point
from mapspeak.memory.search.answer import EntryKind
from mapspeak.places.recall.asking import RecallQuery, recall
from mapspeak.places.relations.choosing import find_place
from mapspeak.places.things import split_room
from mapspeak.server.reports.memory import RecallAnswer, say_reported
from mapspeak.server.text.findings import say_moved
from mapspeak.server.text.moments import read_past
from mapspeak.server.text.wording import say_elsewhere
from mapspeak.server.tools.toolset import ToolEffect, tool
from mapspeak.session import Session
from mapspeak.spatial.rooms import Region
from mapspeak.worldmodel.model import WorldModel

Query = Annotated[str, Field(description="name or purpose", min_length=1, max_length=300)]
Near = Annotated[str | None, Field(description="place, within 5 m", max_length=200)]
Room = Annotated[str | None, Field(description="id", max_length=200)]
Since = Annotated[str | None, Field(description="yesterday, 2h ago", max_length=40)]
Until = Annotated[str | None, Field(description="seen before", max_length=40)]
Kind = Annotated[EntryKind | None, Field(description="only these")]
Count = Annotated[int, Field(description="most", ge=1, le=20, strict=True)]


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

        def ask() -> RecallAnswer:
            words, room_id = split_room(world, query)
            begin, end = read_past(since, until, now)
            wanted = RecallQuery(
                words=words if room is None else query,
                near=None if near is None else find_point(world, near),
                room_id=room_id if room is None else find_room(world, room),
                since=begin,
                until=end,
                kind=kind,
                n=k,
            )
            answer = recall(world, wanted)
            report = RecallAnswer.of(
                answer, now=now, warnings=(*world.memory.warnings, *say_elsewhere(world.memory))
            )
            if now is None:
                return report
            seen = say_reported(session.find_reported, answer, wanted, now=now)
            advice = f"{report.advice} {seen}".rstrip()
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


def find_point(world: WorldModel, words: str) -> Point:
    """Return the point of a named place.

    Raises:
        GoalError: There is no such place.
    """
    return find_place(world, words).point


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
