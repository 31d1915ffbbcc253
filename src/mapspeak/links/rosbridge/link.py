"""The port implemented over rosbridge, for ROS 1 and ROS 2."""

from collections import OrderedDict
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager, suppress

import anyio

from mapspeak.errors import GoalError, LinkError
from mapspeak.geometry import Pose
from mapspeak.links.rosbridge.camera import Camera
from mapspeak.links.rosbridge.client import RobotAddress, RosbridgeClient, Timing, open_client
from mapspeak.links.rosbridge.clock import RobotClock
from mapspeak.links.rosbridge.discovery import (
    NavigationKind,
    PoseSource,
    RobotOverrides,
    RobotProfile,
    discover_robot,
    look_at_robot,
)
from mapspeak.links.rosbridge.driving import (
    Driver,
    DrivingPatience,
    GoalRecord,
    GoalTopicDriver,
    MoveBaseDriver,
    Nav2Driver,
)
from mapspeak.links.rosbridge.frames import FrameListener
from mapspeak.links.rosbridge.maps import MapKeeper
from mapspeak.links.rosbridge.poses import PoseKeeper
from mapspeak.links.rosbridge.velocity import Brake
from mapspeak.robot import (
    CameraPicture,
    Detection,
    GoalStatus,
    RobotDescription,
    StampedPose,
)
from mapspeak.spatial import OccupancyGrid

MOST_GOALS_KEPT = 1_000
LOOK_AGAIN_S = 5.0
"""Between two looks for a better source of the pose while no new frames appear, in wall time."""
USUAL_TIMING = Timing()
USUAL_PATIENCE = DrivingPatience()
NOTHING_SAID = RobotOverrides()


class RosbridgeRobot:
    """A `Robot` behind a rosbridge server.

    Args:
        client: Connected to the robot.
        profile: What the robot offers.
        frames: Listens to its coordinate frames.
        clock: Tells its time.
        overrides: What robot.yaml says, for what is found only later.
        patience: How long to wait for its navigation.
    """

    def __init__(
        self,
        client: RosbridgeClient,
        profile: RobotProfile,
        *,
        frames: FrameListener,
        clock: RobotClock,
        overrides: RobotOverrides = NOTHING_SAID,
        patience: DrivingPatience = USUAL_PATIENCE,
    ) -> None:
        self.profile = profile
        self.client = client
        self._frames = frames
        self._clock = clock
        self._overrides = overrides
        self._patience = patience
        self._looked_s = float("-inf")
        self._frames_looked_at = frames.tree.frames
        self._goals: OrderedDict[str, GoalRecord] = OrderedDict()
        self._maps = MapKeeper(client, profile)
        self._camera = self._build_camera()
        self._poses = PoseKeeper(client, profile, frames)
        self._brake = Brake(client, profile)
        self._driver = self._build_driver()

    @property
    def description(self) -> RobotDescription:
        """What is fixed about this robot."""
        return RobotDescription(
            name=self.profile.name,
            radius_m=self.profile.radius_m,
            map_name=self.profile.map_name,
            has_camera=self.profile.camera_topic is not None,
            detector=None,
        )

    @property
    def now_s(self) -> float:
        """Robot time: that of /clock in a simulation, else of the robot's own clock."""
        return self._clock.now_s

    async def sleep(self, duration_s: float) -> None:
        """Returns when that much robot time has passed."""
        await self._clock.sleep(duration_s)

    async def fetch_map(self) -> OccupancyGrid:
        """Gives the latest map; the same value as long as it has not changed."""
        await self.client.wait_until_connected()
        if self.profile.map_topic is None:
            await self._look_again()
        return await self._maps.fetch()

    async def fetch_pose(self) -> StampedPose:
        """Gives where the robot believes it is; see the profile for how it is known."""
        await self.client.wait_until_connected()
        if self.profile.pose_source in (PoseSource.ODOMETRY, PoseSource.NONE):
            await self._look_for_better_pose()
        return await self._poses.fetch()

    async def fetch_picture(self) -> CameraPicture:
        """Takes a picture with the front camera."""
        await self.client.wait_until_connected()
        if self.profile.camera_topic is None:
            await self._look_again()
        picture = await self._camera.fetch()
        return CameraPicture(
            data=picture.data,
            media_type=picture.media_type,
            width_px=picture.width_px,
            height_px=picture.height_px,
            horizontal_fov_rad=await self._camera.fetch_fov_rad(),
            pose=(await self._poses.fetch()).pose,
            stamp_s=picture.stamp_s,
        )

    async def fetch_detections(self) -> tuple[Detection, ...]:
        """Gives nothing: no message for detections is common to robots."""
        return ()

    async def send_goal(self, goal: Pose) -> str:
        """Starts a drive; returns when navigation has taken or refused it."""
        await self.client.wait_until_connected()
        if self._driver is None:
            await self._look_again()
        record = await self._wanted_driver().send(goal)
        self._goals[record.goal_id] = record
        while len(self._goals) > MOST_GOALS_KEPT:
            self._goals.popitem(last=False)
        return record.goal_id

    async def fetch_goal_status(self, robot_goal_id: str) -> GoalStatus:
        """Gives how a drive stands, also long after its end and after a reconnection."""
        record = self._record(robot_goal_id)
        if not record.is_over:
            await self.client.wait_until_connected()
            await self._wanted_driver().look_at(record)
        return record.status

    async def cancel_goal(self, robot_goal_id: str) -> None:
        """Asks navigation to end a drive, and waits a moment until it has."""
        record = self._record(robot_goal_id)
        if not record.is_over:
            await self.client.wait_until_connected()
            await self._wanted_driver().cancel(record)

    async def stop(self) -> None:
        """Ends every drive, those of other clients too, and commands zero velocity."""
        if not self.client.has_open_socket:
            await self.client.wait_until_connected()
        self._brake.pull()
        if self._driver is not None:
            await self._driver.cancel_all()

    async def _look_again(self) -> None:
        """Takes in what has been started since: people start rosbridge first and SLAM later."""
        before = self.profile
        self.profile = await look_at_robot(self.client, self._frames, self._overrides)
        if self.profile == before:
            return
        if before.map_topic is None:
            self._maps = MapKeeper(self.client, self.profile)
        if before.camera_topic is None:
            self._camera = self._build_camera()
        if before.velocity_topic is None:
            self._brake = Brake(self.client, self.profile)
        if self._driver is None:
            self._driver = self._build_driver()
        if before.pose_source is not self.profile.pose_source:
            self._poses = PoseKeeper(self.client, self.profile, self._frames)

    async def _look_for_better_pose(self) -> None:
        frames, now_s = self._frames.tree.frames, anyio.current_time()
        if frames != self._frames_looked_at or now_s - self._looked_s > LOOK_AGAIN_S:
            self._frames_looked_at, self._looked_s = frames, now_s
            # What is there goes on being used where nothing better can be found.
            with suppress(LinkError):
                await self._look_again()

    def _build_camera(self) -> Camera:
        camera = Camera(self.client, self.profile)
        self.client.start_soon(camera.close_when_idle)
        return camera

    def _build_driver(self) -> Driver | None:
        profile, name = self.profile, self.profile.navigation_name
        if name is None:
            return None
        match profile.navigation:
            case NavigationKind.NAV2:
                return Nav2Driver(
                    self.client,
                    name,
                    map_frame=profile.map_frame,
                    patience=self._patience,
                )
            case NavigationKind.MOVE_BASE:
                return MoveBaseDriver(
                    self.client,
                    name,
                    map_frame=profile.map_frame,
                    patience=self._patience,
                )
            case NavigationKind.GOAL_TOPIC:
                return GoalTopicDriver(
                    self.client,
                    name,
                    dialect=profile.dialect,
                    map_frame=profile.map_frame,
                    fetch_pose=self.fetch_pose,
                    now_s=lambda: self.now_s,
                )
            case NavigationKind.NONE:
                return None

    def _wanted_driver(self) -> Driver:
        if self._driver is None:
            raise LinkError(
                "The robot offers no navigation.",
                hint="Start Nav2 (ROS 1: move_base) on the robot, or name `navigation` and "
                "`navigation_name` in robot.yaml.",
            )
        return self._driver

    def _record(self, robot_goal_id: str) -> GoalRecord:
        record = self._goals.get(robot_goal_id)
        if record is None:
            raise GoalError(
                f"No goal with the id {robot_goal_id[:80]!r} was sent over this link.",
                hint="Use the id that sending the goal gave.",
            )
        return record


@asynccontextmanager
async def open_rosbridge_robot(
    url: str | RobotAddress,
    *,
    overrides: RobotOverrides = NOTHING_SAID,
    timing: Timing = USUAL_TIMING,
    patience: DrivingPatience = USUAL_PATIENCE,
) -> AsyncGenerator[RosbridgeRobot]:
    """Offers the robot behind a rosbridge server while the context lasts.

    Leaving the context does not stop the robot: call `stop` before, where that is wanted.

    Args:
        url: Such as ws://192.168.1.20:9090.
        overrides: What robot.yaml says.
        timing: Time limits of the connection.
        patience: Time limits of navigation.

    Raises:
        LinkError: The robot cannot be reached, or does not say what it offers.
        ConfigError: The address is none.
    """
    address = RobotAddress(url=url) if isinstance(url, str) else url
    async with open_client(address, timing=timing) as client:
        frames = FrameListener(client)
        clock = RobotClock(client)
        profile = await discover_robot(client, frames, overrides)
        await clock.start(profile.clock_topic)
        yield RosbridgeRobot(
            client, profile, frames=frames, clock=clock, overrides=overrides, patience=patience
        )
