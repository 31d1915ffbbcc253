"""The tool that follows a route: several places in order, planned as a whole."""

from collections.abc import Sequence
from typing import Annotated

from mcp.server.mcpserver import Context, Image
from mcp_types import CallToolResult, ContentBlock, ImageContent, TextContent
from pydantic import Field

from mapspeak.driving.routes.following import (
    RouteBook,
    RouteProgress,
    RouteState,
)
from mapspeak.driving.routes.ordering import RouteOrder
from mapspeak.driving.routes.planning import RoutePlan, WhenBlocked
from mapspeak.errors import GoalError
from mapspeak.safety import ApprovalScope, within_scope
from mapspeak.server.reports.exploring import RouteAnswer
from mapspeak.server.text.wording import shorten
from mapspeak.server.tools.caller import (
    AT_MOST_LONGEST_WAIT,
    LONGEST_WAIT_S,
    tell_progress,
)
from mapspeak.server.tools.drive import MOST_PICTURES, ViewTools
from mapspeak.server.tools.sightings import look_ahead
from mapspeak.server.tools.toolset import ToolEffect, tool
from mapspeak.session import Session

MOST_STOPS = 20
SCOPE_S = 1800.0
"""Robot time for which a person's approval of a route is valid."""

Stops = Annotated[
    list[Annotated[str, Field(min_length=1, max_length=200)]] | None,
    Field(
        description='ids, names, points or phrases: "all rooms", "every extinguisher"; '
        "left out to go on",
        max_length=MOST_STOPS,
    ),
]
Order = Annotated[RouteOrder, Field(description="of the stops: as given, or on the shortest way")]
EndAt = Annotated[
    str | None, Field(description='a last stop, such as "start", where it is now', max_length=200)
]
Look = Annotated[bool, Field(description="answer with a picture at each stop")]
Around = Annotated[bool, Field(description="with pictures to all sides instead")]
Pause = Annotated[float, Field(description="seconds to stand at each stop", ge=0, le=600)]
Blocked = Annotated[
    WhenBlocked, Field(description="a stop that cannot be reached: wait for you, or skip it")
]
Wait = Annotated[
    float,
    Field(description="seconds until it answers, still driving", ge=0, le=LONGEST_WAIT_S),
    AT_MOST_LONGEST_WAIT,
]


Drive = Annotated[
    bool, Field(description="false: only plan: order, ways and time; nothing else changes")
]


class RouteTools:
    """Following routes."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._routes = RouteBook(session)
        self._scope = ApprovalScope(what="follow a route", n_drives=0, duration_s=SCOPE_S)
        self._looks_around = False
        self._views = ViewTools(session)

    @tool(
        "Follow a route",
        ToolEffect.MOVES,
        has_report=True,
        leads="Use it instead of several {navigate_to}. A call after {stop_robot} resumes it.",
    )
    async def follow_route(
        self,
        context: Context,
        stops: Stops = None,
        order: Order = RouteOrder.AS_GIVEN,
        end_at: EndAt = None,
        look: Look = False,  # noqa: FBT002 - tools are called by name
        look_around: Around = False,  # noqa: FBT002 - tools are called by name
        pause_s: Pause = 0.0,
        when_blocked: Blocked = WhenBlocked.WAIT,
        wait_s: Wait = 20.0,
        *,
        drive: Drive = True,
    ) -> Annotated[CallToolResult, RouteAnswer]:
        """Drive the robot past several places, as given or on the shortest way.

        Words that fit several places ("the extinguisher") are taken where the whole route is
        shortest. It sets out to the next stop only while it is called: call it again without stops
        to go on.
        """
        if not drive:
            progress = await self._routes.plan(
                _require(stops),
                pause_s=pause_s,
                order=order,
                end_at=end_at,
                when_blocked=when_blocked,
            )
            return _answer(progress)
        if stops is not None:
            plan = await self._routes.begin(
                stops,
                pause_s=pause_s,
                is_looking=look or look_around,
                order=order,
                end_at=end_at,
                when_blocked=when_blocked,
            )
            self._looks_around = look_around
            self._scope = _scope_of(stops, plan, looks_around=look_around)
        with within_scope(self._scope):
            progress = await self._routes.advance(
                wait_s=wait_s,
                when_blocked=when_blocked,
                on_progress=tell_progress(context),
            )
            robot = self._session.robot
            sees = progress.state is RouteState.AT_STOP and robot.description.has_camera
            shown = await self._look(context) if sees else []
        return _answer(progress, shown)

    async def _look(self, context: Context) -> list[str | Image]:
        if self._looks_around:
            return await self._views.look_around(context)
        sighting = await look_ahead(self._session)
        return [sighting.text, sighting.image]


def _require(stops: Sequence[str] | None) -> Sequence[str]:
    if stops is None:
        raise GoalError("There is nothing to plan.", hint="Give the stops.")
    return stops


def _answer(progress: RouteProgress, shown: Sequence[str | Image] = ()) -> CallToolResult:
    report = RouteAnswer.of(progress)
    text = TextContent(type="text", text=report.model_dump_json())
    content: list[ContentBlock] = [text, *map(_as_content, shown)]
    return CallToolResult(content=content, structured_content=report.model_dump(mode="json"))


def _scope_of(stops: Sequence[str], plan: RoutePlan, *, looks_around: bool) -> ApprovalScope:
    """Return the commands to approve: the drives to all stops, and the turns at them."""
    past = f"drive past {'; '.join(shorten(each) for each in stops)}"
    what = f"{past} and look around at each" if looks_around else past
    n_turns = MOST_PICTURES if looks_around else 0
    return ApprovalScope(what=what, n_drives=len(plan.stops) * (1 + n_turns), duration_s=SCOPE_S)


def _as_content(shown: str | Image) -> TextContent | ImageContent:
    if isinstance(shown, str):
        return TextContent(type="text", text=shown)
    return shown.to_image_content()
