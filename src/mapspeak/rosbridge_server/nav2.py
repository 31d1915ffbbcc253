"""Nav2's NavigateToPose, as rosbridge's action operations and as topics and services of ROS 2."""

import uuid
from typing import Any

from mapspeak.errors import MapspeakError
from mapspeak.robot import GoalState, Robot
from mapspeak.ros.messages.fields import Dialect, bytes_of, write_stamp
from mapspeak.ros.messages.poses import FramedPose, read_pose_stamped, write_pose_stamped
from mapspeak.rosbridge_server.drives import Drives, ServedDrive
from mapspeak.rosbridge_server.hub import Hub, Publication

ACTION = "/navigate_to_pose"
ACTION_TYPE = "nav2_msgs/NavigateToPose"
EXECUTING, CANCELING, SUCCEEDED, CANCELED, ABORTED = 2, 3, 4, 5, 6
STATUS = {
    GoalState.ARRIVED: SUCCEEDED,
    GoalState.CANCELLED: CANCELED,
    GoalState.BLOCKED: ABORTED,
    GoalState.PREEMPTED: ABORTED,
    GoalState.LOST: ABORTED,
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
        """Answer action_msgs/CancelGoal; an id of zeros means every goal (ROS 2 design)."""
        wanted = bytes_of(request["goal_info"]["goal_id"]["uuid"], "uuid")
        chosen = self._drives.all
        if any(wanted):
            chosen = [drive for drive in chosen if uuid.UUID(drive.goal_id).bytes == wanted]
            if not chosen:
                return {"return_code": UNKNOWN_GOAL_ID, "goals_canceling": []}
        going = [drive for drive in chosen if not drive.is_over.is_set()]
        for drive in going:
            await self._drives.cancel(drive)
        code = GOAL_TERMINATED if any(wanted) and not going else 0
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
    is_failed = drive.status.state in (GoalState.BLOCKED, GoalState.LOST)
    return {
        "error_code": FAILED_TO_MAKE_PROGRESS if is_failed else 0,
        "error_msg": cause.quote if is_failed and cause is not None else "",
    }


def _goal_info(drive: ServedDrive) -> dict[str, Any]:
    stamp = write_stamp(drive.started_s, dialect=Dialect.ROS2)
    return {"goal_id": _uuid_message(drive), "stamp": stamp}


def _uuid_message(drive: ServedDrive) -> dict[str, Any]:
    return {"uuid": uuid.UUID(drive.goal_id).bytes}
