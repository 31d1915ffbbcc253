"""A robot on real ROS 1, as a program of its own: actionlib's action server before faulty wheels.

Started as `python -m ros1.robot_node`, in the folder tests, with the folders of ROS 1's Python in
`MAPSPEAK_ROS1_PYTHONPATH`. It says "ready" on its first line. Then each line it reads is a command,
as JSON, and is answered with one line, as JSON too; where the commands end, it ends.
"""

import json
import math
import os
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

# Behind our own packages: ROS 1 brings old ones of the same names.
sys.path.extend(os.environ["MAPSPEAK_ROS1_PYTHONPATH"].split(":"))

import rospy
from actionlib import ActionServer
from geometry_msgs.msg import TransformStamped, Twist
from move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback, MoveBaseResult
from nav_msgs.msg import OccupancyGrid as GridMessage
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage

from fakes import two_rooms
from faulty import AT_REST, STEP_S, Base, Faults, steer
from mapspeak.geometry import Pose

SPEED_MPS = 0.5
N_BEAMS, REACH_M = 72, 10.0
REPLACED = "This goal was canceled because another goal was received by the simple action server"

Message = Any  # rospy has no types


class LateServer(ActionServer):  # type: ignore[misc]  # actionlib has no types
    """An action server to which goals come late; a cancel comes at once, as it is."""

    def __init__(self, faults: Faults, **callbacks: Callable[[Message], None]) -> None:
        self._faults = faults
        self.n_goals = 0
        super().__init__("move_base", MoveBaseAction, auto_start=False, **callbacks)

    def internal_goal_callback(self, goal: Message) -> None:
        waited_s = 0.0
        while waited_s < self._faults.acceptance_s:
            time.sleep(STEP_S)
            waited_s += STEP_S
        super().internal_goal_callback(goal)
        self.n_goals += 1

    def publish_status(self) -> None:
        if "/move_base/status" not in self._faults.silent:
            super().publish_status()


class RobotNode:
    """Wheels, a map, transforms and a laser, and one goal at a time."""

    def __init__(self, pose: Pose) -> None:
        self.faults = Faults()
        self.base = Base(two_rooms(), pose=pose, faults=self.faults)
        self._lock = threading.RLock()
        self._goal: Message = None
        self.n_cancels = 0
        self._velocities = rospy.Publisher("/cmd_vel", Twist, queue_size=10)
        self._map = rospy.Publisher("/map", GridMessage, latch=True, queue_size=1)
        self._tf = rospy.Publisher("/tf", TFMessage, queue_size=100)
        self._scans = rospy.Publisher("/scan", LaserScan, queue_size=10)
        rospy.Subscriber("/cmd_vel", Twist, self._hear_velocity)
        self._map.publish(self._map_message())
        self._server = LateServer(self.faults, goal_cb=self._take, cancel_cb=self._cancel)
        self._server.start()

    def run(self) -> None:
        while not rospy.is_shutdown():
            time.sleep(STEP_S)
            with self._lock:
                self._navigate()
                self.base.move(STEP_S)
                self._publish_state()

    # --- goals

    def _take(self, handle: Message) -> None:
        with self._lock:
            if self.faults.rejects:
                handle.set_rejected()
                return
            if self._goal is not None:
                self._goal.set_canceled(MoveBaseResult(), REPLACED)
            handle.set_accepted()
            self._goal = handle
            if self.faults.aborts:
                self._end(handle.set_aborted, "It was told to abort.")

    def _cancel(self, handle: Message) -> None:
        with self._lock:
            self.n_cancels += 1
            is_current = self._goal is not None and self._goal == handle
            if is_current and not self.faults.ignores_cancels:
                self._end(handle.set_canceled, "")

    def _navigate(self) -> None:
        if self._goal is None or self.faults.hangs:
            return
        target = self._goal.get_goal().target_pose.pose
        yaw_rad = 2.0 * math.atan2(target.orientation.z, target.orientation.w)
        goal = Pose(target.position.x, target.position.y, yaw_rad)
        velocity = steer(self.base.pose, goal, speed_mps=SPEED_MPS)
        if velocity is None:
            self._end(self._goal.set_succeeded, "Goal reached.")
        else:
            self._command(velocity)
            self._goal.publish_feedback(MoveBaseFeedback())

    def _end(self, become: Callable[..., None], text: str) -> None:
        self._goal = None
        self._command(AT_REST)
        become(MoveBaseResult(), text)

    def _command(self, velocity: tuple[float, float]) -> None:
        message = Twist()
        message.linear.x, message.angular.z = velocity
        self._velocities.publish(message)

    def _hear_velocity(self, message: Message) -> None:
        with self._lock:
            self.base.hear((message.linear.x, message.angular.z))

    # --- what it says of itself

    def _map_message(self) -> Message:
        message, grid = GridMessage(), self.base.grid
        message.header.frame_id = "map"
        message.info.resolution = grid.resolution_m
        message.info.width, message.info.height = grid.n_cols, grid.n_rows
        message.info.origin.position.x, message.info.origin.position.y = (
            grid.origin.x,
            grid.origin.y,
        )
        message.info.origin.orientation.w = 1.0
        message.data = grid.cells.ravel().tolist()
        return message

    def _publish_state(self) -> None:
        if "/tf" not in self.faults.silent:
            pairs = (("map", "odom", Pose(0.0, 0.0)), ("odom", "base_footprint", self.base.pose))
            self._tf.publish(TFMessage([_transform(*each) for each in pairs]))
        if "/scan" not in self.faults.silent and rospy.get_time() % 0.2 < STEP_S:
            self._scans.publish(self._scan())

    def _scan(self) -> Message:
        """Return a scan as many drivers write it: a beam of range_max has met nothing."""
        message = LaserScan()
        message.header.frame_id, message.header.stamp = "base_footprint", rospy.Time.now()
        message.angle_min, message.angle_increment = -math.pi, math.tau / N_BEAMS
        message.angle_max = math.pi - message.angle_increment
        message.range_max = REACH_M
        ranges_m = self.base.scan(n_beams=N_BEAMS, range_m=REACH_M)
        message.ranges = [min(range_m, REACH_M) for range_m in ranges_m]
        return message

    # --- what the test commands

    def obey(self, line: str) -> str:
        command = json.loads(line)
        with self._lock:
            if command.pop("do") == "set_faults":
                for name, value in command.items():
                    setattr(self.faults, name, set(value) if name == "silent" else value)
                return "{}"
            pose = self.base.pose
            told = {
                "pose": [pose.x, pose.y, pose.yaw_rad],
                "driven_m": self.base.driven_m,
                "velocities": [velocity for _, velocity in self.base.heard],
                "is_driving": self._goal is not None,
                "n_goals": self._server.n_goals,
                "n_cancels": self.n_cancels,
            }
            return json.dumps(told)


def _transform(parent: str, child: str, pose: Pose) -> Message:
    message = TransformStamped()
    message.header.frame_id, message.child_frame_id = parent, child
    message.header.stamp = rospy.Time.now()
    message.transform.translation.x, message.transform.translation.y = pose.x, pose.y
    message.transform.rotation.z = math.sin(pose.yaw_rad / 2.0)
    message.transform.rotation.w = math.cos(pose.yaw_rad / 2.0)
    return message


def main() -> None:
    rospy.init_node("move_base", disable_signals=True)
    robot = RobotNode(Pose(1.5, 1.4))
    threading.Thread(target=robot.run, daemon=True).start()
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    for line in sys.stdin:
        sys.stdout.write(robot.obey(line) + "\n")
        sys.stdout.flush()
    rospy.signal_shutdown("The test is over.")


if __name__ == "__main__":
    main()
