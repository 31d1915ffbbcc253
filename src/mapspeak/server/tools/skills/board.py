"""The skills that are tools now: listed, called, put up and taken down while clients are there."""

import re
from collections.abc import Callable, Collection, Iterable, Mapping
from typing import Any

from mcp.server.mcpserver import Context
from mcp.server.mcpserver.exceptions import ToolError
from mcp_types import CallToolResult, TextContent, ToolAnnotations
from mcp_types import Tool as ListedTool

from mapspeak.errors import MapspeakError, SkillError
from mapspeak.memory.quoting import quote
from mapspeak.server.text.offered import say_error
from mapspeak.server.text.skills import describe_skill
from mapspeak.server.tools.caller import LONGEST_WAIT_S, shorten_wait
from mapspeak.server.tools.skills.running import say_run, tell_news
from mapspeak.server.tools.skills.schema import schema_of
from mapspeak.skill import ParameterKind, Skill, SkillEffect, SkillParameter
from mapspeak.skills.arguments import check_value
from mapspeak.skills.runs import SkillRuns

WAIT = SkillParameter(
    "wait_s",
    ParameterKind.NUMBER,
    unit="s to wait for its end",
    least=0.0,
    most=LONGEST_WAIT_S,
    default=10.0,
)
"""What the tool of a skill takes that may last longer than a call."""
RESERVED = frozenset({"wait_s", "for_s", "robot"})
"""Names that no argument of a skill may have: they are the tool's own."""
MOST_NAME = 60
MOST_TITLE = 60


def name_tool(name: str, *, taken: Collection[str] = ()) -> str:
    """Return what a name of ROS or of a skill is called as a tool, like no other tool."""
    plain = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_").lower()[-MOST_NAME:].strip("_")
    base = plain or "skill"
    if base not in taken:
        return base
    numbered = (f"robot_{base}" if n == 1 else f"robot_{base}_{n}" for n in range(1, 1000))
    return next(each for each in numbered if each not in taken)


class SkillBoard:
    """Offers skills as tools.

    Args:
        runs: Runs them.
        others: The names of the tools that are no skills.

    Attributes:
        is_read_only: It takes only skills that read.
        n_changes: Counts what was put up and taken down.
    """

    def __init__(self, runs: SkillRuns, *, others: Callable[[], Collection[str]]) -> None:
        self.runs = runs
        self.is_read_only = False
        self.n_changes = 0
        self._others = others
        self._offered: dict[str, tuple[Skill, ListedTool]] = {}

    @property
    def skills(self) -> Mapping[str, Skill]:
        """The skills by the names of their tools."""
        return {name: skill for name, (skill, _) in self._offered.items()}

    @property
    def listed(self) -> Iterable[ListedTool]:
        """The tools as clients are told of them."""
        return [tool for _, tool in self._offered.values()]

    @property
    def taken_names(self) -> set[str]:
        """The names that another tool or skill has."""
        return {*self._others(), *self._offered}

    def put_up(self, skill: Skill) -> None:
        """Offer a skill under its name, in place of one of that name.

        Raises:
            SkillError: A tool that is no skill is called so.
        """
        spec = skill.spec
        if spec.name in self._others():
            raise SkillError(f"{spec.name!r} is a tool, and no skill's name.", hint="Rename it.")
        reads = spec.effect is SkillEffect.READS
        if self.is_read_only and not reads:
            return
        acts = ToolAnnotations(open_world_hint=False)
        tool = ListedTool(
            name=spec.name,
            title=quote(spec.description or spec.name, most=MOST_TITLE).strip('"'),
            description=describe_skill(skill),
            input_schema=schema_of((*spec.parameters, *((WAIT,) if _is_long(skill) else ()))),
            annotations=ToolAnnotations(read_only_hint=True) if reads else acts,
        )
        self._offered[spec.name] = (skill, tool)
        self.n_changes += 1

    def take_down(self, name: str) -> None:
        """Withdraw a skill; its runs go on."""
        if self._offered.pop(name, None) is not None:
            self.n_changes += 1

    async def call(
        self, name: str, arguments: Mapping[str, Any], context: Context[Any, Any] | None
    ) -> CallToolResult:
        """Run a skill, and answer how it ended or, where it takes long, how it is called.

        Raises:
            ToolError: It could not be begun.
        """
        skill, own = self._offered[name][0], dict(arguments)
        try:
            wait_s = LONGEST_WAIT_S
            if _is_long(skill):
                given = shorten_wait(own.pop(WAIT.name, WAIT.default))
                wait_s = check_value(WAIT, given, where=WAIT.name, what=name)
            run = await self.runs.begin(
                skill, own, wait_s=wait_s, on_news=None if context is None else tell_news(context)
            )
        except MapspeakError as error:
            raise ToolError(say_error(error)) from error
        return CallToolResult(
            content=[TextContent(type="text", text=say_run(run, self.runs.questions))]
        )


def _is_long(skill: Skill) -> bool:
    return skill.spec.timeout_s > LONGEST_WAIT_S
