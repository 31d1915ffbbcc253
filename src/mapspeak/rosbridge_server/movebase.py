"""move_base of ROS 1: the action as five topics (actionlib), and the simple goal of RViz."""

from typing import Any

from mapspeak.errors import LinkError, MapspeakError
from mapspeak.robot import GoalState, Robot
from mapspeak.ros.messages.fields import Dialect, Message, read_stamp, write_header, write_stamp
from mapspeak.ros.messages.poses import FramedPose, read_pose_stamped, write_pose_stamped
from mapspeak.rosbridge_server.drives import Drives, ServedDrive
from mapspeak.rosbridge_server.hub import Hub, Publication

ACTIVE, PREEMPTED, SUCCEEDED, ABORTED, REJECTED, PREEMPTING = 1, 2, 3, 4, 5, 6
STATUS = {
    GoalState.ARRIVED: (SUCCEEDED, "Goal reached."),
    GoalState.CANCELLED: (PREEMPTED, ""),
    GoalState.PREEMPTED: (
        PREEMPTED,
        "This goal was canceled because another goal was received by the simple action server",
    ),
    GoalState.BLOCKED: (ABORTED, "Failed to find a valid plan."),
    GoalState.LOST: (ABORTED, "The robot has lost this goal."),
    GoalState.REJECTED: (REJECTED, ""),
}


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
        goal_id, until_s = publication.message["id"], _stamp_of(publication.message)
        for drive in self._drives.all:
            is_meant = drive.goal_id == goal_id or drive.started_s <= until_s
            if is_meant or (not goal_id and until_s == 0.0):
                try:
                    await self._drives.cancel(drive)
                except MapspeakError:
                    continue

    def publish_feedback(self, drive: ServedDrive, here: FramedPose) -> None:
        """Publish where the robot is on its way to a goal."""
        base = write_pose_stamped(here, dialect=Dialect.ROS1)
        self._publish("feedback", drive, {"feedback": {"base_position": base}})

    def publish_status(self) -> None:
        """Publish how all goals stand; actionlib does so five times a second."""
        entries = [_status_of(drive) for drive in self._drives.all]
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
        code = ABORTED if isinstance(error, LinkError) else REJECTED
        status = _status_message(goal_id, self._robot.now_s, code, error.message)
        message = {"header": self._header(), "status": status, "result": {}}
        self._hub.publish("/move_base/result", message)

    def _tell(self, drive: ServedDrive) -> None:
        if drive.is_over.is_set():
            self._publish("result", drive, {"result": {}})
            self.publish_status()

    def _publish(self, last: str, drive: ServedDrive, content: dict[str, Any]) -> None:
        message = {"header": self._header(), "status": _status_of(drive), **content}
        self._hub.publish(f"/move_base/{last}", message)

    def _header(self) -> dict[str, Any]:
        return write_header("", self._robot.now_s, dialect=Dialect.ROS1)


def _status_of(drive: ServedDrive) -> dict[str, Any]:
    code, text = PREEMPTING if drive.is_cancelling else ACTIVE, ""
    if drive.is_over.is_set():
        code, text = STATUS[drive.status.state]
    return _status_message(drive.goal_id, drive.started_s, code, text)


def _status_message(goal_id: str, stamp_s: float, code: int, text: str) -> dict[str, Any]:
    stamp = write_stamp(stamp_s, dialect=Dialect.ROS1)
    return {"goal_id": {"stamp": stamp, "id": goal_id}, "status": code, "text": text}


def _stamp_of(message: Message) -> float:
    try:
        return read_stamp(message["stamp"])
    except LinkError:
        return 0.0
