"""The publications of the robot's nodes, taken from the port in time with its clock."""

import math
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from anyio.abc import TaskGroup

from mapspeak.errors import MapspeakError
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.robot import NavigationPart, RangeScan, Robot, RobotDescription, StampedPose
from mapspeak.ros.messages.fields import Dialect, write_header, write_stamp
from mapspeak.ros.messages.grids import write_grid
from mapspeak.ros.messages.poses import (
    FramedPose,
    FrameTransform,
    Twist,
    write_odometry,
    write_pose,
    write_pose_with_covariance,
    write_transforms,
)
from mapspeak.ros.messages.scans import LaserScan, write_camera_info, write_scan
from mapspeak.rosbridge_server.hub import Hub
from mapspeak.rosbridge_server.interfaces import BATTERY_TOPIC, write_battery
from mapspeak.rosbridge_server.navigation import BASE_FRAME
from mapspeak.skill import SkilledRobot
from mapspeak.spatial import OccupancyGrid

TICK_S = 0.05
"""Between two transforms."""
MAP_PERIOD_S = 1.0
ESTIMATE_PERIOD_S = 0.5
PICTURE_PERIOD_S = 0.2
SCAN_PERIOD_S = 0.1
BATTERY_PERIOD_S = 1.0
LASER_FRAME = "base_scan"
SCAN_TOPIC = "/scan"
NAVIGATION_PERIOD_S = 0.5
NAVIGATION_TOPICS = {
    Dialect.ROS1: {
        NavigationPart.PLAN: "/move_base/NavfnROS/plan",
        NavigationPart.FOOTPRINT: "/move_base/local_costmap/footprint",
    },
    Dialect.ROS2: {
        NavigationPart.PLAN: "/plan",
        NavigationPart.FOOTPRINT: "/local_costmap/published_footprint",
    },
}
N_BEAMS = 720


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraFace:
    """A camera as ROS has it: its node's name, its topics and its frame.

    Attributes:
        camera: Its name at the port; None for the one that looks ahead.
    """

    camera: str | None
    node: str

    @property
    def image_topic(self) -> str:
        """The topic of its pictures."""
        return f"/{self.node}/image_raw/compressed"

    @property
    def info_topic(self) -> str:
        """The topic of its measures."""
        return f"/{self.node}/camera_info"

    @property
    def frame(self) -> str:
        """Its frame."""
        return f"{self.node}_link"


def face_cameras(description: RobotDescription) -> tuple[CameraFace, ...]:
    """Return a robot's cameras; the one that looks ahead is /camera, as on common robots."""
    ahead, others = description.cameras[:1], description.cameras[1:]
    return (
        *(CameraFace(camera=None, node="camera") for _ in ahead),
        *(CameraFace(camera=name, node=f"{name}_camera") for name in others),
    )


@dataclass(slots=True)
class Pace:
    """The times of something that is done again and again, in robot time."""

    period_s: float
    _last_s: float = -math.inf

    def is_due(self, now_s: float) -> bool:
        """Return True once in a period, and at once when the clock was set back."""
        if self._last_s <= now_s < self._last_s + self.period_s:
            return False
        self._last_s = now_s
        return True


class Source:
    """Something published again and again; it may take longer than its period."""

    def __init__(self, produce: Callable[[], Awaitable[None]], period_s: float) -> None:
        self.produce = produce
        self.pace = Pace(period_s)
        self.is_busy = False


class Sources:
    """The robot's own publishers; all but maps only while a client listens."""

    def __init__(
        self, robot: Robot, hub: Hub, *, dialect: Dialect, skilled: SkilledRobot | None = None
    ) -> None:
        self._robot = robot
        self._skilled = skilled
        self._hub = hub
        self._dialect = dialect
        self._grid: OccupancyGrid | None = None
        self._last: StampedPose | None = None
        self._estimate_topic = "/amcl_pose" if dialect is Dialect.ROS1 else "/pose"
        self._estimates = Pace(ESTIMATE_PERIOD_S)
        self._looked: set[str] = set()
        self._fixed: list[FrameTransform] = []
        self._slow = [Source(self._publish_map, MAP_PERIOD_S)]
        self._cameras = face_cameras(robot.description)
        for camera in self._cameras:
            self._slow.append(Source(partial(self._publish_picture, camera), PICTURE_PERIOD_S))
        if robot.description.has_laser:
            self._slow.append(Source(self._publish_scan, SCAN_PERIOD_S))
        self._slow.append(Source(self._publish_navigation, NAVIGATION_PERIOD_S))
        if skilled is not None:
            self._slow.append(Source(self._publish_battery, BATTERY_PERIOD_S))

    async def start(self) -> None:
        """Publish the latched topics, so that the first client finds them."""
        self._fix("base_link", BASE_FRAME)
        for camera in self._cameras:
            if camera.camera is None:
                self._fix(camera.frame, "base_link")
        if self._robot.description.has_laser:
            self._fix(LASER_FRAME, "base_link")
        self._hub.publish("/tf_static", write_transforms(self._fixed, dialect=self._dialect))
        await self._attempt(self._publish_map)

    async def publish_due(self, tasks: TaskGroup) -> None:
        """Publish the topics that are due; slow ones run aside."""
        now_s = self._robot.now_s
        if self._hub.is_wanted("/clock"):
            self._hub.publish("/clock", {"clock": write_stamp(now_s, dialect=self._dialect)})
        if any(map(self._hub.is_wanted, ("/tf", "/odom", self._estimate_topic))):
            await self._attempt(self._publish_pose)
        for source in self._slow:
            if not source.is_busy and source.pace.is_due(now_s):
                source.is_busy = True
                tasks.start_soon(self._run_aside, source)

    async def _run_aside(self, source: Source) -> None:
        try:
            await self._attempt(source.produce)
        finally:
            source.is_busy = False

    async def _attempt(self, produce: Callable[[], Awaitable[None]]) -> None:
        try:
            await produce()
        except MapspeakError:
            return  # A robot that has no map or picture yet publishes none, as a real one.

    async def _publish_map(self) -> None:
        grid = await self._robot.fetch_map()
        if grid is self._grid or (self._grid is not None and _is_same(grid, self._grid)):
            return
        self._grid = grid
        message = write_grid(grid, dialect=self._dialect)
        self._hub.publish("/map", message)
        self._hub.publish("/map_metadata", message["info"])

    async def _publish_battery(self) -> None:
        ratio = None if self._skilled is None else await self._skilled.fetch_battery()
        if ratio is not None and self._hub.is_wanted(BATTERY_TOPIC):
            now_s = self._robot.now_s
            message = write_battery(ratio, now_s, dialect=self._dialect)
            self._hub.publish(BATTERY_TOPIC, message)

    def _fix(self, child: str, parent: str, turn_rad: float = 0.0) -> None:
        mounting = Pose(0.0, 0.0, turn_rad)
        self._fixed.append(
            FrameTransform(parent_from_child=mounting, parent=parent, child=child, stamp_s=0)
        )

    async def _publish_picture(self, face: CameraFace) -> None:
        is_wanted = self._hub.is_wanted(face.image_topic) or self._hub.is_wanted(face.info_topic)
        # The first picture takes long, which no client should have to wait for.
        if face.node in self._looked and not is_wanted:
            return
        here = await self._robot.fetch_pose()
        taken = await self._robot.fetch_picture(face.camera)
        if face.camera is None or here.pose == (await self._robot.fetch_pose()).pose:
            self._note_look(face, wrap_angle(taken.pose.yaw_rad - here.pose.yaw_rad))
        header = write_header(face.frame, taken.stamp_s, dialect=self._dialect)
        form = taken.media_type.removeprefix("image/")
        self._hub.publish(face.image_topic, {"header": header, "format": form, "data": taken.data})
        info = write_camera_info(
            header,
            width_px=taken.width_px,
            height_px=taken.height_px,
            horizontal_fov_rad=taken.horizontal_fov_rad,
            dialect=self._dialect,
        )
        self._hub.publish(face.info_topic, info)

    def _note_look(self, face: CameraFace, turn_rad: float) -> None:
        """Tell to which side a camera looks by its first picture: the port tells no frames."""
        if face.camera is not None and face.node not in self._looked:
            self._fix(face.frame, "base_link", turn_rad)
            self._hub.publish("/tf_static", write_transforms(self._fixed, dialect=self._dialect))
        self._looked.add(face.node)

    async def _publish_scan(self) -> None:
        if not self._hub.is_wanted(SCAN_TOPIC):
            return
        scan = await self._robot.fetch_scan()
        if scan is not None:
            self._hub.publish(SCAN_TOPIC, write_scan(_in_even_steps(scan), dialect=self._dialect))

    async def _publish_navigation(self) -> None:
        topics = NAVIGATION_TOPICS[self._dialect]
        if not any(map(self._hub.is_wanted, topics.values())):
            return
        for look in await self._robot.fetch_navigation():
            if look.part in topics and look.lines:
                message = self._write_line(look.part, look.lines[0])
                self._hub.publish(topics[look.part], message)

    def _write_line(self, part: NavigationPart, line: Sequence[Point]) -> dict[str, Any]:
        """Write nav_msgs/Path, or geometry_msgs/PolygonStamped of a ring, in the map."""
        header = write_header("map", self._robot.now_s, dialect=self._dialect)
        if part is NavigationPart.FOOTPRINT:
            corners = [{"x": at.x, "y": at.y, "z": 0.0} for at in line[:-1]]
            return {"header": header, "polygon": {"points": corners}}
        poses = [{"header": header, "pose": write_pose(Pose(at.x, at.y))} for at in line]
        return {"header": header, "poses": poses}

    async def _publish_pose(self) -> None:
        here = await self._robot.fetch_pose()
        # The port tells one pose, that of SLAM: odometry without drift, so that map and odom agree.
        for parent, child, pose in (("map", "odom", Pose(0, 0)), ("odom", BASE_FRAME, here.pose)):
            transform = FrameTransform(
                parent_from_child=pose, parent=parent, child=child, stamp_s=here.stamp_s
            )
            self._hub.publish("/tf", write_transforms([transform], dialect=self._dialect))
        in_odom = FramedPose(pose=here.pose, frame_id="odom", stamp_s=here.stamp_s)
        odometry = write_odometry(
            in_odom, self._velocity(here), child=BASE_FRAME, dialect=self._dialect
        )
        self._hub.publish("/odom", odometry)
        self._last = here
        if self._estimates.is_due(here.stamp_s):
            in_map = FramedPose(pose=here.pose, frame_id="map", stamp_s=here.stamp_s)
            estimate = write_pose_with_covariance(in_map, dialect=self._dialect)
            self._hub.publish(self._estimate_topic, estimate)

    def _velocity(self, here: StampedPose) -> Twist:
        """Return the velocity since the last pose, which is all that the port tells of it."""
        if self._last is None or not 0.0 < here.stamp_s - self._last.stamp_s < 1.0:
            return Twist(forward_mps=0.0, left_mps=0.0, turn_radps=0.0)
        passed_s = here.stamp_s - self._last.stamp_s
        step = self._last.pose.inverse() @ here.pose
        return Twist(
            forward_mps=step.x / passed_s,
            left_mps=step.y / passed_s,
            turn_radps=step.yaw_rad / passed_s,
        )


def _in_even_steps(scan: RangeScan) -> LaserScan:
    """Return a scan as its message has it: one beam to every half degree, from behind."""
    step_rad = math.tau / N_BEAMS
    ranges_m = np.full(N_BEAMS, np.nan)
    numbers = np.round((scan.angles_rad + math.pi) / step_rad).astype(np.intp) % N_BEAMS
    ranges_m[numbers] = scan.ranges_m
    return LaserScan(
        ranges_m=np.where(np.isfinite(ranges_m), ranges_m, np.nan),
        first_angle_rad=-math.pi,
        angle_step_rad=step_rad,
        least_range_m=0.0,
        largest_range_m=scan.reach_m,
        frame_id=LASER_FRAME,
        stamp_s=scan.stamp_s,
        met_nothing=np.isinf(ranges_m),
    )


def _is_same(one: OccupancyGrid, other: OccupancyGrid) -> bool:
    return (
        one.stamp_s == other.stamp_s
        and one.origin == other.origin
        and np.array_equal(one.cells, other.cells)
    )
