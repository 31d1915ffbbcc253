"""The model agent: asks a model and makes the calls it requests, until it requests none.

Calls go through our own client, never through the model's library: every call is logged, counted
and limited in one place, for every model.
"""

import io
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Protocol

import anyio
from mcp_types import Tool
from PIL import Image

from mapspeak.errors import LinkError
from mapspeak.evaluation.agent import (
    AgentEnd,
    Assignment,
    OutOfBudgetError,
    Picture,
    ToolAnswer,
    ToolClient,
)
from mapspeak.evaluation.trials import TokenCounts, ToolCall, TrialState, Turn

PIXELS_PER_TOKEN = 750
"""Anthropic's published rule for pictures of up to 1568 px; other APIs count otherwise."""
INSTEAD = {
    TrialState.FINISHED: "",
    TrialState.GAVE_UP: "The model refused to answer.",
    TrialState.OUT_OF_BUDGET: (
        "The model was cut off: it wrote as much as it may, or had too much to read."
    ),
}
"""The answer of a model that ends without a word."""
WRAP_UP_S = 1.0
"""It ends this long before its time is up, so that the record of its cost is not lost."""


class Thinking(StrEnum):
    """Level of thinking of a model before it answers."""

    NONE = "none"
    LOW = "low"
    MEDIUM = "medium"
    HIGH = "high"


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolCallRequest(ToolCall):
    """A call that a model wants made.

    Attributes:
        id: The model's own, by which it knows the answer again.
        mistake: Why it cannot be called as it was written; None where it can.
    """

    id: str
    mistake: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Reply(TokenCounts):
    """Reply of a model.

    Attributes:
        calls: Requested calls in order; empty when it has finished.
        state: Meaning of a reply without calls: finished, gave up (it refused), or out of budget
            (it was cut off).
    """

    text: str
    calls: tuple[ToolCallRequest, ...] = ()
    state: TrialState = TrialState.FINISHED


AnsweredCalls = Sequence[tuple[ToolCallRequest, ToolAnswer]]


class ModelConversation(Protocol):
    """The port of models: one conversation, which keeps all that was said in it."""

    async def ask(self, answers: AnsweredCalls) -> Reply:
        """Return the model's reply to the conversation so far.

        Args:
            answers: To the calls of its last reply, errors as errors; empty at the beginning.

        Raises:
            LinkError: The model cannot be reached, or rejects the request.
        """
        ...


Begin = Callable[[Assignment, Sequence[Tool]], ModelConversation]
"""Begins a conversation with a model, which may call some tools."""


def estimate_picture_tokens(picture: Picture) -> int:
    """Estimate what a picture costs: its pixels by 750, whatever the model.

    No API that we know through `inspect-ai` says what of a request was pictures; this is the same
    estimate for all of them, and never more than one.
    """
    width_px, height_px = Image.open(io.BytesIO(picture.data)).size
    return math.ceil(width_px * height_px / PIXELS_PER_TOKEN)


@dataclass(slots=True)
class _Account:
    """Cost of the conversation so far.

    Attributes:
        n_turns: Number of requests to the model.
    """

    n_turns: int = 0
    spent: TokenCounts = field(default_factory=TokenCounts)

    def end(self, answer: str, state: TrialState) -> AgentEnd:
        return AgentEnd(
            answer=answer,
            state=state,
            n_decisions=self.n_turns,
            n_input_tokens=self.spent.n_input_tokens,
            n_output_tokens=self.spent.n_output_tokens,
            n_picture_tokens=self.spent.n_picture_tokens or 0,
        )


async def work_with_model(begin: Begin, task: Assignment, tools: ToolClient) -> AgentEnd:
    """Let a model work with the tools until it has nothing more to call.

    Also out of budget it says what it has cost.

    Raises:
        LinkError: There is nothing to call, or the model cannot be asked or never answered.
    """
    listed = await tools.list_tools()
    if not listed:
        raise LinkError("The server offers no tools.", hint="Look at --toolsets.")
    account = _Account()
    try:
        with anyio.move_on_after(task.limits.wall_s - WRAP_UP_S):
            return await _converse(begin(task, listed), tools, account)
    except OutOfBudgetError as error:
        return account.end(str(error), TrialState.OUT_OF_BUDGET)
    if not account.n_turns:
        raise LinkError(
            f"The model has not answered once in {task.limits.wall_s:.0f} s.",
            hint="See whether its server answers at all.",
        )
    return account.end("It took too long.", TrialState.OUT_OF_BUDGET)


async def _converse(
    conversation: ModelConversation, tools: ToolClient, account: _Account
) -> AgentEnd:
    answers: list[tuple[ToolCallRequest, ToolAnswer]] = []
    n_picture_tokens = 0  # of all pictures so far: each request has them all
    while True:
        reply = await conversation.ask(answers)
        turn = Turn(
            role="agent",
            # The trial notes the last words.
            text=reply.text if reply.calls else "",
            n_input_tokens=reply.n_input_tokens,
            n_output_tokens=reply.n_output_tokens,
            n_picture_tokens=n_picture_tokens,
        )
        account.n_turns += 1
        account.spent = account.spent.plus(turn)
        tools.witness.hear(turn)
        if not reply.calls:
            return account.end(reply.text or INSTEAD[reply.state], reply.state)
        answers = [(call, await _make(tools, call)) for call in reply.calls]
        for _, answer in answers:
            n_picture_tokens += sum(map(estimate_picture_tokens, answer.pictures))


async def _make(tools: ToolClient, call: ToolCallRequest) -> ToolAnswer:
    """Make a call; one that was not written properly counts, and is answered with why."""
    if call.mistake is None:
        return await tools.call(call.tool, **call.arguments)
    answer = ToolAnswer(text=call.mistake, is_error=True)
    tools.witness.hear_call(call.tool, call.arguments)
    tools.witness.hear_answer(call.tool, answer)
    return answer
