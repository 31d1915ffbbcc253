"""Every goal that was sent with the ROS tools, by its handle; the latest last."""

from collections import OrderedDict
from dataclasses import dataclass

import anyio

from mapspeak.errors import GoalError
from mapspeak.ros.messages import Dialect, Message
from mapspeak.server.tools.ros.commands import RosCommands
from mapspeak.server.tools.ros.goals1 import Ros1Pursuer
from mapspeak.server.tools.ros.goals2 import Ros2Pursuer
from mapspeak.server.tools.ros.inquiry import RosInquiry
from mapspeak.server.tools.ros.jobs import ActionState, Job
from mapspeak.server.tools.ros.pursuing import ActionPatience, Pursuer

__all__ = ["ActionBook"]

MOST_KEPT = 200
POLL_S = 0.2
USUAL_PATIENCE = ActionPatience()


@dataclass(frozen=True, slots=True, kw_only=True)
class ListedGoal:
    """A goal that an action server knows.

    Attributes:
        id: The server's.
        state: As the server says.
        handle: What a model calls it; None for one of others.
    """

    id: str
    state: ActionState
    handle: str | None


class ActionBook:
    """Sends goals and keeps what becomes of them, also after their end.

    Args:
        inquiry: Asks the robot.
        commands: Tells the robot.
        patience: All time limits.
    """

    def __init__(
        self,
        inquiry: RosInquiry,
        commands: RosCommands,
        *,
        patience: ActionPatience = USUAL_PATIENCE,
    ) -> None:
        self._inquiry = inquiry
        self._commands = commands
        self._patience = patience
        self._jobs: OrderedDict[str, Job] = OrderedDict()
        self._pursuers: dict[str, Pursuer] = {}
        self._n_sent = 0

    @property
    def handles(self) -> list[str]:
        """The handles of the goals that are kept."""
        return list(self._jobs)

    async def send(self, action: str, goal: Message, *, type_name: str) -> Job:
        """Sends a goal, and waits until the action server has taken or refused it.

        Args:
            action: Its full name.
            goal: Fits its type.
            type_name: Of the action, as "package/Type".
        """
        pursuer = await self._pursuer_of(action)
        said = await self._inquiry.said(type_name, kind="action")
        self._n_sent += 1
        job = Job(handle=f"A{self._n_sent}", action=action, type_name=said)
        await pursuer.send(job, goal)
        self._jobs[job.handle] = job
        while len(self._jobs) > MOST_KEPT:
            self._jobs.popitem(last=False)
        return job

    def find(self, handle: str | None) -> Job:
        """Gives a goal as it stands now; the latest when no handle is given.

        Raises:
            GoalError: No goal has that handle.
        """
        key = next(reversed(self._jobs), "") if handle is None else handle.strip().upper()
        job = self._jobs.get(key)
        if job is None:
            known = ", ".join(self.handles[-5:])
            raise GoalError(
                f"There is no goal {handle[:40]!r}." if handle else "No goal has been sent yet.",
                hint=f"The latest are {known}." if known else "ros_send_goal sends one.",
            )
        self._pursuers[job.action].look_at(job)
        return job

    async def wait(self, job: Job, *, wait_s: float) -> None:
        """Waits until a goal is over, or so long in wall time."""
        until_s = anyio.current_time() + wait_s
        while not job.is_over and (left_s := until_s - anyio.current_time()) > 0:
            await job.wait_until_over(within_s=min(left_s, POLL_S))
            self._pursuers[job.action].look_at(job)

    async def cancel(self, job: Job) -> None:
        """Ends a goal, and waits a moment for its end."""
        with anyio.CancelScope(shield=True):
            await self._pursuers[job.action].cancel(job)
        self._pursuers[job.action].look_at(job)

    async def cancel_all(self, action: str) -> str:
        """Ends every goal of an action, whoever sent it, and says what came of it."""
        pursuer = await self._pursuer_of(action)
        await pursuer.wait_for_list()
        said = await pursuer.cancel_all()
        ours = [job for job in self._jobs.values() if job.action == action and not job.is_over]
        for job in ours:
            await job.wait_until_over(within_s=self._patience.end_s)
        return said

    async def fetch_listed(self, action: str) -> list[ListedGoal]:
        """Gives each goal that an action server knows, ours and others'."""
        pursuer = await self._pursuer_of(action)
        await pursuer.wait_for_list()
        ours = pursuer.handles
        return [
            ListedGoal(id=goal_id, state=state, handle=ours.get(goal_id))
            for goal_id, state in pursuer.listed.items()
        ]

    def heard_s(self, action: str) -> float:
        """Gives when an action server's list of goals came, by the event loop's clock."""
        return self._pursuers[action].listed_s

    async def _pursuer_of(self, action: str) -> Pursuer:
        if action not in self._pursuers:
            await self._inquiry.check_action(action)
            self._pursuers[action] = await self._build_pursuer(action)
        return self._pursuers[action]

    async def _build_pursuer(self, action: str) -> Pursuer:
        connection = self._inquiry.connection
        if await self._inquiry.fetch_dialect() is Dialect.ROS2:
            return Ros2Pursuer(connection, self._commands, action, patience=self._patience)
        return Ros1Pursuer(
            connection,
            self._commands,
            action,
            type_name=await self._inquiry.fetch_action_type(action),
            patience=self._patience,
        )
