"""The caller of a tool: which client, how long it waits, progress, approval by its person."""

from typing import Annotated, Any

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
from mapspeak.server.text.offered import ANSWER_DOES_NOT_COUNT, DISAGREED, NOT_ANSWERED

LONGEST_WAIT_S = 25.0
"""Clients give up on a call that takes much longer."""
CALLS_AGAIN = "2026-07-28"
"""From this version of the protocol on a client is asked by an answer that it calls again with."""
KEY = "approval-"


def shorten_wait(wait_s: Any) -> Any:  # noqa: ANN401 - what is no number is refused later
    """Return a wait that a client has the patience for."""
    is_number = isinstance(wait_s, int | float) and not isinstance(wait_s, bool)
    return min(wait_s, LONGEST_WAIT_S) if is_number else wait_s


AT_MOST_LONGEST_WAIT = BeforeValidator(shorten_wait)
"""A longer wait is cut to this; the client can call again."""
WaitForEnd = Annotated[
    float,
    Field(description="seconds to wait for its end", ge=0, le=LONGEST_WAIT_S),
    AT_MOST_LONGEST_WAIT,
]


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

    def take_answers(self, approvals: Approvals) -> str:
        """Grant the approved commands; return why an answer grants nothing, else nothing."""
        given = self._context.input_responses if self._context is not None else None
        answers = {key: each for key, each in (given or {}).items() if key.startswith(KEY)}
        for key, answer in answers.items():
            if not isinstance(answer, ElicitResult) or not _is_yes(answer):
                return DISAGREED
            state = self._context.request_state if self._context is not None else None
            request_id, secret = key.removeprefix(KEY), state or ""
            is_asked = self.can_ask
            if not is_asked or not approvals.grant(request_id, client=self._client, secret=secret):
                return ANSWER_DOES_NOT_COUNT
        return ""

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

    async def ask_at_once(self, needed: ApprovalNeededError, approvals: Approvals) -> str:
        """Ask within the call; return why the command is not granted, else nothing."""
        if self._context is None:
            return NOT_ANSWERED
        # While the person thinks, the request may be forgotten.
        secret = approvals.ask_client(needed.request_id)
        try:
            answer = await self._context.elicit(needed.question, Agreement)
        except (MCPError, ValueError):
            # A client that promised to ask, and did not, has no word to give.
            return NOT_ANSWERED
        if not isinstance(answer, AcceptedElicitation) or answer.data.agree is not True:
            return DISAGREED
        is_granted = approvals.grant(needed.request_id, client=self._client, secret=secret)
        return "" if is_granted else ANSWER_DOES_NOT_COUNT


def _is_yes(answer: ElicitResult) -> bool:
    return answer.action == "accept" and (answer.content or {}).get("agree") is True
