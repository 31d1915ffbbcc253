"""The tools about actions: what there is, sending goals, how they stand, cancelling them."""

from typing import Annotated, Any

import anyio
from mcp.server.mcpserver import Context
from pydantic import Field

from mapspeak.errors import GoalError, LinkError
from mapspeak.ros.activity import ActionGoal, ActionState
from mapspeak.ros.definitions.checking import check_message
from mapspeak.ros.messages.fields import Message, bare_type
from mapspeak.safety import Act
from mapspeak.server.text.offered import lead
from mapspeak.server.text.wording import say_count
from mapspeak.server.tools.asking import LONGEST_WAIT_S, client_of
from mapspeak.server.tools.ros.commands import RosCommands
from mapspeak.server.tools.ros.frames import check_frames
from mapspeak.server.tools.ros.goals import ActionBook, TrackedGoal
from mapspeak.server.tools.ros.inquiry import Described, RosInquiry, full_name
from mapspeak.server.tools.ros.reports import (
    Filter,
    Page,
    cut,
    list_page,
    say_loss,
    show_message,
)
from mapspeak.server.tools.ros.views import view_fields
from mapspeak.server.tools.toolset import ToolEffect, tool

MOST_LISTED = 20

Action = Annotated[str, Field(description="full name, such as /spin", max_length=200)]
AnyAction = Annotated[
    str | None, Field(description="all goals of this action, others' too", max_length=200)
]
GoalFields = Annotated[
    dict[str, Any],
    Field(description="the goal's fields as ros_action shows them; those left out: defaults"),
]
ActionType = Annotated[
    str | None, Field(description="only where the robot does not tell it", max_length=200)
]
Wait = Annotated[float, Field(description="seconds to wait for its end", ge=0, le=LONGEST_WAIT_S)]
Handle = Annotated[
    str | None, Field(description="such as A1; the latest when left out", max_length=40)
]
CancelHandle = Annotated[str | None, Field(description="such as A1", max_length=40)]

NEXT_STEP = {
    ActionState.SUCCEEDED: "",
    ActionState.ABORTED: "The action server gave up: see its result and reason.",
    ActionState.CANCELLED: "It was cancelled before it was done.",
    ActionState.REJECTED: "It was not taken: check its values, and that the server is active.",
    ActionState.LOST: "Nobody knows how it ended: look at the robot, then send it again.",
}
UNANSWERED = (
    "Should it be taken later, it is cancelled at once. Check that the server is active; what has "
    "just started may not be found yet by all: then send it again."
)
GOES_ON = "It goes on. {ros_goal_status} waits for it, {ros_cancel_goal} ends it."


class ActionTools:
    """Listing, describing, sending, asking, cancelling."""

    def __init__(self, inquiry: RosInquiry, commands: RosCommands, book: ActionBook) -> None:
        self._inquiry = inquiry
        self._commands = commands
        self._book = book
        self._described: dict[str, Described] = {}

    @tool("List ROS actions", ToolEffect.READS, leads="{ros_action} tells its fields.")
    async def ros_actions(self, filter: Filter = None, page: Page = 1) -> str:  # noqa: A002
        """List the robot's ROS actions with their types.

        Use it to find one.
        """
        actions = await self._inquiry.fetch_actions()
        lines = {name: f"{name} {await self._say_type(name)}" for name in actions}
        return list_page("actions", lines, filter, page)

    @tool("One ROS action", ToolEffect.READS, leads="Use it before {ros_send_goal}.")
    async def ros_action(self, action: Action, type: ActionType = None) -> str:  # noqa: A002
        """Tell a ROS action's type, and the fields of its goal, result and feedback."""
        name = full_name(action)
        said = await self._find_type(name, type)
        return cut(f"{name} {said}\n{(await self._inquiry.describe(said)).say()}")

    @tool(
        "Send a ROS goal",
        ToolEffect.MOVES,
        former={"goal": "fields"},
        leads="Use {navigate_to} to drive somewhere. Call {ros_action} first for the fields.",
    )
    async def ros_send_goal(
        self,
        context: Context,
        action: Action,
        fields: GoalFields,
        wait_s: Wait = 5.0,
        type: ActionType = None,  # noqa: A002
    ) -> str:
        """Send a goal to a ROS action, which may move the robot, and wait for its end.

        Answers how it ended or, after wait_s, its goal_id; a refused goal is told as rejected.
        """
        n_stops = self._inquiry.connection.started.n_stops
        name = full_name(action)
        self._commands.check_name(Act(action=name, type=type or "", goal=fields))
        said = await self._find_type(name, type)
        described = await self._inquiry.describe(said)
        checked = check_message(described.book, described.parts[0], fields)
        await check_frames(self._inquiry, checked)
        self._described[name] = described
        client = client_of(context)
        job = await self._book.send(
            name, checked, type_name=described.type, client=client, n_stops=n_stops
        )
        try:
            await self._book.wait(job, wait_s=wait_s)
        except anyio.get_cancelled_exc_class():
            # Whoever gives up waiting gives up the goal, as with navigate_to.
            with anyio.CancelScope(shield=True):
                await self._book.cancel(job)
            raise
        return self._say_job(job)

    @tool("How a ROS goal stands", ToolEffect.READS)
    async def ros_goal_status(
        self, goal_id: Handle = None, wait_s: Wait = 0.0, action: AnyAction = None
    ) -> str:
        """Say how a ROS goal stands: state, feedback, result, also long after.

        Use it to wait for the end; with an action it lists the goals its server knows.
        """
        if action is not None:
            return await self._say_listed(full_name(action))
        job = self._book.find(goal_id)
        await self._book.wait(job, wait_s=wait_s)
        return self._say_job(job)

    @tool(
        "Cancel a ROS goal",
        ToolEffect.STOPS,
        leads="Use {stop_robot} instead when anything is urgent.",
    )
    async def ros_cancel_goal(self, goal_id: CancelHandle = None, action: AnyAction = None) -> str:
        """Cancel one goal by its goal_id, or every goal of a ROS action."""
        if (goal_id is None) == (action is None):
            raise GoalError(
                "Give either goal_id or action.",
                hint="goal_id ends one goal that was sent here, action every goal of that action.",
            )
        if action is not None:
            n_cancelled = await self._book.cancel_all(full_name(action))
            return f"{full_name(action)}: {say_count(n_cancelled, 'goal')} being cancelled."
        job = self._book.find(goal_id)
        if job.goal.is_over:
            return f"{job.handle} was over already, nothing was cancelled.\n{self._say_job(job)}"
        await self._book.cancel(job)
        return self._say_job(job)

    async def _say_listed(self, action: str) -> str:
        lines, heard_s = await self._book.list_goals(action)
        loss = say_loss(self._inquiry.connection, since_s=heard_s)
        head = f"{say_count(len(lines), 'goal')}, by the server's ids:"
        return "\n".join([head, *(lines[-MOST_LISTED:] or ["none"]), *([loss] if loss else [])])

    async def _find_type(self, action: str, given: str | None) -> str:
        """Return an action's type as this ROS writes it; the given one where nobody tells it."""
        if given is not None:
            await self._inquiry.check_action(action)
            return await self._inquiry.said(bare_type(given), kind="action")
        type_name = await self._inquiry.fetch_action_type(action)
        return await self._inquiry.said(type_name, kind="action")

    async def _say_type(self, action: str) -> str:
        try:
            return await self._find_type(action, None)
        except LinkError:
            return "(its type is not told)"

    def _say_job(self, job: TrackedGoal) -> str:
        goal = job.goal
        passed_s = (goal.ended_s or anyio.current_time()) - goal.sent_s
        parts = [f"{job.handle} ({goal.action}): {goal.state} after {passed_s:.1f} s."]
        loss = "" if goal.is_over else say_loss(self._inquiry.connection, since_s=goal.sent_s)
        reason = f"{goal.reason.rstrip('. ')}." if goal.reason else ""
        said = [part for part in (loss, reason, goal.afterwards, _say_next_step(goal)) if part]
        parts.append(" ".join(said))
        if goal.result is not None:
            parts.append(f"result:\n{self._show_result(goal.action, goal.result)}")
        elif goal.feedback is not None:
            parts.append(f"latest feedback of {goal.n_feedback}:\n{show_message(goal.feedback)}")
        return cut("\n".join(part for part in parts if part))

    def _show_result(self, action: str, result: Message) -> str:
        described = self._described.get(action)
        fields = () if described is None else described.book[described.parts[1]].fields
        views, plain = view_fields(fields, result)
        shown = [f"{name}: {view.text}" for name, view in views.items()]
        return "\n".join([*shown, *([show_message(plain)] if plain or not shown else [])])


def _say_next_step(goal: ActionGoal) -> str:
    if goal.state is ActionState.REJECTED and goal.is_withdrawn:
        return UNANSWERED
    return NEXT_STEP[goal.state] if goal.state in NEXT_STEP else lead(GOES_ON)
