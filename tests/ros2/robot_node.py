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
from rclpy.executors import MultiThreadedExecutor

from drawing import grid_from_text
from faulty import Faults
from mapspeak.geometry import Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.mapfiles import load_map
from ros2.robot_motion import Motion
from ros2.robot_navigation import STEP_S, Navigation
from ros2.robot_topics import Topics

N_THREADS = 8  # each goal under way holds one
COSTMAPS = ("local_costmap", "global_costmap")
USUAL_PARTS = ("map", "tf", "odometry", "scan", "camera", "velocity", "actions")

Reply = dict[str, Any]


class RobotNode:
    """What the robot does of itself, at each step, and when it is asked to."""

    def __init__(
        self,
        motion: Motion,
        executor: Any,  # noqa: ANN401
        map_texts: "MapReader",
        arguments: argparse.Namespace,
    ) -> None:
        self.node = rclpy.create_node("robot", namespace=arguments.namespace)
        self._executor = executor
        self._arguments = arguments
        self._lock = threading.RLock()
        self.motion = motion
        self.topics = Topics(self.node, motion.faults)
        self._read_map = map_texts
        self._bystanders: list[Any] = []
        declare_parameters(self.node)
        self.topics.offer_motor_switch(self.switch_motors)
        self.navigation = self._start_navigation()
        for part in {*USUAL_PARTS, *arguments.also} - {*arguments.later}:
            self.appear(part=part)
        for number in range(arguments.participants):
            self._join(number)
        executor.add_node(self.node)
        self.node.create_timer(STEP_S, self.step)

    def _start_navigation(self) -> Navigation:
        navigation = Navigation(
            self.motion,
            namespace=self._arguments.namespace,
            lock=self._lock,
            drives_by_velocity=self._arguments.drives_by_velocity,
        )
        self._executor.add_node(navigation.node)
        return navigation

    def _join(self, number: int) -> None:
        """Add a participant to the domain: a process more, as far as DDS can tell."""
        context = rclpy.Context()
        context.init()
        self._bystanders.append(rclpy.create_node(f"bystander_{number}", context=context))

    # --- at each step

    def step(self) -> None:
        with self._lock:
            if self.motion.faults.is_paused:
                return
            is_carried = self.navigation.step() and not self._arguments.drives_by_velocity
            self.motion.pass_time(STEP_S, is_carried=is_carried)
            self.topics.publish_state(self.motion)

    # --- what others ask by ROS

    def hear_velocity(self, message: Any) -> None:  # noqa: ANN401
        with self._lock:
            self.motion.hear((message.linear.x, message.angular.z))

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

    def appear(self, *, part: str) -> Reply:
        """Start a part of the robot that was not there yet."""
        if part == "actions":
            self.navigation.offer_actions()
        elif part == "goal_topic":
            self.navigation.offer_goal_topic()
        elif part == "waypoints":
            self.navigation.offer_waypoints()
        elif part == "costmaps":
            self._start_costmaps()
        else:
            self.topics.start(part, on_velocity=self.hear_velocity)
        if part == "map":
            self.topics.publish_map(self.motion.grid)
        return {}

    def _start_costmaps(self) -> None:
        for name in COSTMAPS:
            node = rclpy.create_node(name, namespace=f"{self._arguments.namespace}/{name}")
            if self._arguments.footprint:
                node.declare_parameter("footprint", self._arguments.footprint)
            else:
                node.declare_parameter("robot_radius", self._arguments.robot_radius)
            self._executor.add_node(node)

    def set_faults(self, **faults: Any) -> Reply:  # noqa: ANN401
        for name, value in faults.items():
            setattr(self.motion.faults, name, set(value) if name == "silent" else value)
        return {}

    def kill_navigation(self) -> Reply:
        """Let navigation hang in what it does, as a process does that was killed."""
        self._executor.remove_node(self.navigation.node)
        self.navigation.freeze()
        return {}

    def restart_navigation(self) -> Reply:
        self.navigation.node.destroy_node()
        self.navigation = self._start_navigation()
        self.navigation.offer_actions()
        return {}

    def change_map(self, *, text: str) -> Reply:
        self.motion.grid = self._read_map(text)
        self.topics.publish_map(self.motion.grid)
        return {}

    def update_map(self, *, row: int, col: int, text: str) -> Reply:
        """Change a rectangle of the map and tell only that, as costmaps do."""
        patch = grid_from_text(text)
        self.motion.paint(patch.cells, row=row, col=col)
        self.topics.publish_map_update(patch.cells, row=row, col=col)
        return {}

    def tell(self) -> Reply:
        """Tell the truth about the robot, and what it has heard."""
        pose = self.motion.pose
        return {
            "pose": [pose.x, pose.y, pose.yaw_rad],
            "driven_m": self.motion.driven_m,
            "velocities": [velocity for _, velocity in self.motion.heard],
            "velocity_times_s": [heard_s for heard_s, _ in self.motion.heard],
            "is_driving": self.navigation.is_driving,
            "n_goals": len(self.navigation.goals),
            "n_cancels": len(self.navigation.cancels),
        }

    def leave(self) -> None:
        """End what waits, so that the program can end."""
        self.motion.faults.acceptance_s = 0.0
        self.navigation.leave()

    def set_recoveries(self, *, n: int) -> Reply:
        self.navigation.n_recoveries = n
        return {}


COMMANDS: dict[str, Callable[..., Reply]] = {
    "appear": RobotNode.appear,
    "change_map": RobotNode.change_map,
    "kill_navigation": RobotNode.kill_navigation,
    "restart_navigation": RobotNode.restart_navigation,
    "set_faults": RobotNode.set_faults,
    "set_recoveries": RobotNode.set_recoveries,
    "tell": RobotNode.tell,
    "update_map": RobotNode.update_map,
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
    """Declare one parameter of each kind."""
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
    parser.add_argument("--namespace", default="", help="of all names, TF's too")
    parser.add_argument(
        "--also", nargs="*", default=[], help="goal_topic, costmaps, rear_camera, plans, waypoints"
    )
    parser.add_argument("--later", nargs="*", default=[], help="parts that come when told to")
    parser.add_argument("--participants", type=int, default=0, help="that do nothing, beside it")
    parser.add_argument("--robot-radius", type=float, default=0.35, help="in the costmaps")
    parser.add_argument("--footprint", default="", help="in the costmaps, instead of a radius")
    parser.add_argument(
        "--drives-by-velocity", action="store_true", help="navigation publishes /cmd_vel"
    )
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
        read_map(arguments.map),
        pose=Pose(*arguments.pose),
        speed_mps=arguments.speed_mps,
        faults=Faults(),
    )
    with rclpy.init():
        executor = MultiThreadedExecutor(N_THREADS)
        robot = RobotNode(motion, executor, read_map, arguments)

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
