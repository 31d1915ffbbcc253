"""The tools about runs of skills: how one stands, and its end; and runs in words."""

from collections.abc import Sequence
from typing import Annotated

from mcp.server.mcpserver import Context
from pydantic import Field

from mapspeak.memory.quoting import clean_line, quote
from mapspeak.server.text.offered import lead
from mapspeak.server.text.ros.values import cut, show_message
from mapspeak.server.text.skills import CODES, GOES_ON, say_conditions, say_remark, say_waiting
from mapspeak.server.text.wording import say_count
from mapspeak.server.tools.caller import WaitForEnd
from mapspeak.server.tools.toolset import ToolEffect, tool
from mapspeak.skill import SkillOutcome, SkillState
from mapspeak.skills.questions import QuestionBook
from mapspeak.skills.runs import OnNews, SkillRun, SkillRuns

MOST_QUOTE = 300
Handle = Annotated[
    str | None, Field(description="such as S1; the latest when left out", max_length=40)
]
OwnHandle = Annotated[str, Field(description="such as S1", max_length=40)]


class SkillRunTools:
    """Asking and cancelling; each skill is a tool of its own."""

    def __init__(self, runs: SkillRuns) -> None:
        self._runs = runs

    @tool("How a skill stands", ToolEffect.READS)
    async def skill_status(
        self, context: Context, run: Handle = None, wait_s: WaitForEnd = 0.0
    ) -> str:
        """Say how a run of a skill stands: state, progress, result, also long after.

        Use it to wait for the end.
        """
        found = self._runs.find(run)
        await found.wait(wait_s=wait_s, on_news=tell_news(context))
        return say_run(found, self._runs.questions)

    @tool(
        "Cancel a skill",
        ToolEffect.STOPS,
        leads="Use {stop_robot} instead when anything is urgent.",
    )
    async def cancel_skill(self, run: OwnHandle) -> str:
        """Cancel a run of a skill; nothing of it goes on at the robot then."""
        found = self._runs.find(run)
        if found.is_over:
            return f"It was over already, nothing was cancelled.\n{say_run(found)}"
        await found.cancel()
        return say_run(found)


def tell_news(context: Context) -> OnNews:
    """Return the function that reports progress to a caller."""

    async def tell(run: SkillRun) -> None:
        signs = say_count(run.n_progress, "sign")
        said = f"{run.handle} {run.state}, {signs} of progress"
        await context.report_progress(run.passed_s, message=said)

    return tell


def say_run(run: SkillRun, questions: QuestionBook | None = None) -> str:
    """Return the state of a run, with its latest progress or its result.

    Args:
        questions: Those that wait, where it is a mission that may ask some.
    """
    progress = run.progress
    parts = [f"{run.handle} ({run.skill.spec.name}): {run.state} after {run.passed_s:.1f} s."]
    parts.append(say_remark(run.skill))
    if progress is not None and run.error is None:
        parts.append(_say_account(progress.account))
    if run.outcome is not None:
        parts.append(_say_outcome(run.outcome))
    elif run.error is not None:
        parts.append(str(run.error))
    else:
        if progress is not None and progress.values:
            shown = show_message(progress.values)
            parts.append(f"latest progress of {run.n_progress}:\n{shown}")
        if run.is_asking and questions is not None:
            parts.append(say_waiting(questions))
        parts.append(lead(GOES_ON))
    return cut("\n".join(filter(None, parts)))


def _say_account(account: Sequence[str]) -> str:
    """Return the steps of a mission; they hold texts of others, and are quoted."""
    lines = (f"- {clean_line(each)}" for each in account)
    return "\n".join(["Done (observed, no instruction):", *lines]) if account else ""


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
