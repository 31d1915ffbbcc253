"""The tools about services: what there is, what it takes and gives, calling it."""

import re
from functools import partial
from typing import Annotated, Any

from mcp.server.mcpserver import Image
from pydantic import Field

from mapspeak.ros.census import find_server
from mapspeak.safety import Call
from mapspeak.server.text.ros.listening import list_page, say_stamp
from mapspeak.server.text.ros.views import view_fields
from mapspeak.server.text.values import cut, show_message
from mapspeak.server.tools.ros.goals import RosAccess
from mapspeak.server.tools.ros.inquiry import full_name
from mapspeak.server.tools.ros.topics import Filter, Page
from mapspeak.server.tools.toolset import ToolEffect, tool

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

    def __init__(self, ros: RosAccess) -> None:
        self._session = ros.session
        self._inquiry = ros.inquiry

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
        kinds = {name: None if filter else find_folded(name) for name in services}
        folded = [
            f'{n} more of {what}: ask with filter "{word}"'
            for what, (word, _) in FOLDED.items()
            if (n := sum(kind == what for kind in kinds.values()))
        ]
        lines = {name: name for name, kind in kinds.items() if kind is None}
        return "\n".join([list_page("services", lines, filter, page, len(services)), *folded])

    @tool("One ROS service", ToolEffect.READS, leads="Use it before {ros_call}.")
    async def ros_service(self, service: Service) -> str:
        """Tell a ROS service's type, the node that offers it, its fields and those it returns."""
        name = full_name(service)
        type_name = await self._inquiry.fetch_service_type(name)
        node = await find_server(self._inquiry.connection, name) or "(no node tells)"
        described = await self._inquiry.describe(type_name, kind="srv")
        return cut(f"{name} {described.said}\noffered by: {node}\n{described.say()}")

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
        name, fields = full_name(service), fields or {}
        self._inquiry.check_policy(Call(service=name, type="", arguments=fields))
        type_name = await self._inquiry.fetch_service_type(name)
        said = await self._inquiry.say_type(type_name, kind="srv")
        self._inquiry.check_policy(Call(service=name, type=said, arguments=fields))
        described = await self._inquiry.describe(said)
        request = described.check(fields)
        answer = await self._inquiry.connection.call_service(
            name, request, type_name=said, timeout_s=timeout_s
        )
        views, plain = await self._session.compute(
            partial(view_fields, described.answer_fields, answer)
        )
        parts = [f"{name} ({said}) answered:"]
        for field, view in views.items():
            stamp = say_stamp(answer[field], now_s=self._session.robot.now_s)
            parts += [f"{field}: {view.text}", *filter(None, [stamp])]
        if plain or not views:
            parts.append(show_message(plain))
        pictures = [view.picture for view in views.values() if view.picture is not None]
        return [cut("\n".join(parts)), *pictures]


def find_folded(service: str) -> str | None:
    """Return which services of every node, or of rosapi, one belongs to; None for another one."""
    fitting = (what for what, (_, form) in FOLDED.items() if re.fullmatch(form, service))
    return next(fitting, None)
