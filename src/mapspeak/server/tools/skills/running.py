"""The tools about runs of skills: how one stands, and its end."""

from typing import Annotated

from mcp.server.mcpserver import Context
from pydantic import Field

from mapspeak.server.tools.asking import AT_MOST_LONGEST_WAIT, LONGEST_WAIT_S
from mapspeak.server.tools.skills.reports import say_progress, say_run
from mapspeak.server.tools.toolset import ToolEffect, tool
from mapspeak.skills.missions.questions import QuestionBook
from mapspeak.skills.runs import OnNews, SkillRun, SkillRuns

Handle = Annotated[
    str | None, Field(description="such as S1; the latest when left out", max_length=40)
]
OwnHandle = Annotated[str, Field(description="such as S1", max_length=40)]
Wait = Annotated[
    float,
    Field(description="seconds to wait for its end", ge=0, le=LONGEST_WAIT_S),
    AT_MOST_LONGEST_WAIT,
]


class SkillRunTools:
    """Asking and cancelling; each skill is a tool of its own."""

    def __init__(self, runs: SkillRuns, questions: QuestionBook) -> None:
        self._runs = runs
        self._questions = questions

    @tool("How a skill stands", ToolEffect.READS)
    async def skill_status(self, context: Context, run: Handle = None, wait_s: Wait = 0.0) -> str:
        """Say how a run of a skill stands: state, progress, result, also long after.

        Use it to wait for the end.
        """
        found = self._runs.find(run)
        await found.wait(wait_s=wait_s, on_news=tell_news(context))
        return say_run(found, self._questions)

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
        await context.report_progress(run.passed_s, message=say_progress(run))

    return tell
