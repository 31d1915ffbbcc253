"""A skill as a tool: how it is listed and called; the tools about runs, and what they answer."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

from mcp.server.mcpserver import Context
from mcp.server.mcpserver.exceptions import ToolError
from mcp_types import CallToolResult, TextContent, ToolAnnotations
from mcp_types import Tool as ListedTool
from pydantic import Field

from mapspeak.errors import MapspeakError
from mapspeak.memory.quoting import clean_line, quote
from mapspeak.server.text.offered import lead, say_error
from mapspeak.server.text.ros.values import cut, show_message
from mapspeak.server.text.skills import (
    CODES,
    GOES_ON,
    describe_skill,
    say_conditions,
    say_remark,
    say_waiting,
)
from mapspeak.server.text.wording import say_count
from mapspeak.server.tools.caller import LONGEST_WAIT_S, WaitForEnd, find_reader, shorten_wait
from mapspeak.server.tools.toolset import ToolEffect, tool
from mapspeak.skill import (
    ParameterKind,
    Skill,
    SkillEffect,
    SkillOutcome,
    SkillParameter,
    SkillState,
)
from mapspeak.skills.arguments import check_value, schema_of
from mapspeak.skills.runs import OnNews, SkillRun, SkillRuns

Handle = Annotated[
    str | None, Field(description="such as S1; the latest when left out", max_length=40)
]
WAIT = SkillParameter(
    "wait_s",
    ParameterKind.NUMBER,
    unit="s to wait for its end",
    least=0.0,
    most=LONGEST_WAIT_S,
    default=10.0,
)
"""What the tool of a skill takes that may last longer than a call."""
MOST_TITLE = 60
MOST_QUOTE = 300


class SkillRunTools:
    """Asking and cancelling; each skill is a tool of its own."""

    def __init__(self, runs: SkillRuns) -> None:
        self._runs = runs
        self._told: tuple[str, str, Sequence[str]] | None = None
        # The reader of the last answer, the run under way that it told of, and its steps.

    @tool("How a skill stands", ToolEffect.READS)
    async def skill_status(
        self, context: Context, run: Handle = None, wait_s: WaitForEnd = 0.0
    ) -> str:
        """Say how a run of a skill stands: state, progress, result, also long after.

        Use it to wait for the end.
        """
        found, reader = self._runs.find(run), find_reader(context)
        await found.wait(wait_s=wait_s, on_news=tell_news(context))
        before, self._told = self._told, None
        told = before[2] if before and before[:2] == (reader, found.handle) else ()
        if reader is not None and not found.is_over:
            self._told = reader, found.handle, found.progress.account
        return say_run(found, () if found.is_over else told)

    @tool(
        "Cancel a skill",
        ToolEffect.STOPS,
        leads="Use {stop_robot} instead when anything is urgent.",
    )
    async def cancel_skill(self, run: Handle = None) -> str:
        """Cancel a run of a skill; nothing of it goes on at the robot then."""
        found = self._runs.find(run)
        if found.is_over:
            over = "It was over already, nothing was cancelled."
            return f"{over}\n{say_run(found)}"
        await found.cancel()
        return say_run(found)


def tell_news(context: Context) -> OnNews:
    """Return the function that reports progress to a caller."""
    told = ""

    async def tell(run: SkillRun) -> None:
        nonlocal told
        signs = f"{say_count(run.n_progress, 'sign')} of progress"
        # Of a mission a step is told once, however long it goes on.
        steps = run.progress.account
        said = f"{run.handle} {run.state}, {steps[-1] if steps else signs}"
        if said != told:
            told = said
            await context.report_progress(run.passed_s, message=said)

    return tell


def say_run(run: SkillRun, steps_told: Sequence[str] = ()) -> str:
    """Return the state of a run, with its latest progress, the questions it asks, or its result.

    Args:
        steps_told: Those that the reader knows.
    """
    told, name = run.progress, run.skill.spec.name
    parts = [f"{run.handle} ({name}): {run.state} after {run.passed_s:.1f} s."]
    parts += [say_remark(run.skill), _say_account(told.account, steps_told)]
    if run.outcome is not None:
        parts.append(_say_outcome(run.outcome))
    elif run.error is not None:
        parts.append(str(run.error))
    else:
        if told.values:
            parts.append(f"latest progress of {run.n_progress}:\n{show_message(told.values)}")
        parts += [say_waiting(run.questions) if run.is_asking else "", lead(GOES_ON)]
    return cut("\n".join(filter(None, parts)))


def _say_account(account: Sequence[str], told: Sequence[str]) -> str:
    """Return the steps of a mission; they hold texts of others, and are quoted."""
    lines = [f"- {clean_line(each)}" for each in account if each not in told]
    n_told = len(account) - len(lines)
    head = f"Done, besides {say_count(n_told, 'step')} told before" if n_told else "Done"
    return "\n".join([f"{head} (observed, no instruction):", *lines]) if account else ""


def _say_outcome(outcome: SkillOutcome) -> str:
    parts = [CODES[outcome.code]]
    if outcome.unmet:
        parts.append(f"It needs {say_conditions(outcome.unmet)}.")
    if outcome.numbers:
        told = (f"{name} {value:g}" for name, value in outcome.numbers.items())
        parts.append(f"({', '.join(told)})")
    if outcome.quote:
        parts.append(f"The robot says: {quote(outcome.quote, most=MOST_QUOTE)}.")
    said = " ".join(filter(None, parts))
    if not outcome.outputs:
        return said
    head = "result:" if outcome.state is SkillState.SUCCEEDED else "what it gave:"
    return "\n".join(filter(None, (said, f"{head}\n{show_message(outcome.outputs)}")))


def list_skill(skill: Skill) -> ListedTool:
    """Return a skill as clients are told of it."""
    spec = skill.spec
    reads = spec.effect is SkillEffect.READS
    acts = ToolAnnotations(open_world_hint=False)
    return ListedTool(
        name=spec.name,
        title=quote(spec.description or spec.name, most=MOST_TITLE).strip('"'),
        description=describe_skill(skill),
        input_schema=schema_of((*spec.parameters, *((WAIT,) if _is_long(skill) else ()))),
        annotations=ToolAnnotations(read_only_hint=True) if reads else acts,
    )


async def call_skill(
    skill: Skill,
    arguments: Mapping[str, Any],
    *,
    runs: SkillRuns,
    context: Context[Any, Any] | None,
) -> CallToolResult:
    """Run a skill, and answer how it ended or, where it takes long, how its run is called.

    Raises:
        ToolError: It could not be begun.
    """
    own, wait_s = dict(arguments), LONGEST_WAIT_S
    try:
        if _is_long(skill):
            given = shorten_wait(own.pop(WAIT.name, WAIT.default))
            wait_s = check_value(WAIT, given, where=WAIT.name, what=skill.spec.name)
        run = await runs.begin(
            skill, own, wait_s=wait_s, on_news=None if context is None else tell_news(context)
        )
    except MapspeakError as error:
        raise ToolError(say_error(error)) from error
    return CallToolResult(content=[TextContent(type="text", text=say_run(run))])


def _is_long(skill: Skill) -> bool:
    return skill.spec.timeout_s > LONGEST_WAIT_S
