"""The tool that follows a route: several places in order, planned as a whole."""

import base64
from typing import Annotated

from mcp.server.mcpserver import Context
from mcp_types import CallToolResult, ImageContent, TextContent
from pydantic import Field

from mapspeak.driving.routes.following import RouteBook, RouteState, WhenBlocked
from mapspeak.safety import Errand, on_errand
from mapspeak.server.reports.routes import RouteAnswer
from mapspeak.server.text.wording import shorten
from mapspeak.server.tools.asking import (
    AT_MOST_LONGEST_WAIT,
    LONGEST_WAIT_S,
    client_of,
    tell_progress,
)
from mapspeak.server.tools.sightings import CameraSighting, look_ahead
from mapspeak.server.tools.toolset import ToolEffect, tool
from mapspeak.session import Session

MOST_STOPS = 20
ERRAND_S = 1800.0
"""A person's word for a route is good for so much robot time."""

Stops = Annotated[
    list[Annotated[str, Field(min_length=1, max_length=200)]] | None,
    Field(
        description='in order: ids, names, points or phrases: "all rooms", "every extinguisher"; '
        "left out to go on",
        max_length=MOST_STOPS,
    ),
]
Look = Annotated[bool, Field(description="answer with a picture at each stop")]
Pause = Annotated[float, Field(description="seconds to stand at each stop", ge=0, le=600)]
Blocked = Annotated[
    WhenBlocked, Field(description="a stop that cannot be reached: wait for you, or skip it")
]
Wait = Annotated[
    float,
    Field(description="seconds until it answers, still driving", ge=0, le=LONGEST_WAIT_S),
    AT_MOST_LONGEST_WAIT,
]


class RouteTools:
    """Following routes."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._routes = RouteBook(session)
        self._errand = Errand(what="follow a route", n_drives=0, duration_s=ERRAND_S)

    @tool(
        "Follow a route",
        ToolEffect.MOVES,
        has_report=True,
        leads="Use it instead of several {navigate_to}. It goes on also after {stop_robot}.",
    )
    async def follow_route(
        self,
        context: Context,
        stops: Stops = None,
        look: Look = False,  # noqa: FBT002 - tools are called by name
        pause_s: Pause = 0.0,
        when_blocked: Blocked = WhenBlocked.WAIT,
        wait_s: Wait = 20.0,
    ) -> Annotated[CallToolResult, RouteAnswer]:
        """Drive the robot past several places in order, on the shortest way as a whole.

        Words that fit several places ("the extinguisher") are taken where the whole route is
        shortest. It sets out to the next stop only while it is called: call it again without stops
        to go on.
        """
        if stops is not None:
            await self._routes.begin(stops, pause_s=pause_s, is_looking=look)
            past = f"drive past {'; '.join(shorten(each) for each in stops)}"
            self._errand = Errand(what=past, n_drives=len(stops), duration_s=ERRAND_S)
        with on_errand(self._errand):
            progress = await self._routes.advance(
                wait_s=wait_s,
                when_blocked=when_blocked,
                on_progress=tell_progress(context),
                client=client_of(context),
            )
        robot = self._session.robot
        sees = progress.state is RouteState.AT_STOP and robot.description.has_camera
        return _answer(
            RouteAnswer.of(progress),
            await look_ahead(self._session) if sees else None,
        )


def _answer(report: RouteAnswer, sighting: CameraSighting | None) -> CallToolResult:
    """Return the report as text and data, and what the camera sees with it."""
    content: list[TextContent | ImageContent] = [
        TextContent(type="text", text=report.model_dump_json())
    ]
    if sighting is not None:
        data = base64.b64encode(sighting.picture.data).decode()
        content += [
            TextContent(type="text", text=sighting.text),
            ImageContent(type="image", data=data, mime_type=sighting.picture.media_type),
        ]
    return CallToolResult(content=list(content), structured_content=report.model_dump(mode="json"))
