"""The tools with which the robot finds its own way: exploring and searching."""

import base64
import dataclasses
from enum import StrEnum
from functools import partial
from typing import Annotated

from mcp.server.mcpserver import Context
from mcp_types import CallToolResult, ImageContent, TextContent
from pydantic import Field

from mapspeak.driving.exploration.camera import find_untold
from mapspeak.driving.exploration.explorer import Explorer
from mapspeak.driving.exploration.progress import Bounds, ExplorationState
from mapspeak.driving.search.evidence import leave_out_shown
from mapspeak.driving.search.progress import Budget, SearchState
from mapspeak.driving.search.searcher import Judgement, Searcher
from mapspeak.errors import LinkError, SemanticMapError
from mapspeak.memory import TakenPicture
from mapspeak.safety import ApprovalScope, within_scope
from mapspeak.server.reports.exploring import ExploreAnswer, SearchAnswer
from mapspeak.server.reports.maps import Report
from mapspeak.server.text.wording import shorten
from mapspeak.server.text.world.reported import say_found
from mapspeak.server.tools.caller import (
    AT_MOST_LONGEST_WAIT,
    LONGEST_WAIT_S,
    tell_progress,
)
from mapspeak.server.tools.sightings import CameraSighting, look_ahead
from mapspeak.server.tools.toolset import ToolEffect, tool
from mapspeak.session import Session

USUAL_DRIVES = 50
USUAL_DURATION_S = 600.0
"""Robot time for which an approval is valid where a call has no bound of its own."""


class Covered(StrEnum):
    """What an exploration makes complete."""

    MAP = "map"
    CAMERA = "camera"


NGoals = Annotated[
    int | None, Field(description="end after so many frontiers", ge=1, le=200, strict=True)
]
Duration = Annotated[
    float | None, Field(description="end after so many seconds of driving", gt=0, le=86_400)
]
KnownPercent = Annotated[
    float | None,
    Field(description="end when so much of the floor to be expected is known", gt=0, le=100),
]
StopsAtGoals = Annotated[
    bool,
    Field(
        description="pause with a camera picture where the robot arrives, and, 3 m or more from "
        "the last pause, where it has seen from afar what it was sent to see"
    ),
]
Cover = Annotated[
    Covered, Field(description="what is to be complete: the map, or pictures of all walls as well")
]
Wait = Annotated[
    float,
    Field(description="seconds until it answers, still driving", ge=1, le=LONGEST_WAIT_S),
    AT_MOST_LONGEST_WAIT,
]
Thing = Annotated[
    str,
    Field(description='what to find, such as "fire extinguisher"', min_length=1, max_length=120),
]
Seen = Annotated[
    bool | None, Field(description="the thing is in the last picture; say false when it is not")
]
Likely = Annotated[
    float | None,
    Field(description="0 to 1: how likely it is near what the last picture shows", ge=0, le=1),
]
Score = Annotated[float, Field(ge=0, le=1)]
Scores = Annotated[
    dict[str, Score] | None,
    Field(description='0 to 1: how likely it is at places, by id: {"F2": 0.9, "R1": 0.1}'),
]
MostLooks = Annotated[int, Field(description="end after so many pictures", ge=1, le=500)]
MostMetres = Annotated[float, Field(description="end after so many metres", gt=0, le=10_000)]


class ExploreTools:
    """Exploring and searching."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._explorer = Explorer(session, look=self._look_on_the_way)
        self._on_the_way: set[str] = set()
        self._searcher = Searcher(session)

    @tool(
        "Explore the unknown",
        ToolEffect.MOVES,
        has_report=True,
        leads="Use {navigate_to} with an F id to choose each frontier yourself.",
    )
    async def explore(
        self,
        context: Context,
        n_goals: NGoals = None,
        duration_s: Duration = None,
        known_percent: KnownPercent = None,
        stops_at_goals: StopsAtGoals = False,  # noqa: FBT002 - tools are called by name
        cover: Cover = Covered.MAP,
        wait_s: Wait = 20.0,
    ) -> Annotated[CallToolResult, ExploreAnswer]:
        """Drive the robot from frontier to frontier by itself, until nothing is left to explore.

        Use it to map a building quickly. Between calls the robot ends only the drive it is on:
        while state is driving or at_goal, call it again with the same arguments. Tells "nothing
        left" from "what is left cannot be reached".
        """
        bounds = Bounds(
            n_goals=n_goals,
            duration_s=duration_s,
            known_ratio=None if known_percent is None else known_percent / 100,
            stops_at_goals=stops_at_goals,
            for_camera=cover is Covered.CAMERA,
        )
        if bounds.for_camera:
            self._require_camera()
        with within_scope(_exploring(bounds)):
            progress = await self._explorer.advance(
                bounds, wait_s=wait_s, on_trip=tell_progress(context)
            )
        sees = progress.state is ExplorationState.AT_GOAL or (
            stops_at_goals and progress.state is ExplorationState.BOUND_REACHED
        )
        sighting = await self._look_if_it_can() if sees else None
        untold = await self._session.compute(
            partial(find_untold, self._session.pictures.taken, frozenset(self._on_the_way))
        )
        self._on_the_way.clear()
        return _answer(ExploreAnswer.of(progress, untold), sighting)

    @tool("Find a thing", ToolEffect.MOVES, has_report=True)
    async def search_for(
        self,
        context: Context,
        thing: Thing,
        seen: Seen = None,
        likely: Likely = None,
        scores: Scores = None,
        max_looks: MostLooks = 40,
        max_m: MostMetres = 300.0,
        wait_s: Wait = 20.0,
    ) -> Annotated[CallToolResult, SearchAnswer]:
        """Drive the robot about to find what may be anywhere. Ask {find_place} first.

        Each step gives a picture for you to judge. It goes to remembered places that speak of the
        thing, then to frontiers and floor that the camera has not seen. Call it again with the same
        thing and what you saw: seen=true ends the search, seen=false goes on; likely and scores
        lead it.
        """
        self._require_camera()
        # Pictures of a map that was left tell nothing.
        await self._session.meet_map()
        with within_scope(_searching(thing, max_looks, max_m)):
            standing = await self._searcher.advance(
                thing,
                Judgement(is_seen=seen, likely=likely, scores=scores or {}),
                Budget(n_looks=max_looks, driven_m=max_m),
                wait_s=wait_s,
                on_trip=tell_progress(context),
                earlier=await self._session.compute(lambda: self._find_earlier(thing)),
            )
        if not standing.state.shows_picture:
            return _answer(await self._say_where(SearchAnswer.of(standing)), None)
        sighting = await look_ahead(self._session)
        self._searcher.note_picture(sighting.picture)
        shown = dataclasses.replace(standing, n_looks=standing.n_looks + 1)
        return _answer(SearchAnswer.of(shown), sighting)

    async def _look_on_the_way(self) -> None:
        """Take a picture that is not shown, and tell in the next answer what is reported in it."""
        await look_ahead(self._session)
        if (taken := self._session.pictures.latest) is not None:
            self._on_the_way.add(taken.id)

    async def _say_where(self, report: SearchAnswer) -> SearchAnswer:
        """Return the report of a search that found the thing with where that is."""
        shown, words = self._session.pictures.latest, report.thing
        if report.state is not SearchState.FOUND or shown is None:
            return report
        world = await self._session.fetch_world_model()
        where, step = await self._session.compute(lambda: say_found(world, words, shown))
        told = {"reason": f"{report.reason} {where}", "next": [], "next_step": step}
        return report.model_copy(update=told)

    def _find_earlier(self, thing: str) -> tuple[TakenPicture, ...]:
        taken = self._session.pictures.taken
        try:
            return leave_out_shown(taken, self._session.memory.read(), thing)
        except SemanticMapError:
            # The search goes on without an unreadable memory; find_place says so.
            return taken

    def _require_camera(self) -> None:
        if not self._session.robot.description.has_camera:
            raise LinkError(
                "This robot has no camera to look with.",
                hint="Use explore, and look at the map.",
            )

    async def _look_if_it_can(self) -> CameraSighting | None:
        robot = self._session.robot
        return await look_ahead(self._session) if robot.description.has_camera else None


def _exploring(bounds: Bounds) -> ApprovalScope:
    """Return the command to approve; where the call has no bound, the approval has one."""
    n_goals, duration_s = bounds.n_goals, bounds.duration_s
    n_drives = USUAL_DRIVES if n_goals is None else n_goals
    return ApprovalScope(
        what="explore",
        # At a pause it turns for the picture.
        n_drives=n_drives * (2 if bounds.stops_at_goals else 1),
        duration_s=USUAL_DURATION_S if duration_s is None else duration_s,
    )


def _searching(thing: str, max_looks: int, max_m: float) -> ApprovalScope:
    what = f"search for {shorten(thing)!r}, up to {max_m:g} m"
    return ApprovalScope(what=what, n_drives=max_looks, duration_s=USUAL_DURATION_S)


def _answer(report: Report, sighting: CameraSighting | None) -> CallToolResult:
    """Return a report as text and data, with the camera's picture."""
    content: list[TextContent | ImageContent] = [
        TextContent(type="text", text=report.model_dump_json())
    ]
    if sighting is not None:
        picture = sighting.picture
        data = base64.b64encode(picture.data).decode()
        content += [
            TextContent(type="text", text=sighting.text),
            ImageContent(type="image", data=data, mime_type=picture.media_type),
        ]
    return CallToolResult(content=list(content), structured_content=report.model_dump(mode="json"))
