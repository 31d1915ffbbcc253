"""Navigation of the robot of the ROS 2 tests: Nav2's actions, and the faults it is told of."""

import threading
import time
from collections.abc import Callable
from typing import Any

import rclpy
from geometry_msgs.msg import PoseStamped, Twist
from nav2_msgs.action import FollowWaypoints, NavigateToPose, Spin
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.duration import Duration

from faulty import AT_REST, Velocity, steer
from mapspeak.geometry import Pose, wrap_angle
from ros2.robot_motion import Motion
from ros2.robot_topics import message_from_pose, pose_from_message

STEP_S = 0.05
UNKNOWN_ERROR = 9000  # as Nav2 has it
SPIN_RADPS = 1.0

Message = Any  # rclpy has no types


class Navigation:
    """A node of its own, named as Nav2's, with the actions and topics that take goals.

    Goals wait in threads of their own, so all that changes the robot holds its lock.

    Attributes:
        node: To be spun; what does not spin any more is a process that hangs.
    """

    def __init__(
        self,
        motion: Motion,
        *,
        namespace: str,
        lock: threading.RLock,
        drives_by_velocity: bool,
    ) -> None:
        self.node = rclpy.create_node("bt_navigator", namespace=namespace)
        self.n_recoveries = 0
        self.goals: list[float] = []
        self.cancels: list[float] = []
        self._motion = motion
        self._lock = lock
        self._drive: Drive | None = None
        self._is_frozen = False
        self._velocities = (
            self.node.create_publisher(Twist, "cmd_vel", 10) if drives_by_velocity else None
        )

    @property
    def is_driving(self) -> bool:
        return self._drive is not None

    def offer_actions(self) -> None:
        self._offer(NavigateToPose, "navigate_to_pose", self._drive_to)
        self._offer(Spin, "spin", self._spin)

    def offer_waypoints(self) -> None:
        self._offer(FollowWaypoints, "follow_waypoints", self._follow)

    def offer_goal_topic(self) -> None:
        """Take goals that no one can cancel, as every robot that RViz sends to does."""
        self.node.create_subscription(PoseStamped, "goal_pose", self._take_pose, 10)

    # --- at each step

    def step(self) -> bool:
        """Drive on; say whether there was a goal to drive to."""
        drive = self._drive
        if self._is_frozen:
            return False
        if drive is not None and drive.is_cancelled:
            self._end(drive, "canceled")
        elif drive is not None and self._motion.faults.aborts:
            self._end(drive, "abort", "It was told to abort.")
        elif drive is not None and not self._motion.faults.hangs:
            self._drive_on(drive)
        return self._drive is not None

    def _drive_on(self, drive: "Drive") -> None:
        if drive.goal is None:
            self._turn_on(drive)
        elif self._velocities is not None:
            self._drive_by_velocity(drive, drive.goal)
        elif not self._motion.approach(drive.goal, STEP_S):
            self._end(drive, "abort", "The way is blocked.")
        elif self._motion.has_reached(drive.goal):
            self._end(drive, "succeed")
        else:
            drive.publish_feedback(self._feedback(drive, drive.goal))

    def _drive_by_velocity(self, drive: "Drive", goal: Pose) -> None:
        velocity = steer(self._motion.pose, goal, speed_mps=self._motion.speed_mps)
        self._command(velocity or AT_REST)
        if velocity is None:
            self._end(drive, "succeed")
        else:
            drive.publish_feedback(self._feedback(drive, goal))

    def _turn_on(self, drive: "Drive") -> None:
        step_rad = min(SPIN_RADPS * STEP_S, drive.left_rad)
        here = self._motion.pose
        self._motion.move_to(Pose(here.x, here.y, wrap_angle(here.yaw_rad + step_rad)))
        drive.left_rad -= step_rad
        drive.turned_rad += step_rad
        drive.publish_feedback(Spin.Feedback(angular_distance_traveled=drive.turned_rad))
        if drive.left_rad < 1e-6:
            self._end(drive, "succeed")

    def _command(self, velocity: Velocity) -> None:
        if self._velocities is not None:
            message = Twist()
            message.linear.x, message.angular.z = velocity
            self._velocities.publish(message)

    def _feedback(self, drive: "Drive", goal: Pose) -> Message:
        feedback = NavigateToPose.Feedback()
        now = self.node.get_clock().now()
        feedback.current_pose.header.frame_id = "map"
        feedback.current_pose.header.stamp = now.to_msg()
        feedback.current_pose.pose = message_from_pose(self._motion.pose)
        distance_m = self._motion.pose.point.distance_to(goal.point)
        feedback.distance_remaining = distance_m
        feedback.number_of_recoveries = self.n_recoveries
        feedback.navigation_time = (now - drive.began_at).to_msg()
        remaining_s = distance_m / self._motion.speed_mps
        feedback.estimated_time_remaining = Duration(seconds=remaining_s).to_msg()
        return feedback

    # --- goals

    def _offer(self, kind: type, name: str, execute: Callable[[Message], Message]) -> None:
        ActionServer(
            self.node,
            kind,
            name,
            execute_callback=execute,
            callback_group=ReentrantCallbackGroup(),
            goal_callback=self._judge_goal,
            cancel_callback=self._judge_cancel,
        )

    def _judge_goal(self, goal: Message) -> Message:
        """Accept a goal, as late as the faults say; until then nobody can cancel it."""
        self.goals.append(time.time())
        faults, waited_s = self._motion.faults, 0.0
        while waited_s < faults.acceptance_s:
            time.sleep(STEP_S)
            waited_s += STEP_S
        frame = goal.pose.header.frame_id if isinstance(goal, NavigateToPose.Goal) else "map"
        is_taken = frame == "map" and not faults.rejects
        return GoalResponse.ACCEPT if is_taken else GoalResponse.REJECT

    def _judge_cancel(self, _handle: Message) -> Message:
        self.cancels.append(time.time())
        is_deaf = self._motion.faults.ignores_cancels
        return CancelResponse.REJECT if is_deaf else CancelResponse.ACCEPT

    def _drive_to(self, handle: Message) -> Message:
        goal = pose_from_message(handle.request.pose.pose)
        return self._begin(Drive(self.node, NavigateToPose.Result(), handle=handle, goal=goal))

    def _spin(self, handle: Message) -> Message:
        drive = Drive(self.node, Spin.Result(), handle=handle)
        drive.left_rad = handle.request.target_yaw
        return self._begin(drive)

    def _follow(self, handle: Message) -> Message:
        """Drive to one pose after the other; each has to be reached."""
        result, error = FollowWaypoints.Result(), 0
        for index, pose in enumerate(handle.request.poses):
            handle.publish_feedback(FollowWaypoints.Feedback(current_waypoint=index))
            drive = Drive(self.node, NavigateToPose.Result(), goal=pose_from_message(pose.pose))
            error = error or self._begin(drive).error_code
        result.error_code = error
        (handle.abort if error else handle.succeed)()
        return result

    def _take_pose(self, message: Message) -> None:
        goal = pose_from_message(message.pose)
        with self._lock:
            self._replace(Drive(self.node, NavigateToPose.Result(), goal=goal))

    def _begin(self, drive: "Drive") -> Message:
        """Take a new goal, and wait until it is over."""
        with self._lock:
            self._replace(drive)
        drive.is_over.wait()
        return drive.result

    def _replace(self, drive: "Drive | None") -> None:
        """End the goal under way, as Nav2 does when a new one comes."""
        if self._drive:
            self._end(self._drive, "abort", "Another goal came.")
        self._drive = drive

    def _end(self, drive: "Drive", become: str, why: str = "") -> None:
        self._drive = None
        self._command(AT_REST)
        drive.end(become, why)

    def freeze(self) -> None:
        """Do nothing any more; the wheels keep what they were told."""
        self._is_frozen = True

    def leave(self) -> None:
        """End what waits, so that the program can end."""
        with self._lock:
            if self._drive:
                self._end(self._drive, "abort", "The robot is switched off.")


class Drive:
    """A goal under way; one from a topic has no handle, one to turn has no pose."""

    def __init__(
        self, node: Message, result: Message, *, handle: Message = None, goal: Pose | None = None
    ) -> None:
        self.goal = goal
        self.began_at = node.get_clock().now()
        self.result = result
        self.left_rad = self.turned_rad = 0.0
        self.is_over = threading.Event()
        self._handle = handle

    @property
    def is_cancelled(self) -> bool:
        return self._handle is not None and self._handle.is_cancel_requested

    def publish_feedback(self, feedback: Message) -> None:
        if self._handle is not None:
            self._handle.publish_feedback(feedback)

    def end(self, become: str, why: str) -> None:
        if self._handle is not None:
            getattr(self._handle, become)()
        self.result.error_code = UNKNOWN_ERROR if why else NavigateToPose.Result.NONE
        self.result.error_msg = why
        self.is_over.set()
