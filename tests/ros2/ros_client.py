"""A plain rclpy client, with which tests see a robot as any ROS program does."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import rclpy
from nav2_msgs.action import NavigateToPose
from rclpy.action import ActionClient
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile

from mapspeak.geometry import Pose
from ros2.robot_topics import message_from_pose

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PATIENCE_S = 20.0

Message = Any  # rclpy has no types


class RosClient:
    """Waits for messages, goals and services, each time with an end."""

    def __init__(self, node: Any, executor: Any) -> None:  # noqa: ANN401
        self.node = node
        self._executor = executor
        self._navigator = ActionClient(node, NavigateToPose, "navigate_to_pose")

    def wait_for_message(
        self,
        kind: type,
        topic: str,
        *,
        where: Callable[[Message], bool] = lambda _: True,
        qos: QoSProfile | int = 10,
        meanwhile: Callable[[], None] = lambda: None,
        patience_s: float = PATIENCE_S,
    ) -> Message:
        """Gives the first message of a kind that fits.

        Args:
            kind: Its class.
            topic: Its topic.
            where: Whether a message is the one.
            qos: How it is sent.
            meanwhile: What is done once for every message that does not fit.
            patience_s: How long to wait at most.
        """
        found = rclpy.task.Future()

        def take(message: Message) -> None:
            if found.done():
                return
            if where(message):
                found.set_result(message)
            else:
                meanwhile()

        subscription = self.node.create_subscription(kind, topic, take, qos)
        try:
            return self.wait_for(found, patience_s=patience_s)
        finally:
            self.node.destroy_subscription(subscription)

    def send_goal(
        self,
        goal: Pose,
        *,
        frame: str = "map",
        on_feedback: Callable[[Message], None] = lambda _: None,
    ) -> Message:
        """Gives the handle of a goal, which says whether it was accepted."""
        return self.wait_for(self.begin_goal(goal, frame=frame, on_feedback=on_feedback))

    def begin_goal(
        self,
        goal: Pose,
        *,
        frame: str = "map",
        on_feedback: Callable[[Message], None] = lambda _: None,
    ) -> Message:
        """Sends a goal; gives what its handle will be in."""
        request = NavigateToPose.Goal()
        request.pose.header.frame_id = frame
        request.pose.pose = message_from_pose(goal)
        if not self.has_navigation(within_s=PATIENCE_S):
            raise AssertionError("no action server")
        return self._navigator.send_goal_async(
            request, feedback_callback=lambda message: on_feedback(message.feedback)
        )

    def has_navigation(self, *, within_s: float) -> bool:
        return bool(self._navigator.wait_for_server(timeout_sec=within_s))

    def send(self, kind: type, action: str, goal: Message) -> Message:
        """Gives the handle of a goal of another action."""
        client = ActionClient(self.node, kind, action)
        if not client.wait_for_server(timeout_sec=PATIENCE_S):
            raise AssertionError("no action server")
        return self.wait_for(client.send_goal_async(goal))

    def start_goal(self, goal: Pose) -> Message:
        """Gives the handle of a goal that the robot has begun to drive to."""
        told: list[Message] = []
        handle = self.send_goal(goal, on_feedback=told.append)
        self.wait_until(lambda: bool(told))
        return handle

    def wait_for_result(self, handle: Message) -> Message:
        """Waits until a goal is over; gives its status and its result."""
        return self.wait_for(handle.get_result_async())

    def cancel(self, handle: Message) -> bool:
        """Asks for the end of a goal, and says whether the robot will."""
        reply = self.wait_for(handle.cancel_goal_async())
        return bool(reply.goals_canceling)

    def call(self, kind: type, name: str, request: Message) -> Message:
        client = self.node.create_client(kind, name)
        if not client.wait_for_service(timeout_sec=PATIENCE_S):
            raise AssertionError(f"no service {name}")
        try:
            return self.wait_for(client.call_async(request))
        finally:
            self.node.destroy_client(client)

    def wait_until(self, condition: Callable[[], bool]) -> None:
        """Lets messages come until something is so."""
        never = rclpy.task.Future()
        deadline = self.node.get_clock().now() + Duration(seconds=PATIENCE_S)
        while not condition():
            self._executor.spin_once_until_future_complete(never, timeout_sec=1.0)
            if self.node.get_clock().now() > deadline:
                raise TimeoutError(f"nothing within {PATIENCE_S} s")

    def wait_for(self, future: Message, *, patience_s: float = PATIENCE_S) -> Message:
        self._executor.spin_until_future_complete(future, timeout_sec=patience_s)
        if not future.done():
            raise TimeoutError(f"nothing within {patience_s} s")
        return future.result()

    def close(self) -> None:
        self._navigator.destroy()
        self.node.destroy_node()


@contextmanager
def open_ros_client() -> Iterator[RosClient]:
    """Joins the ROS domain of this process's environment."""
    with rclpy.init():
        executor = SingleThreadedExecutor()
        node = rclpy.create_node("client")
        executor.add_node(node)
        client = RosClient(node, executor)
        try:
            yield client
        finally:
            client.close()
            executor.shutdown()
