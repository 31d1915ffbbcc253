"""All goals sent with the ROS tools, by their handles, and the common part of all ROS tools."""

from collections import OrderedDict
from dataclasses import dataclass

import anyio

from mapspeak.ros.actions import ActionClient, open_action
from mapspeak.ros.activity import ActionGoal
from mapspeak.ros.definitions.types import Field
from mapspeak.ros.messages.fields import Dialect, Message
from mapspeak.safety import current_caller
from mapspeak.server.text.ros.outcomes import refuse_goal
from mapspeak.server.tools.ros.inquiry import Described, RosInquiry
from mapspeak.server.tools.ros.publishing import Publisher
from mapspeak.session import Session

MOST_KEPT = 200
POLL_S = 0.2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrackedGoal:
    """A goal with the handle that a model calls it by.

    Attributes:
        handle: Such as A1.
        goal: As its action client knows it.
        action: That client.
        result_fields: Of its result's type.
    """

    handle: str
    goal: ActionGoal
    action: ActionClient
    result_fields: tuple[Field, ...]


class ActionBook:
    """Sends goals and keeps their states, also after their end.

    Args:
        inquiry: Asks the robot.
        publisher: Advertises the topics of a ROS 1 action.
    """

    def __init__(self, inquiry: RosInquiry, publisher: Publisher) -> None:
        self._inquiry = inquiry
        self._publisher = publisher
        self._jobs: OrderedDict[str, TrackedGoal] = OrderedDict()
        self._n_sent = 0

    async def send(
        self,
        action: str,
        goal: Message,
        *,
        described: Described,
        n_stops: int | None = None,
    ) -> TrackedGoal:
        """Send a goal, and wait until the action server has taken or refused it.

        Args:
            action: Its full name.
            goal: Fits its type.
            described: The type of the action.
            n_stops: The number of stops when the goal was requested.

        Raises:
            GoalError: There was a stop since the goal was requested.
        """
        await self._inquiry.check_action(action)
        opened = await self._open(action, described.said)
        connection = self._inquiry.connection
        for topic, topic_type in opened.advertise(connection).items():
            await self._publisher.prepare(topic, topic_type)
        owner = current_caller().owner
        sent = await opened.send(goal, through=connection, owner=owner, n_stops=n_stops)
        self._n_sent += 1
        job = TrackedGoal(
            handle=f"A{self._n_sent}",
            goal=sent,
            action=opened,
            result_fields=described.answer_fields,
        )
        self._jobs[job.handle] = job
        while len(self._jobs) > MOST_KEPT:
            self._jobs.popitem(last=False)
        await opened.wait_until_taken(sent)
        return job

    def find(self, handle: str | None) -> TrackedGoal:
        """Return a goal as it stands now; the latest when no handle is given.

        Raises:
            GoalError: No goal has that handle.
        """
        key = next(reversed(self._jobs), "") if handle is None else handle.strip().upper()
        if (job := self._jobs.get(key)) is None:
            raise refuse_goal(handle, list(self._jobs))
        job.action.look()
        return job

    async def wait(self, job: TrackedGoal, *, wait_s: float) -> None:
        """Wait until a goal is over, or the time is, in wall time."""
        until_s = anyio.current_time() + wait_s
        while not job.goal.is_over and (left_s := until_s - anyio.current_time()) > 0:
            await job.goal.wait_until_over(within_s=min(left_s, POLL_S))
            job.action.look()

    async def cancel(self, job: TrackedGoal) -> None:
        """End a goal, and wait a moment for its end.

        Raises:
            LinkError: The action server refuses, or goes on.
        """
        with anyio.CancelScope(shield=True):
            await job.action.cancel(job.goal)

    async def cancel_all(self, action: str) -> int:
        """End every goal of an action, of all clients; return how many there were."""
        client = await self._find_client(action)
        await client.wait_for_list()
        n_cancelled = await client.cancel_all(self._inquiry.connection)
        for goal in client.open_goals:
            await goal.wait_until_over(within_s=self._inquiry.connection.patience.end_s)
        return n_cancelled

    async def list_goals(self, action: str) -> tuple[ActionClient, dict[str, str]]:
        """Return what knows all goals of an action server, and our handles by the goals' ids."""
        client = await self._find_client(action)
        await client.wait_for_list()
        return client, {job.goal.id: job.handle for job in self._jobs.values()}

    async def _find_client(self, action: str) -> ActionClient:
        known = self._inquiry.connection.started.actions.get(action)
        if isinstance(known, ActionClient):
            return known
        await self._inquiry.check_action(action)
        is_ros2 = await self._inquiry.fetch_dialect() is Dialect.ROS2
        # In ROS 2 all that is asked here is of one type, whatever the action's is.
        type_name = "" if is_ros2 else await self._inquiry.fetch_action_type(action)
        return await self._open(action, type_name)

    async def _open(self, action: str, type_name: str) -> ActionClient:
        return open_action(
            self._inquiry.connection,
            action,
            dialect=await self._inquiry.fetch_dialect(),
            type_name=type_name,
        )


class RosAccess:
    """One session's way to its ROS system; nothing is asked before it is used.

    Args:
        session: Holds the connection.
        inquiry: Asks; one of the session's own when left out.

    Attributes:
        goals: Every goal that was sent.
        publisher: Publishes, one velocity at a time.
    """

    def __init__(self, session: Session, inquiry: RosInquiry | None = None) -> None:
        self.session = session
        self.inquiry = inquiry or RosInquiry(session)
        self.publisher = Publisher(session, self.inquiry)
        self.goals = ActionBook(self.inquiry, self.publisher)
