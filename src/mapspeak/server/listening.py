"""Clients that are told when the list of tools changes, whichever protocol they speak."""

from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any

from mcp.server import MCPServer, NotificationOptions, ServerRequestContext
from mcp.server.connection import Connection
from mcp.server.subscriptions import ToolsListChanged


class ListHearers:
    """Every client that has asked for the list of tools.

    Clients of the newer protocol listen to a stream that they open; older ones are told over their
    connection, and only once they know that they will be.

    Args:
        server: Whose list it is.
    """

    def __init__(self, server: MCPServer[Any]) -> None:
        self._bus = server._subscriptions  # noqa: SLF001 - what `Context.notify_tools_changed` uses
        self._connections: set[Connection] = set()
        self._others: list[Callable[[], Awaitable[None]]] = []
        lowlevel = server._lowlevel_server  # noqa: SLF001 - the SDK offers no other way
        lowlevel.create_initialization_options = partial(  # type: ignore[method-assign]
            lowlevel.create_initialization_options, NotificationOptions(tools_changed=True)
        )

    def note(self, context: ServerRequestContext[Any]) -> None:
        """Remember a client while it is connected."""
        connection = context.session._connection  # noqa: SLF001 - sessions are one per request
        if connection not in self._connections:
            self._connections.add(connection)
            connection.exit_stack.callback(self._connections.discard, connection)

    def pass_on(self, tell: Callable[[], Awaitable[None]]) -> None:
        """Tell others too: the list is a part of theirs."""
        self._others.append(tell)

    async def tell(self) -> None:
        """Tell all clients that they should ask for the list again."""
        await self._bus.publish(ToolsListChanged())
        for connection in list(self._connections):
            await connection.send_tool_list_changed()
        for tell in self._others:
            await tell()
