"""The tools about actions: what there is, sending goals, how they stand, cancelling them."""

from typing import Annotated, Any

import anyio
from pydantic import Field

from mapspeak.errors import LinkError
from mapspeak.safety import Act
from mapspeak.server.text.ros.listening import list_page, say_loss
from mapspeak.server.text.ros.outcomes import NO_TYPE_TOLD, ONE_OF_BOTH, say_goal, say_goals
from mapspeak.server.text.values import cut
from mapspeak.server.text.wording import say_count
from mapspeak.server.tools.caller import WaitForEnd
from mapspeak.server.tools.ros.goals import RosAccess, TrackedGoal
from mapspeak.server.tools.ros.inquiry import full_name
from mapspeak.server.tools.ros.publishing import check_frames
from mapspeak.server.tools.ros.topics import Filter, Page
from mapspeak.server.tools.toolset import ToolEffect, tool

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
Handle = Annotated[
    str | None, Field(description="such as A1; the latest when left out", max_length=40)
]
CancelHandle = Annotated[str | None, Field(description="such as A1", max_length=40)]


class ActionTools:
    """Listing, describing, sending, asking, cancelling."""

    def __init__(self, ros: RosAccess) -> None:
        self._inquiry = ros.inquiry
        self._goals = ros.goals

    @tool("List ROS actions", ToolEffect.READS, leads="{ros_action} tells its fields.")
    async def ros_actions(self, filter: Filter = None, page: Page = 1) -> str:  # noqa: A002
        """List the robot's ROS actions with their types.

        Use it to find one.
        """
        lines = {}
        for name in await self._inquiry.fetch_actions():
            try:
                type_name = await self._inquiry.fetch_action_type(name)
                said = await self._inquiry.say_type(type_name, kind="action")
            except LinkError:
                said = NO_TYPE_TOLD
            lines[name] = f"{name} {said}"
        return list_page("actions", lines, filter, page)

    @tool("One ROS action", ToolEffect.READS, leads="Use it before {ros_send_goal}.")
    async def ros_action(self, action: Action, type: ActionType = None) -> str:  # noqa: A002
        """Tell a ROS action's type, and the fields of its goal, result and feedback."""
        name = full_name(action)
        type_name = await self._inquiry.fetch_action_type(name, given=type)
        described = await self._inquiry.describe(type_name, kind="action")
        return cut(f"{name} {described.said}\n{described.say()}")

    @tool(
        "Send a ROS goal",
        ToolEffect.MOVES,
        former={"goal": "fields"},
        leads="Use {navigate_to} to drive somewhere. Call {ros_action} first for the fields.",
    )
    async def ros_send_goal(
        self,
        action: Action,
        fields: GoalFields,
        wait_s: WaitForEnd = 5.0,
        type: ActionType = None,  # noqa: A002
    ) -> str:
        """Send a goal to a ROS action, which may move the robot, and wait for its end.

        Answers how it ended or, after wait_s, its goal_id; a refused goal is told as rejected.
        """
        n_stops = self._inquiry.connection.started.n_stops
        name = full_name(action)
        self._inquiry.check_policy(Act(action=name, type=type or "", goal=fields))
        type_name = await self._inquiry.fetch_action_type(name, given=type)
        described = await self._inquiry.describe(type_name, kind="action")
        goal = described.check(fields)
        await check_frames(self._inquiry, goal)
        job = await self._goals.send(name, goal, described=described, n_stops=n_stops)
        try:
            await self._goals.wait(job, wait_s=wait_s)
        except anyio.get_cancelled_exc_class():
            # Whoever gives up waiting gives up the goal, as with navigate_to.
            with anyio.CancelScope(shield=True):
                await self._goals.cancel(job)
            raise
        return self._say(job)

    @tool("How a ROS goal stands", ToolEffect.READS)
    async def ros_goal_status(
        self, goal_id: Handle = None, wait_s: WaitForEnd = 0.0, action: AnyAction = None
    ) -> str:
        """Say how a ROS goal stands: state, feedback, result, also long after.

        Use it to wait for the end; with an action it lists the goals its server knows.
        """
        if action is not None:
            client, handles = await self._goals.list_goals(full_name(action))
            loss = say_loss(self._inquiry.connection, since_s=client.listed_s)
            return say_goals(client, handles, loss)
        job = self._goals.find(goal_id)
        await self._goals.wait(job, wait_s=wait_s)
        return self._say(job)

    @tool(
        "Cancel a ROS goal",
        ToolEffect.STOPS,
        leads="Use {stop_robot} instead when anything is urgent.",
    )
    async def ros_cancel_goal(self, goal_id: CancelHandle = None, action: AnyAction = None) -> str:
        """Cancel one goal by its goal_id, or every goal of a ROS action."""
        if (goal_id is None) == (action is None):
            raise ONE_OF_BOTH.error()
        if action is not None:
            n_cancelled = await self._goals.cancel_all(full_name(action))
            return f"{full_name(action)}: {say_count(n_cancelled, 'goal')} being cancelled."
        job = self._goals.find(goal_id)
        if job.goal.is_over:
            return f"{job.handle} was over already, nothing was cancelled.\n{self._say(job)}"
        await self._goals.cancel(job)
        return self._say(job)

    def _say(self, job: TrackedGoal) -> str:
        return say_goal(
            job.handle,
            job.goal,
            result_fields=job.result_fields,
            connection=self._inquiry.connection,
        )
