"""The goals the robot was given over ROS, each under the id its client knows it by."""

import uuid
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import anyio

from mapspeak.errors import GoalError, MapspeakError
from mapspeak.geometry import Pose
from mapspeak.robot import Cause, CauseCode, GoalState, GoalStatus, Robot
from mapspeak.ros.messages.poses import FramedPose

BASE_FRAME = "base_footprint"
MOST_ENDED = 10
"""Ended goals that are still told about."""


@dataclass(slots=True, kw_only=True, eq=False)
class ServedDrive:
    """One goal.

    Attributes:
        goal_id: The client's, or one made here.
        robot_goal_id: The robot's; None for a goal in an unknown frame.
        started_s: Robot time.
        operation_id: Of rosbridge's operation that waits for its end.
        follow: Takes the feedback for that operation.
    """

    goal_id: str
    robot_goal_id: str | None
    started_s: float
    status: GoalStatus
    is_cancelling: bool = False
    is_over: anyio.Event = field(default_factory=anyio.Event)
    operation_id: str = ""
    follow: Callable[[dict[str, Any]], None] | None = None


class Drives:
    """All goals; listeners are called for each that begins, goes on, or ends."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._turn = anyio.Lock()
        self._drives: list[ServedDrive] = []
        self.listeners: list[Callable[[ServedDrive], None]] = []

    @property
    def all(self) -> list[ServedDrive]:
        """The goals under way and the last that ended, oldest first."""
        return list(self._drives)

    @property
    def under_way(self) -> list[ServedDrive]:
        """The goals that have not ended."""
        return [drive for drive in self._drives if not drive.is_over.is_set()]

    async def resolve(self, framed: FramedPose) -> Pose | None:
        """Return a pose in the map; None for an unknown frame."""
        if framed.frame_id in ("map", "odom"):
            return framed.pose
        if framed.frame_id in ("base_link", BASE_FRAME):
            return (await self._robot.fetch_pose()).pose @ framed.pose
        return None

    async def start(self, goal: Pose, *, goal_id: str | None = None) -> ServedDrive:
        """Send the robot off; the goal before it ends first.

        Raises:
            MapspeakError: The robot refuses.
        """
        async with self._turn:
            robot_goal_id = await self._robot.send_goal(goal)
            await self._look_at_all()
            status = await self._robot.fetch_goal_status(robot_goal_id)
            if status.state is GoalState.REJECTED:
                said = "" if status.cause is None else status.cause.quote
                raise GoalError(f"Goal rejected: {said}", hint="Choose another.")
            return self._note(goal_id, robot_goal_id, status)

    def wait_for_ever(self, *, goal_id: str | None = None) -> ServedDrive:
        """Take a goal that the robot cannot drive to, and stays silent about it, as move_base."""
        return self._note(goal_id, None, GoalStatus(state=GoalState.DRIVING))

    async def cancel(self, drive: ServedDrive) -> None:
        """End a goal, if it still goes on."""
        if drive.is_over.is_set():
            return
        drive.is_cancelling = True
        if drive.robot_goal_id is None:
            self._renew(drive, GoalStatus(state=GoalState.CANCELLED))
            return
        await self._robot.cancel_goal(drive.robot_goal_id)
        await self.look()

    async def look(self) -> None:
        """Ask the robot how the goals under way stand."""
        if self.under_way:
            async with self._turn:
                await self._look_at_all()

    async def _look_at_all(self) -> None:
        for drive in self.under_way:
            if drive.robot_goal_id is None:
                continue
            try:
                status = await self._robot.fetch_goal_status(drive.robot_goal_id)
            except MapspeakError as error:
                cause = Cause(code=CauseCode.REFUSED, quote=error.message)
                status = GoalStatus(state=GoalState.LOST, cause=cause)
            self._renew(drive, status)

    def _renew(self, drive: ServedDrive, status: GoalStatus) -> None:
        drive.status = status
        if status.state.is_final:
            drive.is_over.set()
        for listener in self.listeners:
            listener(drive)

    def _note(
        self, goal_id: str | None, robot_goal_id: str | None, status: GoalStatus
    ) -> ServedDrive:
        drive = ServedDrive(
            goal_id=goal_id or str(uuid.uuid4()),
            robot_goal_id=robot_goal_id,
            started_s=self._robot.now_s,
            status=status,
        )
        ended = [each for each in self._drives if each.is_over.is_set()]
        forgotten = ended[: max(len(ended) + 1 - MOST_ENDED, 0)]
        self._drives = [*(each for each in self._drives if each not in forgotten), drive]
        self._renew(drive, status)
        return drive
