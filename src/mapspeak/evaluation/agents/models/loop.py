"""The model agent: asks a model, makes the calls it wishes for, until it wishes for none.

Calls go through our own client, never through one of the model's library: every call is noted,
counted and held to the trial's limits in one place, whoever the model is.
"""

import io
import math
from dataclasses import dataclass, field

import anyio
from PIL import Image

from mapspeak.errors import LinkError
from mapspeak.evaluation.agents.models.chat import (
    ChatModel,
    Ending,
    ModelConversation,
    Reply,
    ToolCallRequest,
)
from mapspeak.evaluation.client import OutOfBudgetError, Picture, ToolAnswer, ToolClient
from mapspeak.evaluation.trials import AgentEnd, Assignment, ServerAccess, TrialState

PIXELS_PER_TOKEN = 750
"""Anthropic's published rule for pictures of up to 1568 px; other APIs count otherwise."""
ENDINGS = {
    Ending.ITS_OWN: (TrialState.FINISHED, ""),
    Ending.REFUSED: (TrialState.GAVE_UP, "The model refused to answer."),
    Ending.CUT_OFF: (
        TrialState.OUT_OF_BUDGET,
        "The model was cut off: it wrote as much as it may, or had too much to read.",
    ),
}
"""The state that an ending leads to, and the answer of a model that says nothing."""
WRAP_UP_S = 1.0
"""So long before its time is up it ends by itself, so that what it has cost is not lost."""


def estimate_picture_tokens(picture: Picture) -> int:
    """Estimate what a picture costs: its pixels by 750, whatever the model.

    No API that we know through `inspect-ai` says what of a request was pictures; this is the same
    estimate for all of them, and never more than one.
    """
    width_px, height_px = Image.open(io.BytesIO(picture.data)).size
    return math.ceil(width_px * height_px / PIXELS_PER_TOKEN)


@dataclass(slots=True)
class _Account:
    """What the conversation has cost so far.

    Attributes:
        n_turns: Times that the model was asked.
        n_pictures_cost: Tokens of all pictures said so far, estimated; each request has them all.
    """

    n_turns: int = 0
    n_pictures_cost: int = 0
    n_picture_tokens: int = 0
    n_input_tokens: int | None = None
    n_output_tokens: int | None = None

    def note(self, reply: Reply) -> None:
        self.n_turns += 1
        self.n_picture_tokens += self.n_pictures_cost
        if reply.n_input_tokens is not None:
            self.n_input_tokens = (self.n_input_tokens or 0) + reply.n_input_tokens
        if reply.n_output_tokens is not None:
            self.n_output_tokens = (self.n_output_tokens or 0) + reply.n_output_tokens

    def end(self, answer: str, state: TrialState) -> AgentEnd:
        return AgentEnd(
            answer=answer,
            state=state,
            n_decisions=self.n_turns,
            n_input_tokens=self.n_input_tokens,
            n_output_tokens=self.n_output_tokens,
            n_picture_tokens=self.n_picture_tokens,
        )


@dataclass(frozen=True, slots=True)
class ModelAgent:
    """Lets a model work with the tools until it has nothing more to call."""

    model: ChatModel
    name: str
    connection: ServerAccess = field(default=ServerAccess.STDIO, kw_only=True)

    async def run(self, task: Assignment, tools: ToolClient) -> AgentEnd:
        """Carry out the assignment; also out of budget it says what it has cost.

        Raises:
            LinkError: There is nothing to call, or the model cannot be asked or never answered.
        """
        listed = await tools.list_tools()
        if not listed:
            raise LinkError("The server offers no tools.", hint="Look at --toolsets.")
        conversation = self.model.begin(
            system=task.system, prompt=task.prompt, tools=listed, seed=task.seed
        )
        account = _Account()
        try:
            with anyio.move_on_after(task.limits.wall_s - WRAP_UP_S):
                return await _converse(conversation, tools, account)
        except OutOfBudgetError as error:
            return account.end(str(error), TrialState.OUT_OF_BUDGET)
        if not account.n_turns:
            raise LinkError(
                f"{self.name} has not answered once in {task.limits.wall_s:.0f} s.",
                hint="See whether its server answers at all.",
            )
        return account.end("It took too long.", TrialState.OUT_OF_BUDGET)


async def _converse(
    conversation: ModelConversation, tools: ToolClient, account: _Account
) -> AgentEnd:
    while True:
        reply = await conversation.ask()
        account.note(reply)
        tools.witness.hear_words(
            "agent",
            # The trial notes the last words.
            reply.text if reply.calls else "",
            n_input_tokens=reply.n_input_tokens,
            n_output_tokens=reply.n_output_tokens,
            n_picture_tokens=account.n_pictures_cost,
        )
        if not reply.calls:
            state, instead = ENDINGS[reply.ending]
            return account.end(reply.text or instead, state)
        for call in reply.calls:
            answer = await _make(tools, call)
            account.n_pictures_cost += sum(map(estimate_picture_tokens, answer.pictures))
            conversation.tell(call, answer)


async def _make(tools: ToolClient, call: ToolCallRequest) -> ToolAnswer:
    """Make a call; one that was not written properly counts, and is answered with why."""
    if call.mistake is None:
        return await tools.call(call.tool, **call.arguments)
    answer = ToolAnswer(text=call.mistake, pictures=(), report={}, is_error=True)
    tools.witness.hear_call(call.tool, call.arguments)
    tools.witness.hear_answer(call.tool, answer)
    return answer
