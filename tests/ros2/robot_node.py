"""A robot on real ROS 2, as a program of its own: it drives straight on and knows walls.

Started as `python -m ros2.robot_node --map TEXT_OR_FILE`, in the folder tests, with a Python that
has rclpy. It says "ready" on its first line. Then each line it reads is a command, as JSON, and is
answered with one line, as JSON too; where the commands end, it ends.
"""

import argparse
import json
import math
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rclpy
from nav2_msgs.action import NavigateToPose
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.duration import Duration
from rclpy.executors import MultiThreadedExecutor

from drawing import grid_from_text
from mapspeak.geometry import Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.mapfiles import load_map
from ros2.robot_motion import Motion
from ros2.robot_topics import Topics, pose_from_message

STEP_S = 0.05
N_THREADS = 8  # each goal under way holds one
UNKNOWN_ERROR = 9000  # as Nav2 has it

Reply = dict[str, Any]


class RobotNode:
    """What the robot does of itself, at each step, and when it is asked to.

    Goals wait in threads of their own, so all that changes the robot holds its lock.
    """

    def __init__(self, *, motion: Motion, map_texts: "MapReader") -> None:
        self.node = rclpy.create_node("robot")
        self._lock = threading.RLock()
        self.motion = motion
        self.topics = Topics(self.node, on_velocity=self.hear_velocity)
        self._read_map = map_texts
        self._drive: Drive | None = None
        self._n_recoveries = 0
        self._velocities: list[tuple[float, float]] = []
        declare_parameters(self.node)
        self._actions = ActionServer(
            self.node,
            NavigateToPose,
            "navigate_to_pose",
            execute_callback=self.drive,
            callback_group=ReentrantCallbackGroup(),
            goal_callback=self.judge_goal,
            cancel_callback=lambda _handle: CancelResponse.ACCEPT,
        )
        self.topics.offer_motor_switch(self.switch_motors)
        self.topics.publish_map(motion.grid)
        self.node.create_timer(STEP_S, self.step)

    # --- at each step

    def step(self) -> None:
        with self._lock:
            if self._drive and self._drive.handle.is_cancel_requested:
                self.end(self._drive, self._drive.handle.canceled)
            if self._drive:
                self.drive_on(self._drive)
            else:
                self.motion.coast(STEP_S)
            self.topics.publish_state(self.motion)

    def drive_on(self, drive: "Drive") -> None:
        is_blocked = not self.motion.approach(drive.goal, STEP_S)
        if is_blocked:
            self.end(drive, drive.handle.abort, "The way is blocked.")
        elif self.motion.has_reached(drive.goal):
            self.end(drive, drive.handle.succeed)
        else:
            drive.handle.publish_feedback(self.feedback(drive))

    def feedback(self, drive: "Drive") -> Any:  # noqa: ANN401 - rclpy has no types
        feedback = NavigateToPose.Feedback()
        feedback.current_pose = self.topics.stamped(self.motion.pose)
        distance_m = self.motion.pose.point.distance_to(drive.goal.point)
        feedback.distance_remaining = distance_m
        feedback.number_of_recoveries = self._n_recoveries
        feedback.navigation_time = (self.node.get_clock().now() - drive.began_at).to_msg()
        remaining_s = distance_m / self.motion.speed_mps
        feedback.estimated_time_remaining = Duration(seconds=remaining_s).to_msg()
        return feedback

    # --- goals

    def judge_goal(self, goal: Any) -> Any:  # noqa: ANN401
        is_known = goal.pose.header.frame_id == "map"
        return GoalResponse.ACCEPT if is_known else GoalResponse.REJECT

    def drive(self, handle: Any) -> Any:  # noqa: ANN401
        """Takes a new goal, which ends the one before as Nav2 does, and waits until it is over."""
        drive = Drive(handle, began_at=self.node.get_clock().now())
        with self._lock:
            if self._drive:
                self.end(self._drive, self._drive.handle.abort, "Another goal came.")
            self._drive = drive
        drive.is_over.wait()
        return drive.result

    def end(self, drive: "Drive", become: Callable[[], None], why: str = "") -> None:
        self._drive = None
        become()
        drive.result.error_code = UNKNOWN_ERROR if why else NavigateToPose.Result.NONE
        drive.result.error_msg = why
        drive.is_over.set()

    # --- what others ask by ROS

    def hear_velocity(self, message: Any) -> None:  # noqa: ANN401
        velocity = (message.linear.x, message.angular.z)
        with self._lock:
            self._velocities.append(velocity)
            self.motion.take_velocity(*velocity)

    def switch_motors(self, request: Any, response: Any) -> Any:  # noqa: ANN401
        self.motion.has_power = request.data
        response.success = True
        response.message = f"The motors are {'on' if request.data else 'off'}."
        return response

    # --- what the test commands

    def obey(self, line: str) -> None:
        command = json.loads(line)
        with self._lock:
            reply = COMMANDS[command.pop("do")](self, **command)
        say(json.dumps(reply))

    def change_map(self, *, text: str) -> Reply:
        self.motion.grid = self._read_map(text)
        self.topics.publish_map(self.motion.grid)
        return {}

    def update_map(self, *, row: int, col: int, text: str) -> Reply:
        """Changes a rectangle of the map and tells only that, as costmaps do."""
        patch = grid_from_text(text)
        self.motion.paint(patch.cells, row=row, col=col)
        self.topics.publish_map_update(patch.cells, row=row, col=col)
        return {}

    def tell(self) -> Reply:
        """Tells the truth about the robot, and what it has heard on /cmd_vel."""
        pose = self.motion.pose
        return {
            "pose": [pose.x, pose.y, pose.yaw_rad],
            "velocities": self._velocities,
            "is_driving": self._drive is not None,
        }

    def leave(self) -> None:
        """Ends what waits, so that the program can end."""
        with self._lock:
            if self._drive:
                self.end(self._drive, self._drive.handle.abort, "The robot is switched off.")

    def set_recoveries(self, *, n: int) -> Reply:
        self._n_recoveries = n
        return {}


class Drive:
    """A goal under way."""

    def __init__(self, handle: Any, *, began_at: Any) -> None:  # noqa: ANN401
        self.handle = handle
        self.goal = pose_from_message(handle.request.pose.pose)
        self.began_at = began_at
        self.result = NavigateToPose.Result()
        self.is_over = threading.Event()


COMMANDS: dict[str, Callable[..., Reply]] = {
    "change_map": RobotNode.change_map,
    "update_map": RobotNode.update_map,
    "tell": RobotNode.tell,
    "set_recoveries": RobotNode.set_recoveries,
}


class MapReader:
    """Reads a map drawn as text, at one resolution, or a map file."""

    def __init__(self, *, resolution_m: float) -> None:
        self._resolution_m = resolution_m

    def __call__(self, text: str) -> OccupancyGrid:
        if text.endswith(".yaml"):
            return load_map(Path(text)).grid
        return grid_from_text(text, resolution_m=self._resolution_m)


def declare_parameters(node: Any) -> None:  # noqa: ANN401
    """Declares one parameter of each kind."""
    for name, value in {
        "robot_name": "test robot",
        "robot_radius": 0.22,
        "max_recoveries": 6,
        "is_docked": False,
        "footprint_x": [0.2, 0.2, -0.2, -0.2],
        "layers": ["static", "obstacles"],
        "sensor_ids": [3, 5],
        "sensor_is_on": [True, False],
        "serial": [bytes([value]) for value in b"\x01\xff"],
    }.items():
        node.declare_parameter(name, value)


def read_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    parser.add_argument("--map", required=True, help="a drawing, or a map_server .yaml file")
    parser.add_argument("--resolution-m", type=float, default=0.5)
    parser.add_argument("--pose", type=float, nargs=3, required=True, metavar=("X", "Y", "YAW"))
    parser.add_argument("--speed-mps", type=float, default=1.0)
    return parser.parse_args()


def say(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def main() -> None:
    arguments = read_arguments()
    if not math.isfinite(arguments.speed_mps) or arguments.speed_mps <= 0.0:
        raise SystemExit("The speed must be above zero.")
    read_map = MapReader(resolution_m=arguments.resolution_m)
    motion = Motion(
        grid=read_map(arguments.map), pose=Pose(*arguments.pose), speed_mps=arguments.speed_mps
    )
    with rclpy.init():
        robot = RobotNode(motion=motion, map_texts=read_map)
        executor = MultiThreadedExecutor(N_THREADS)
        executor.add_node(robot.node)

        def listen() -> None:
            for line in sys.stdin:
                robot.obey(line)
            robot.leave()
            executor.shutdown(timeout_sec=0.0)

        threading.Thread(target=listen, daemon=True).start()
        say("ready")
        executor.spin()


if __name__ == "__main__":
    main()
