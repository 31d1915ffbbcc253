"""The caller of a tool: which client, how long it waits, progress, approval by its person."""

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
from pydantic import BaseModel, BeforeValidator, Field, StrictBool

from mapspeak.driving.drive import OnProgress
from mapspeak.driving.drivereport import DriveReport
from mapspeak.safety import Approval, ApprovalNeededError, Approvals, Otherwise

LONGEST_WAIT_S = 25.0
"""Clients give up on a call that takes much longer."""
CALLS_AGAIN = "2026-07-28"
"""From this version of the protocol on a client is asked by an answer that it calls again with."""
KEY = "approval-"


def _shorten_wait(wait_s: Any) -> Any:  # noqa: ANN401 - what is no number is refused later
    is_number = isinstance(wait_s, int | float) and not isinstance(wait_s, bool)
    return min(wait_s, LONGEST_WAIT_S) if is_number else wait_s


AT_MOST_LONGEST_WAIT = BeforeValidator(_shorten_wait)
"""A longer wait is cut to this; the client can call again."""


def client_of(context: Context) -> str:
    """Return the HTTP session that calls; empty on stdio and for clients without one."""
    return (context.headers or {}).get("mcp-session-id", "")


def find_reader(context: Context) -> str | None:
    """Return the reader of the answers: an HTTP session, or stdio's one client; None if unknown.

    Several clients may call over HTTP without a session.
    """
    return client_of(context) or (None if context.headers else "stdio")


def tell_progress(context: Context) -> OnProgress:
    """Return the function that reports a drive's progress to the caller."""

    async def tell(report: DriveReport) -> None:
        left_m = report.status.distance_left_m
        left = "" if left_m is None else f", {left_m:.1f} m left"
        await context.report_progress(
            report.elapsed_s, message=f"{report.drive.goal_id} {report.status.state}{left}"
        )

    return tell


class Agreement(BaseModel):
    """What a person is asked for."""

    agree: StrictBool = Field(description="true to let the robot do it")


class Asking:
    """Asks the person at one client, and takes only answers to that client's questions.

    Args:
        context: Of the call.
        approval: The place of approval: with `queue` no client is asked.
        client: Who calls.
    """

    def __init__(
        self, context: Context[Any, Any] | None, *, approval: Approval, client: str
    ) -> None:
        self._context = context
        self._approval = approval
        self._client = client

    def take_answers(self, approvals: Approvals) -> bool:
        """Grant the approved commands; return False when the person was asked and refused."""
        given = self._context.input_responses if self._context is not None else None
        answers = {key: each for key, each in (given or {}).items() if key.startswith(KEY)}
        for key, answer in answers.items():
            if not isinstance(answer, ElicitResult) or not _is_yes(answer):
                return False
            if not self.can_ask:
                return False
            state = self._context.request_state if self._context is not None else None
            request_id = key.removeprefix(KEY)
            if not approvals.grant(request_id, client=self._client, secret=state or ""):
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
        """Return the answer that makes a client ask and call again; None for an older client."""
        version = None if self._context is None else self._context.protocol_version
        if version is None or not is_version_at_least(version, CALLS_AGAIN):
            return None
        form = ElicitRequestFormParams(
            message=needed.question, requested_schema=render_elicitation_schema(Agreement)
        )
        key = f"{KEY}{needed.request_id}"
        return InputRequiredResult(
            input_requests={key: ElicitRequest(params=form)},
            request_state=approvals.ask_client(needed.request_id),
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
        secret = approvals.ask_client(needed.request_id)
        return approvals.grant(needed.request_id, client=self._client, secret=secret)


def _is_yes(answer: ElicitResult) -> bool:
    return answer.action == "accept" and (answer.content or {}).get("agree") is True
