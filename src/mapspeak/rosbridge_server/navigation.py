"""The goals that the robot was given over ROS, and the navigation that takes them.

Each goal stands under the id its client knows it by. On ROS 2 it comes to Nav2's NavigateToPose, as
rosbridge's action operations and as topics and services; on ROS 1 to move_base, whose action is
five topics (actionlib), and to the simple goal of RViz.
"""

import uuid
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import anyio

from mapspeak.errors import GoalError, LinkError, MapspeakError
from mapspeak.geometry import Pose
from mapspeak.robot import Cause, CauseCode, GoalState, GoalStatus, Robot
from mapspeak.ros.messages.fields import (
    Dialect,
    Message,
    bytes_of,
    find_stamp,
    write_header,
    write_stamp,
)
from mapspeak.ros.messages.poses import FramedPose, read_pose_stamped, write_pose_stamped
from mapspeak.rosbridge_server.hub import Hub, Publication

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
            # Of a client that goes meanwhile the robot has the goal all the same: it must be known.
            with anyio.CancelScope(shield=True):
                robot_goal_id = await self._robot.send_goal(goal)
                await self._look_at_all()
                begun = GoalStatus(state=GoalState.ACCEPTED)
                status = await self._fetch_status(robot_goal_id, begun)
            if status.state is GoalState.REJECTED:
                said = "" if status.cause is None else status.cause.quote
                raise GoalError(f"Goal rejected: {said}", hint="Choose another.")
            return self._note(goal_id, robot_goal_id, status)

    def wait_for_ever(self, *, goal_id: str | None = None) -> ServedDrive:
        """Take a goal that the robot cannot drive to, and stays silent about it, as move_base."""
        return self._note(goal_id, None, GoalStatus(state=GoalState.DRIVING))

    async def find_meant(self, goal_id: str, until_s: float) -> list[ServedDrive]:
        """Return the goals that a cancellation means, ended ones too.

        They are, as actionlib's GoalID and action_msgs/CancelGoal have it, the one of an id and
        those begun up to a time; all where it says neither. A goal that came before is waited for
        while the robot takes it.
        """
        async with self._turn:
            means_all = not goal_id and until_s == 0.0
            return [
                drive
                for drive in self._drives
                if means_all or drive.goal_id == goal_id or (until_s and drive.started_s <= until_s)
            ]

    async def cancel(self, drive: ServedDrive) -> None:
        """End a goal, if it still goes on."""
        if drive.is_over.is_set():
            return
        if drive.robot_goal_id is None:
            self._renew(drive, GoalStatus(state=GoalState.CANCELLED))
            return
        drive.is_cancelling = True
        try:
            await self._robot.cancel_goal(drive.robot_goal_id)
        except MapspeakError:
            drive.is_cancelling = False
            raise
        await self.look()

    async def look(self) -> None:
        """Ask the robot how the goals under way stand."""
        if self.under_way:
            async with self._turn:
                await self._look_at_all()

    async def _look_at_all(self) -> None:
        for drive in self.under_way:
            if drive.robot_goal_id is not None:
                self._renew(drive, await self._fetch_status(drive.robot_goal_id, drive.status))

    async def _fetch_status(self, robot_goal_id: str, before: GoalStatus) -> GoalStatus:
        """Return how a goal stands; as before while the robot cannot be reached."""
        try:
            return await self._robot.fetch_goal_status(robot_goal_id)
        except LinkError:
            return before
        except MapspeakError as error:
            cause = Cause(code=CauseCode.REFUSED, quote=error.message)
            return GoalStatus(state=GoalState.LOST, cause=cause)

    def _renew(self, drive: ServedDrive, status: GoalStatus) -> None:
        drive.status = status
        if status.state.is_final:
            drive.is_over.set()
        for listener in self.listeners:
            listener(drive)

    def _note(
        self, goal_id: str | None, robot_goal_id: str | None, status: GoalStatus
    ) -> ServedDrive:
        for waiting in self.under_way:
            if waiting.robot_goal_id is None:
                self._renew(waiting, GoalStatus(state=GoalState.PREEMPTED))
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


ACTION = "/navigate_to_pose"
ACTION_TYPE = "nav2_msgs/NavigateToPose"
EXECUTING, CANCELING, SUCCEEDED, CANCELED, ABORTED = 2, 3, 4, 5, 6
STATUS = {
    GoalState.ARRIVED: SUCCEEDED,
    GoalState.CANCELLED: CANCELED,
    GoalState.BLOCKED: ABORTED,
    GoalState.PREEMPTED: ABORTED,
    GoalState.LOST: ABORTED,
    GoalState.TIMED_OUT: ABORTED,
    GoalState.REJECTED: ABORTED,
}
TF_ERROR, FAILED_TO_MAKE_PROGRESS = 9002, 105
UNKNOWN_GOAL_ID, GOAL_TERMINATED = 2, 3
USUAL_SPEED_MPS = 0.3
FARTHEST_M = 1e8
"""Goals of clients lie anywhere; a duration of ROS must be able to say how long it takes."""


class Nav2:
    """The action server, its topics `feedback` and `status`, and its service `cancel_goal`."""

    def __init__(self, robot: Robot, hub: Hub, drives: Drives) -> None:
        self._robot = robot
        self._hub = hub
        self._drives = drives
        self._statuses: dict[ServedDrive, int] = {}
        drives.listeners.append(self._tell)
        hub.publish(f"{ACTION}/_action/status", {"status_list": []})

    async def cancel_operation(self, operation_id: str) -> None:
        """Ask the drive of one of rosbridge's operations to end, if it is under way."""
        for drive in reversed(self._drives.under_way):
            if drive.operation_id == operation_id:
                await self._drives.cancel(drive)
                return

    async def navigate(self, args: dict[str, Any]) -> ServedDrive | str:
        """Start a drive for a goal of the action; return a text where the goal is aborted at once.

        Raises:
            MapspeakError: The goal is rejected.
        """
        goal = await self._drives.resolve(read_pose_stamped(args["pose"]))
        if goal is None:
            return f"The frame {args['pose']['header']['frame_id']!r} does not exist."
        return await self._drives.start(goal)

    async def take_goal_pose(self, publication: Publication) -> None:
        """Start a drive to a pose from /goal_pose; errors are silent there."""
        try:
            await self.navigate({"pose": publication.message})
        except MapspeakError:
            return

    def publish_feedback(self, drive: ServedDrive, here: FramedPose) -> None:
        """Publish how far a goal's drive has come, and tell the client that follows it."""
        left_m = min(drive.status.distance_left_m or 0.0, FARTHEST_M)
        passed_s = self._robot.now_s - drive.started_s
        feedback = {
            "current_pose": write_pose_stamped(here, dialect=Dialect.ROS2),
            "navigation_time": write_stamp(passed_s, dialect=Dialect.ROS2),
            "estimated_time_remaining": write_stamp(left_m / USUAL_SPEED_MPS, dialect=Dialect.ROS2),
            "number_of_recoveries": drive.status.n_recoveries,
            "distance_remaining": left_m,
        }
        message = {"goal_id": _uuid_message(drive), "feedback": feedback}
        self._hub.publish(f"{ACTION}/_action/feedback", message)
        if drive.follow is not None:
            drive.follow(feedback)

    async def cancel_goals(self, request: dict[str, Any]) -> dict[str, Any]:
        """Answer action_msgs/CancelGoal; an id of zeros names no goal (ROS 2 design)."""
        wanted = bytes_of(request["goal_info"]["goal_id"]["uuid"], "uuid")
        goal_id = str(uuid.UUID(bytes=wanted)) if any(wanted) else ""
        chosen = await self._drives.find_meant(goal_id, find_stamp(request["goal_info"]) or 0.0)
        if goal_id and not chosen:
            return {"return_code": UNKNOWN_GOAL_ID, "goals_canceling": []}
        going = [drive for drive in chosen if not drive.is_over.is_set()]
        for drive in going:
            await self._drives.cancel(drive)
        code = GOAL_TERMINATED if goal_id and not going else 0
        return {"return_code": code, "goals_canceling": [_goal_info(drive) for drive in going]}

    def _tell(self, _drive: ServedDrive) -> None:
        """Publish the status of all goals, when one has changed."""
        statuses = {drive: status_of(drive) for drive in self._drives.all}
        if statuses == self._statuses:
            return
        self._statuses = statuses
        entries = [
            {"goal_info": _goal_info(drive), "status": status} for drive, status in statuses.items()
        ]
        self._hub.publish(f"{ACTION}/_action/status", {"status_list": entries})


def status_of(drive: ServedDrive) -> int:
    """Return the number that action_msgs/GoalStatus has for how a drive stands."""
    if drive.is_over.is_set():
        return STATUS[drive.status.state]
    return CANCELING if drive.is_cancelling else EXECUTING


def result_of(drive: ServedDrive) -> dict[str, Any]:
    """Return the action's result of a drive that has ended."""
    cause = drive.status.cause
    is_failed = drive.status.state in (GoalState.BLOCKED, GoalState.LOST, GoalState.TIMED_OUT)
    return {
        "error_code": FAILED_TO_MAKE_PROGRESS if is_failed else 0,
        "error_msg": cause.quote if is_failed and cause is not None else "",
    }


def _goal_info(drive: ServedDrive) -> dict[str, Any]:
    stamp = write_stamp(drive.started_s, dialect=Dialect.ROS2)
    return {"goal_id": _uuid_message(drive), "stamp": stamp}


def _uuid_message(drive: ServedDrive) -> dict[str, Any]:
    return {"uuid": uuid.UUID(drive.goal_id).bytes}


ACTIVE, PREEMPTING = 1, 6
ACTIONLIB = {
    GoalState.ARRIVED: (3, "Goal reached."),
    GoalState.CANCELLED: (2, ""),
    GoalState.PREEMPTED: (
        2,
        "This goal was canceled because another goal was received by the simple action server",
    ),
    GoalState.BLOCKED: (4, "Failed to find a valid plan."),
    GoalState.LOST: (4, "The robot has lost this goal."),
    GoalState.TIMED_OUT: (4, "The robot has come no nearer to this goal."),
    GoalState.REJECTED: (5, ""),
}
"""By actionlib_msgs/GoalStatus, and what it says."""


class MoveBase:
    """The action server behind /move_base/goal, /cancel, /feedback, /status and /result."""

    def __init__(self, robot: Robot, hub: Hub, drives: Drives) -> None:
        self._robot = robot
        self._hub = hub
        self._drives = drives
        self._n_unnamed = 0
        drives.listeners.append(self._tell)

    async def take_goal(self, publication: Publication) -> None:
        """Start the drive of a MoveBaseActionGoal."""
        message = publication.message
        await self._start(message["goal"]["target_pose"], message["goal_id"]["id"])

    async def take_simple_goal(self, publication: Publication) -> None:
        """Start the drive of a PoseStamped."""
        await self._start(publication.message, "")

    async def take_cancel(self, publication: Publication) -> None:
        """End one goal, all of them, or those up to a time, as actionlib's GoalID says."""
        said = publication.message
        for drive in await self._drives.find_meant(said["id"], find_stamp(said) or 0.0):
            with suppress(MapspeakError):
                await self._drives.cancel(drive)

    def publish_feedback(self, drive: ServedDrive, here: FramedPose) -> None:
        """Publish where the robot is on its way to a goal."""
        base = write_pose_stamped(here, dialect=Dialect.ROS1)
        self._publish("feedback", drive, {"feedback": {"base_position": base}})

    def publish_status(self) -> None:
        """Publish how all goals stand; actionlib does so five times a second."""
        entries = [_entry_of(drive) for drive in self._drives.all]
        self._hub.publish("/move_base/status", {"header": self._header(), "status_list": entries})

    async def _start(self, target: Message, goal_id: str) -> None:
        if not goal_id:
            self._n_unnamed += 1
            goal_id = f"/move_base-{self._n_unnamed}-{self._robot.now_s:.9f}"
        try:
            goal = await self._drives.resolve(read_pose_stamped(target))
            if goal is None:
                self._drives.wait_for_ever(goal_id=goal_id)
                return
            await self._drives.start(goal, goal_id=goal_id)
        except MapspeakError as error:
            self._refuse(goal_id, error)

    def _refuse(self, goal_id: str, error: MapspeakError) -> None:
        """End a goal that never began: with a bad quaternion move_base aborts it."""
        state = GoalState.BLOCKED if isinstance(error, LinkError) else GoalState.REJECTED
        status = _entry(goal_id, self._robot.now_s, ACTIONLIB[state][0], error.message)
        message = {"header": self._header(), "status": status, "result": {}}
        self._hub.publish("/move_base/result", message)

    def _tell(self, drive: ServedDrive) -> None:
        if drive.is_over.is_set():
            self._publish("result", drive, {"result": {}})
            self.publish_status()

    def _publish(self, last: str, drive: ServedDrive, content: dict[str, Any]) -> None:
        message = {"header": self._header(), "status": _entry_of(drive), **content}
        self._hub.publish(f"/move_base/{last}", message)

    def _header(self) -> dict[str, Any]:
        return write_header("", self._robot.now_s, dialect=Dialect.ROS1)


def _entry_of(drive: ServedDrive) -> dict[str, Any]:
    code, text = PREEMPTING if drive.is_cancelling else ACTIVE, ""
    if drive.is_over.is_set():
        code, text = ACTIONLIB[drive.status.state]
    return _entry(drive.goal_id, drive.started_s, code, text)


def _entry(goal_id: str, stamp_s: float, code: int, text: str) -> dict[str, Any]:
    stamp = write_stamp(stamp_s, dialect=Dialect.ROS1)
    return {"goal_id": {"stamp": stamp, "id": goal_id}, "status": code, "text": text}
