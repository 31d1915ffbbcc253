"""The MCP server around a session: chosen tools, readable errors, lean schemas."""

import json
import logging
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import anyio
from mcp.server import MCPServer, ServerRequestContext
from mcp.server.mcpserver import Context
from mcp.server.mcpserver.exceptions import ToolError
from mcp.shared.exceptions import MCPError
from mcp_types import (
    INVALID_PARAMS,
    CallToolResult,
    GetPromptResult,
    InputRequiredResult,
    ListToolsResult,
    PaginatedRequestParams,
)
from mcp_types import Tool as ListedTool

from mapspeak import __version__
from mapspeak.errors import LinkError
from mapspeak.memory.quoting import clean_line
from mapspeak.safety import ApprovalNeededError, Caller, calling
from mapspeak.server.remarks import Remarks, shorten_report, show_controls_of
from mapspeak.server.reports.representations import Representation
from mapspeak.server.text.offered import (
    explain,
    offering,
    say_not_offered,
    write_instructions,
)
from mapspeak.server.text.wording import show_controls
from mapspeak.server.tools.caller import Asking, client_of
from mapspeak.server.tools.ros.goals import RosAccess
from mapspeak.server.tools.skills.book import SkillBook
from mapspeak.server.tools.skills.exposing import Exposure
from mapspeak.server.tools.skills.tools import call_skill
from mapspeak.server.tools.toolset import Tool, ToolEffect, lean_input, lean_output
from mapspeak.server.toolsets import (
    STOP,
    ToolListSubscribers,
    add_prompts,
    build_toolsets,
    choose_tools,
)
from mapspeak.server.view.chat import VIEW_MAP, ChatView, make_apps, offer_page
from mapspeak.server.wire.calllog import CallNoting
from mapspeak.session import Session
from mapspeak.skills.skillsfile import OwnersEntry

logger = logging.getLogger(__name__)

DEFAULT_TOOLSETS = ("look", "places", "drive", "paper")

MOST_BYTES = 1_000_000
"""Of the arguments of one call, written as JSON; no model writes a hundredth of that."""


class MapspeakServer(MCPServer[Any]):
    """An MCP server with one entry for every call: it notes the client and makes errors readable.

    Args:
        known: All toolsets, offered or not.
        instructions: The text that a model reads before its first call.
        call_log: Where every call is noted; None for nowhere.

    Attributes:
        book: Of all its skills; those of them that are tools come and go.
        subscribers: The clients to notify of these changes.
        exposure: Looks for those that the robot offers; None without patterns.
    """

    def __init__(
        self,
        session: Session,
        book: SkillBook,
        known: Mapping[str, Sequence[Tool]],
        *,
        instructions: str,
        call_log: CallNoting | None = None,
    ) -> None:
        super().__init__(
            "mapspeak",
            title="mapspeak: a robot's map, eyes and memory of places",
            instructions=instructions,
            version=__version__,
            log_level="WARNING",
            extensions=[make_apps()],
        )
        self.add_tool(ChatView(session).view_map, name=VIEW_MAP, structured_output=False)
        self.book = book
        self._session = session
        self._call_log, self._known = call_log, known
        self._offered: dict[str, Tool] = {}
        self._remarks = Remarks(session)
        self._told = book.list_tools()
        self.subscribers = ToolListSubscribers(self)
        self.exposure: Exposure | None = None

    @property
    def tool_names(self) -> Collection[str]:
        """The names of the offered tools that are no skills."""
        return self._offered

    def expose(self, ros: RosAccess, patterns: tuple[str, ...]) -> None:
        """Look for interfaces of the robot with some names, once `keep_skills` runs."""
        self.exposure = Exposure(ros, self.book, patterns, tell=self.tell_changes)

    async def tell_changes(self) -> None:
        """Tell clients that skills have become tools, have changed or are none any more."""
        if (listed := self.book.list_tools()) != self._told:
            self._told = listed
            await self.subscribers.tell()

    async def keep_skills(self) -> None:
        """Let skills run, and look for those that the robot offers, until cancelled."""
        work = anyio.sleep_forever if self.exposure is None else self.exposure.keep_looking
        await self.book.runs.keep_going(work)

    async def call_tool(
        self, name: str, arguments: dict[str, Any], context: Context[Any, Any] | None = None
    ) -> CallToolResult | InputRequiredResult:
        """Call a tool; a `MapspeakError` reaches the model with its hint."""
        if name == VIEW_MAP:
            return await super().call_tool(name, arguments, context)
        if (tool := self._offered.get(name)) is not None:
            arguments = _read_arguments(tool, arguments)
        if self._call_log is None:
            return await self._call_readably(name, arguments, context)
        with self._call_log.noting(name, arguments) as note:
            try:
                answer = await self._call_readably(name, arguments, context)
            except ToolError as error:
                note.error = str(error)
                raise
            note.answer = answer if isinstance(answer, CallToolResult) else None
            return answer

    async def _call_readably(
        self, name: str, arguments: dict[str, Any], context: Context[Any, Any] | None
    ) -> CallToolResult | InputRequiredResult:
        session_id = "" if context is None else client_of(context)
        caller = Caller(client=name_client(context), tool=name, session=session_id)
        tool = self._offered.get(name)
        # What stops waits for no memory.
        has_remarks = tool is None or tool.effect is not ToolEffect.STOPS
        with self._session.client_is_heard(), calling(caller), offering(self._offered):
            self._check_arguments(name, arguments)
            if has_remarks:
                await self._remarks.meet(caller.client)
            try:
                answer = await self._call_with_approval(name, arguments, context)
            except ToolError as error:
                readable = explain(name, error.__cause__)
                if readable is None:
                    raise
                renamed = await self._remarks.say_renamed(arguments)
                if renamed not in readable:
                    readable = f"{renamed} {readable}"
                raise ToolError(show_controls(readable)) from error.__cause__
            self._note_memory(name, arguments)
            if not isinstance(answer, CallToolResult):
                return answer
            answer = shorten_report(answer)
            if has_remarks:
                answer = await self._remarks.tell(caller.client, arguments, answer)
            return show_controls_of(answer)

    def _note_memory(self, name: str, arguments: dict[str, Any]) -> None:
        """Note in the audit log that a tool has changed the memory."""
        guard, tool = self._session.guard, self._offered.get(name)
        if guard is not None and tool is not None and tool.effect is ToolEffect.REMEMBERS:
            what = arguments.get("name") or arguments.get("text") or arguments.get("event") or name
            said = f"remembered {str(what)[:120]!r}"
            guard.note_event("memory", said, robot_s=self._session.robot.now_s)

    async def _call_with_approval(
        self, name: str, arguments: dict[str, Any], context: Context[Any, Any] | None
    ) -> CallToolResult | InputRequiredResult:
        """Call a tool, and once more when a person has approved its request."""
        guard = self._session.guard
        if guard is None:
            return await self._run(name, arguments, context)
        asking = Asking(context, approval=guard.policy.approval, client=name_client(context))
        if refused := asking.take_answers(guard.approvals):
            raise ToolError(refused)
        try:
            return await self._run(name, arguments, context)
        except ToolError as error:
            needed = error.__cause__
            if not isinstance(needed, ApprovalNeededError) or not asking.can_ask:
                raise
            question = asking.ask_by_answer(needed, guard.approvals)
            if question is not None:
                return question
            if refused := await asking.ask_at_once(needed, guard.approvals):
                raise ToolError(refused) from error
        return await self._run(name, arguments, context)

    async def _run(
        self, name: str, arguments: dict[str, Any], context: Context[Any, Any] | None
    ) -> CallToolResult | InputRequiredResult:
        if (skill := self.book.offered.get(name)) is not None:
            return await call_skill(skill, arguments, runs=self.book.runs, context=context)
        if name not in self._offered and (toolsets := self._find_toolsets(name)):
            raise ToolError(say_not_offered(name, toolsets))
        try:
            return await super().call_tool(name, arguments, context)
        finally:
            await self.tell_changes()

    def _find_toolsets(self, name: str) -> list[str]:
        """Return the toolsets that have a tool, offered or not."""
        return [
            toolset for toolset, tools in self._known.items() if any(t.name == name for t in tools)
        ]

    def offer(self, tool: Tool) -> None:
        """Add a tool to those that can be called."""
        self._offered[tool.name] = tool
        self.add_tool(
            tool.function,
            title=tool.title,
            description=tool.description,
            annotations=tool.annotations,
            meta=tool.meta,
            structured_output=tool.has_report,
        )

    async def get_prompt(
        self,
        name: str,
        arguments: dict[str, Any] | None = None,
        context: Context[Any, Any] | None = None,
    ) -> GetPromptResult | InputRequiredResult:
        """Return a prompt; an unknown name is the caller's mistake and not the server's."""
        known = sorted(prompt.name for prompt in await self.list_prompts())
        if name not in known:
            message = f"There is no prompt named {name!r}; there are: {', '.join(known)}."
            raise MCPError(INVALID_PARAMS, message)
        return await super().get_prompt(name, arguments, context)

    def _check_arguments(self, name: str, given: dict[str, Any]) -> None:
        """Refuse what would be dropped without a word, such as yaw, or taken for 1, as true is.

        Too large arguments would cut the connection to a robot, which limits the size of a message.
        """
        try:
            n_bytes = len(json.dumps(given, default=str, ensure_ascii=False).encode())
        except UnicodeEncodeError as error:
            raise ToolError(f"{name} was called with text that is not valid Unicode.") from error
        if n_bytes > MOST_BYTES:
            raise ToolError(
                f"{name} was called with {n_bytes / 1e6:.1f} MB of arguments; at most "
                f"{MOST_BYTES / 1e6:g} MB are taken. Nothing was done; send less."
            )
        tool = self._offered.get(name)
        if tool is None:
            return
        strangers = sorted(set(given) - tool.arguments)
        # A stop is one, whatever is said beside it.
        if strangers and name != STOP:
            known = ", ".join(sorted(tool.arguments)) or "none"
            raise ToolError(f"{name} has no argument {', '.join(strangers)}; it has: {known}.")
        flags = {key for key, value in given.items() if isinstance(value, bool)}
        if wrong := sorted(flags & tool.numbers):
            raise ToolError(f"{name} wants a number for {', '.join(wrong)}, not true or false.")

    async def note_hang_up(self, client: str) -> None:
        """Stop the drive and end the skills of a client that is gone."""
        try:
            await self._session.client_is_gone(client)
        except LinkError as error:
            logger.warning("The robot could not be stopped yet: %s", error)
        await self.book.runs.client_is_gone(client)

    async def _handle_list_tools(
        self, ctx: ServerRequestContext[Any], params: PaginatedRequestParams | None
    ) -> ListToolsResult:
        self.subscribers.note(ctx)
        return offer_page(await super()._handle_list_tools(ctx, params), ctx)

    async def list_tools(self) -> list[ListedTool]:
        """List the tools with schemas freed of parts that no model needs."""
        listed = await super().list_tools()
        lean = [
            tool.model_copy(
                update={
                    "input_schema": lean_input(tool.input_schema),
                    "output_schema": lean_output(tool.output_schema),
                }
            )
            for tool in listed
            if tool.name != VIEW_MAP
        ]
        return [*lean, *self.book.list_tools()]


def _read_arguments(tool: Tool, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments under the tool's own names, lists that came as text as lists."""
    former = tool.former
    named = {
        key if former.get(key, key) in given else former[key]: value for key, value in given.items()
    }
    return {
        key: _read_list(value) if key in tool.lists and isinstance(value, str) else value
        for key, value in named.items()
    }


def _read_list(text: str) -> list[Any]:
    """Return a list that a client wrote as text: as JSON, or its only element."""
    try:
        read = json.loads(text)
    except (ValueError, RecursionError):
        return [text]
    return read if isinstance(read, list) else [text]


def name_client(context: Context[Any, Any] | None) -> str:
    """Return the caller's name for the audit log: the client's own name and its HTTP session."""
    if context is None:
        return "unknown"
    about = context.session.client_params
    name = "client" if about is None else about.client_info.name
    session_id = (context.headers or {}).get("mcp-session-id", "")
    return f"{clean_line(name)[:60]} {clean_line(session_id)[:8]}".strip()


def build_server(
    session: Session,
    *,
    toolsets: Iterable[str] = DEFAULT_TOOLSETS,
    tools: Iterable[str] = (),
    is_read_only: bool = False,
    representation: Representation = Representation.PICTURE_TABLE,
    call_log: CallNoting | None = None,
    expose: Sequence[str] = (),
    skills: Sequence[OwnersEntry] = (),
) -> MapspeakServer:
    """Build the server with the chosen tools, always in the same order.

    Args:
        session: What the tools work on.
        toolsets: Names of the groups to offer.
        tools: Single tools to offer besides.
        is_read_only: Leaves out every tool that changes anything; stopping stays.
        representation: How look_at_map shows the map.
        call_log: Where every call is noted; None for nowhere.
        expose: Patterns of names that are tools too while the robot offers them.
        skills: The owner's; each is a tool, as are the robot's own and saved missions.

    Raises:
        ConfigError: There is no such toolset or tool.
    """
    is_read_only = is_read_only or (session.guard is not None and session.guard.policy.is_read_only)
    if is_read_only:
        session.episodes.close()
    elif session.ros is not None:
        session.ros.advertise_early()
    book = SkillBook(session, ros := RosAccess(session), skills)
    known = build_toolsets(session, representation, ros=ros, book=book)
    sets = {*toolsets} | ({"skills"} if expose or skills else set())
    tools = {*tools} | ({STOP} if expose or skills else set())
    chosen = choose_tools(known, toolsets=sets, tools=tools, is_read_only=is_read_only)
    names = {tool.name for tool in chosen}
    if sets & {"skills", "missions"}:
        book.offer(beside=names, is_read_only=is_read_only)
    with offering(names):
        moves = any(tool.effect is ToolEffect.MOVES for tool in chosen)
        told = write_instructions(moves=moves)
        server = MapspeakServer(session, book, known, instructions=told, call_log=call_log)
        for tool in chosen:
            server.offer(tool)
    if expose:
        server.expose(ros, tuple(expose))
    add_prompts(server, names)
    return server
