"""What the robot of the ROS 2 tests publishes and hears."""

import array
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from geometry_msgs.msg import (
    Point32,
    PolygonStamped,
    PoseStamped,
    Transform,
    TransformStamped,
    Twist,
)
from geometry_msgs.msg import Pose as PoseMessage
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid as GridMessage
from nav_msgs.msg import Odometry, Path
from numpy.typing import NDArray
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import CameraInfo, Image, LaserScan
from std_srvs.srv import SetBool
from tf2_msgs.msg import TFMessage

from faulty import Faults
from mapspeak.geometry import Pose
from mapspeak.spatial import OccupancyGrid
from ros2.robot_motion import Motion

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
MAP_FROM_ODOM = Pose(1.0, -0.5, 0.3)
CAMERA_EVERY = 4
N_BEAMS = 72
SCAN_RANGE_M = 10.0
WIDTH, HEIGHT, FOCAL_LENGTH_PX = 64, 48, 32.0
PADDING_BYTES = 8
PARTS: dict[str, tuple[tuple[str, type, QoSProfile | int], ...]] = {
    "map": (("map", GridMessage, LATCHED), ("map_updates", OccupancyGridUpdate, 10)),
    "tf": (("tf", TFMessage, 100), ("tf_static", TFMessage, LATCHED)),
    "odometry": (("odom", Odometry, 10),),
    "scan": (("scan", LaserScan, 10),),
    "camera": (("camera/image_raw", Image, 10), ("camera/camera_info", CameraInfo, 10)),
    "rear_camera": (
        ("rear_camera/image_raw", Image, 10),
        ("rear_camera/camera_info", CameraInfo, 10),
    ),
    "plans": (
        ("plan", Path, 10),
        ("local_costmap/published_footprint", PolygonStamped, 10),
        ("local_costmap/costmap", GridMessage, LATCHED),
    ),
    "velocity": (),
}
"""What belongs to each part of the robot: its topics, their types and how they are sent."""

Message = Any  # rclpy has no types


class Topics:
    """Publishers and subscriptions of one node; a part is there from when it is started."""

    def __init__(self, node: Any, faults: Faults) -> None:  # noqa: ANN401
        self._node = node
        self._faults = faults
        self._n_steps = 0
        self._publishers: dict[str, Any] = {}

    def start(self, part: str, *, on_velocity: Callable[[Message], None]) -> None:
        """Start to publish, or to hear, what belongs to a part of the robot."""
        if part == "velocity":
            self._node.create_subscription(Twist, "cmd_vel", on_velocity, 10)
        for topic, kind, qos in PARTS[part]:
            self._publishers[topic] = self._node.create_publisher(kind, topic, qos)
        if part == "tf":
            self._publish_static_frames()

    def offer_motor_switch(self, answer: Callable[[Message, Message], Message]) -> None:
        self._node.create_service(SetBool, "switch_motors", answer)

    def _publish(self, topic: str, message: Message) -> None:
        publisher = self._publishers.get(topic)
        if publisher is not None and publisher.topic_name not in self._faults.silent:
            publisher.publish(message)

    # --- the map

    def publish_map(self, grid: OccupancyGrid, *, topic: str = "map") -> None:
        message = GridMessage()
        message.header.frame_id = "map"
        message.header.stamp = self._now()
        message.info.resolution = grid.resolution_m
        message.info.width, message.info.height = grid.n_cols, grid.n_rows
        message.info.origin = message_from_pose(grid.origin)
        message.data = packed(grid.cells)
        self._publish(topic, message)

    def publish_map_update(self, cells: NDArray[np.int8], *, row: int, col: int) -> None:
        message = OccupancyGridUpdate()
        message.header.frame_id = "map"
        message.header.stamp = self._now()
        message.x, message.y = col, row
        message.height, message.width = cells.shape
        message.data = packed(cells)
        self._publish("map_updates", message)

    # --- where the robot is and what it sees

    def publish_state(self, motion: Motion) -> None:
        odom_from_base = MAP_FROM_ODOM.inverse() @ motion.pose
        for parent, child, pose in (
            ("map", "odom", MAP_FROM_ODOM),
            ("odom", "base_footprint", odom_from_base),
        ):
            self._publish("tf", TFMessage(transforms=[self._frame(parent, child, pose)]))
        self._publish_odometry(odom_from_base)
        if self._n_steps % CAMERA_EVERY == 0:
            self._publish_scan(motion)
            self._publish_picture("camera")
            self._publish_picture("rear_camera")
            self._publish_plans(motion)
        self._n_steps += 1

    def _publish_odometry(self, odom_from_base: Pose) -> None:
        message = Odometry()
        message.header.stamp = self._now()
        message.header.frame_id, message.child_frame_id = "odom", "base_footprint"
        message.pose.pose = message_from_pose(odom_from_base)
        self._publish("odom", message)

    def _publish_scan(self, motion: Motion) -> None:
        message = LaserScan()
        message.header.stamp = self._now()
        message.header.frame_id = "base_footprint"
        message.angle_min = -math.pi
        message.angle_increment = 2.0 * math.pi / N_BEAMS
        message.angle_max = math.pi - message.angle_increment
        message.range_max = SCAN_RANGE_M
        message.ranges = motion.scan(n_beams=N_BEAMS, range_m=SCAN_RANGE_M)
        self._publish("scan", message)

    def _publish_picture(self, camera: str) -> None:
        """A picture with its left half red and its right half blue; its rows are padded."""
        row = b"\xff\x00\x00" * (WIDTH // 2) + b"\x00\x00\xff" * (WIDTH // 2) + bytes(PADDING_BYTES)
        image, info = Image(), CameraInfo()
        for message in (image, info):
            message.header.stamp = self._now()
            message.header.frame_id = f"{camera}_optical"
            message.width, message.height = WIDTH, HEIGHT
        image.encoding, image.step, image.data = "rgb8", len(row), array.array("B", row * HEIGHT)
        focal, cx, cy = FOCAL_LENGTH_PX, WIDTH / 2.0, HEIGHT / 2.0
        info.distortion_model = "plumb_bob"
        info.k = [focal, 0.0, cx, 0.0, focal, cy, 0.0, 0.0, 1.0]
        info.p = [focal, 0.0, cx, 0.0, 0.0, focal, cy, 0.0, 0.0, 0.0, 1.0, 0.0]
        self._publish(f"{camera}/image_raw", image)
        self._publish(f"{camera}/camera_info", info)

    def _publish_plans(self, motion: Motion) -> None:
        """A path of 2 m ahead, a square around the robot, and the map as a costmap."""
        path, square = Path(), PolygonStamped()
        for message in (path, square):
            message.header.stamp, message.header.frame_id = self._now(), "map"
        ways = (Pose(0.0, 0.0), Pose(2.0, 0.0))
        path.poses = [PoseStamped(pose=message_from_pose(motion.pose @ each)) for each in ways]
        at = motion.pose
        square.polygon.points = [
            Point32(x=at.x + x, y=at.y + y)
            for x, y in ((0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.2, -0.2))
        ]
        self._publish("plan", path)
        self._publish("local_costmap/published_footprint", square)
        self.publish_map(motion.grid, topic="local_costmap/costmap")

    # --- frames

    def _publish_static_frames(self) -> None:
        frames = [self._frame("base_footprint", "base_link", Pose(0.0, 0.0, 0.0))]
        for camera, turned in (("camera", 1.0), ("rear_camera", -1.0)):
            optical = self._frame("base_link", f"{camera}_optical", Pose(0.1, 0.0, 0.0))
            optical.transform.translation.z = 0.3
            rotation = optical.transform.rotation
            rotation.x, rotation.y, rotation.z, rotation.w = -0.5, 0.5 * turned, -0.5 * turned, 0.5
            frames.append(optical)
        self._publish("tf_static", TFMessage(transforms=frames))

    def _frame(self, parent: str, child: str, pose: Pose) -> Message:
        frame = TransformStamped()
        frame.header.stamp = self._now()
        frame.header.frame_id, frame.child_frame_id = parent, child
        place = message_from_pose(pose)
        frame.transform = Transform(rotation=place.orientation)
        frame.transform.translation.x = pose.x
        frame.transform.translation.y = pose.y
        return frame

    def _now(self) -> Message:
        return self._node.get_clock().now().to_msg()


def packed(cells: NDArray[np.int8]) -> "array.array[int]":
    """The cells as rclpy takes them fastest."""
    return array.array("b", np.ascontiguousarray(cells).tobytes())


def message_from_pose(pose: Pose) -> Message:
    message = PoseMessage()
    message.position.x, message.position.y = pose.x, pose.y
    message.orientation.z = math.sin(pose.yaw_rad / 2.0)
    message.orientation.w = math.cos(pose.yaw_rad / 2.0)
    return message


def pose_from_message(message: Message) -> Pose:
    yaw_rad = 2.0 * math.atan2(message.orientation.z, message.orientation.w)
    return Pose(message.position.x, message.position.y, yaw_rad)
