"""A person's word, asked for through the client: in its call, or by letting it call again."""

from typing import Any

from mcp.server.elicitation import AcceptedElicitation, render_elicitation_schema
from mcp.server.mcpserver import Context
from mcp.shared.exceptions import MCPError
from mcp_types import (
    ClientCapabilities,
    ElicitationCapability,
    ElicitRequest,
    ElicitRequestFormParams,
    ElicitResult,
    InputRequiredResult,
)
from mcp_types.version import is_version_at_least
from pydantic import BaseModel, Field, StrictBool

from mapspeak.safety import (
    Approval,
    ApprovalNeededError,
    Approvals,
    Otherwise,
)

CALLS_AGAIN = "2026-07-28"
"""From this version of the protocol on a client is asked by an answer that it calls again with."""
KEY = "approval-"


class Agreement(BaseModel):
    """What a person is asked for."""

    agree: StrictBool = Field(description="true to let the robot do it")


class Asking:
    """Asks the person at one client, and takes answers to what was asked of that client alone.

    Args:
        context: Of the call.
        approval: Who may be asked: with `queue` no client is.
        client: Who calls.
    """

    def __init__(
        self, context: Context[Any, Any] | None, *, approval: Approval, client: str
    ) -> None:
        self._context = context
        self._approval = approval
        self._client = client

    def take_answers(self, approvals: Approvals) -> bool:
        """Grant what the person agreed to; False when they were asked and did not agree."""
        given = self._context.input_responses if self._context is not None else None
        answers = {key: each for key, each in (given or {}).items() if key.startswith(KEY)}
        for key, answer in answers.items():
            if not isinstance(answer, ElicitResult) or not _is_yes(answer):
                return False
            if not self.can_ask:
                return False
            state = self._context.request_state if self._context is not None else None
            wish_id = key.removeprefix(KEY)
            if not approvals.grant(wish_id, client=self._client, secret=state or ""):
                return False
        return True

    @property
    def can_ask(self) -> bool:
        """True when the client has a person whom it can ask."""
        if self._context is None or self._approval.otherwise is Otherwise.QUEUE:
            return False
        wanted = ClientCapabilities(elicitation=ElicitationCapability())
        return bool(self._context.session.check_client_capability(wanted))

    def ask_by_answer(
        self, needed: ApprovalNeededError, approvals: Approvals
    ) -> InputRequiredResult | None:
        """Gives the answer that makes a client ask and call again; None for an older client."""
        version = None if self._context is None else self._context.protocol_version
        if version is None or not is_version_at_least(version, CALLS_AGAIN):
            return None
        form = ElicitRequestFormParams(
            message=needed.question, requested_schema=render_elicitation_schema(Agreement)
        )
        key = f"{KEY}{needed.wish_id}"
        return InputRequiredResult(
            input_requests={key: ElicitRequest(params=form)},
            request_state=approvals.ask_client(needed.wish_id),
        )

    async def ask_at_once(self, needed: ApprovalNeededError, approvals: Approvals) -> bool:
        """Ask within the call, and return whether the person agreed."""
        if self._context is None:
            return False
        try:
            answer = await self._context.elicit(needed.question, Agreement)
        except (MCPError, ValueError):
            # A client that promised to ask, and did not, has no word to give.
            return False
        if not isinstance(answer, AcceptedElicitation) or answer.data.agree is not True:
            return False
        secret = approvals.ask_client(needed.wish_id)
        return approvals.grant(needed.wish_id, client=self._client, secret=secret)


def _is_yes(answer: ElicitResult) -> bool:
    return answer.action == "accept" and (answer.content or {}).get("agree") is True
