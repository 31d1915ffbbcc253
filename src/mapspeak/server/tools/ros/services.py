"""The tools about services: what there is, what it takes and gives, calling it."""

import re
from collections.abc import Sequence
from functools import partial
from typing import Annotated, Any

from mcp.server.mcpserver import Image
from pydantic import Field

from mapspeak.ros.definitions.checking import check_message
from mapspeak.safety import Call
from mapspeak.server.tools.ros.census import find_server
from mapspeak.server.tools.ros.commands import RosCommands
from mapspeak.server.tools.ros.inquiry import Described, RosInquiry, full_name
from mapspeak.server.tools.ros.reading import say_stamp
from mapspeak.server.tools.ros.reports import Filter, Page, cut, list_page, show_message
from mapspeak.server.tools.ros.views import view_fields
from mapspeak.server.tools.toolset import ToolEffect, tool
from mapspeak.session import Session

Service = Annotated[str, Field(description="full name, such as /reset", max_length=200)]
RequestFields = Annotated[
    dict[str, Any] | None,
    Field(description="the request's fields as ros_service shows them; those left out: defaults"),
]
Timeout = Annotated[float, Field(description="seconds to wait for the answer", ge=0.1, le=25)]


FOLDED = {
    "parameters": (
        "parameter",
        r".+/(?:(?:describe|get|list|set)_parameters|get_parameter_types|set_parameters_atomically)",
    ),
    "types": ("type_description", r".+/get_type_description"),
    "loggers": ("logger", r".+/(?:get_loggers|set_logger_level|[gs]et_logger_levels)"),
    "rosapi": ("rosapi", r".*/rosapi(?:_params)?/\w+"),
}
"""Services that every node has, and rosapi's: their summary, and the filter that shows them."""


class ServiceTools:
    """Listing, describing and calling."""

    def __init__(self, session: Session, inquiry: RosInquiry, commands: RosCommands) -> None:
        self._session = session
        self._inquiry = inquiry
        self._commands = commands

    @tool(
        "List ROS services",
        ToolEffect.READS,
        leads="{ros_service} tells its type, fields and node. {ros_call} calls it.",
    )
    async def ros_services(self, filter: Filter = None, page: Page = 1) -> str:  # noqa: A002
        """List the robot's ROS services.

        Use it to find one.
        """
        services = await self._inquiry.connection.fetch_services()
        chosen, folded = (services, []) if filter else _fold(services)
        lines = {name: name for name in chosen}
        return "\n".join([list_page("services", lines, filter, page, len(services)), *folded])

    @tool("One ROS service", ToolEffect.READS, leads="Use it before {ros_call}.")
    async def ros_service(self, service: Service) -> str:
        """Tell a ROS service's type, the node that offers it, its fields and those it returns."""
        name = full_name(service)
        type_name = await self._inquiry.fetch_service_type(name)
        said = await self._inquiry.said(type_name, kind="srv")
        node = await find_server(self._inquiry.connection, name) or "(no node tells)"
        fields = (await self._inquiry.describe(said)).say()
        return cut(f"{name} {said}\noffered by: {node}\n{fields}")

    @tool(
        "Call a ROS service",
        ToolEffect.MOVES,
        former={"arguments": "fields"},
        leads="Use {ros_service} first for its fields.",
    )
    async def ros_call(
        self, service: Service, fields: RequestFields = None, timeout_s: Timeout = 5.0
    ) -> list[str | Image]:
        """Call a ROS service, which may move the robot or change it, and return its response.

        The request is checked against its type.
        """
        name = full_name(service)
        self._commands.check_name(Call(service=name, type="", arguments=fields or {}))
        type_name = await self._inquiry.fetch_service_type(name)
        said = await self._inquiry.said(type_name, kind="srv")
        self._commands.check_name(Call(service=name, type=said, arguments=fields or {}))
        described = await self._inquiry.describe(said)
        request = check_message(described.book, described.parts[0], fields or {})
        answer = await self._inquiry.connection.call_service(
            name, request, type_name=said, timeout_s=timeout_s
        )
        return await self._show(f"{name} ({said}) answered:", described, answer)

    async def _show(
        self, head: str, described: Described, answer: dict[str, Any]
    ) -> list[str | Image]:
        """Return the response; maps and the like within it as they are shown elsewhere."""
        fields = described.book[described.parts[1]].fields
        views, plain = await self._session.compute(partial(view_fields, fields, answer))
        parts: list[str] = [head]
        for name, view in views.items():
            stamp = say_stamp(answer[name], now_s=self._session.robot.now_s)
            parts += [f"{name}: {view.text}", *([stamp] if stamp else [])]
        if plain or not views:
            parts.append(show_message(plain))
        pictures = [view.picture for view in views.values() if view.picture is not None]
        return [cut("\n".join(parts)), *pictures]


def _fold(services: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the services that are worth a line each, and a line for each kind of the others."""
    kinds = {name: _find_kind(name) for name in services}
    folded = [
        f'{n} more of {what}: ask with filter "{word}"'
        for what, (word, _) in FOLDED.items()
        if (n := sum(kind == what for kind in kinds.values()))
    ]
    return [name for name, kind in kinds.items() if kind is None], folded


def _find_kind(service: str) -> str | None:
    fitting = (what for what, (_, form) in FOLDED.items() if re.fullmatch(form, service))
    return next(fitting, None)
