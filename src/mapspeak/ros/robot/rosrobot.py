"""The port implemented over any connection to ROS 1 or ROS 2."""

from collections import OrderedDict
from contextlib import suppress
from dataclasses import replace
from functools import partial

import anyio

from mapspeak.errors import GoalError, LinkError
from mapspeak.geometry import Pose, wrap_angle
from mapspeak.robot import (
    CameraPicture,
    Detection,
    GoalState,
    GoalStatus,
    NavigationLook,
    PoseDoubt,
    RangeScan,
    RobotDescription,
    StampedPose,
)
from mapspeak.ros.discovery.overrides import RobotOverrides
from mapspeak.ros.discovery.profile import NavigationKind, RobotPart, RobotProfile
from mapspeak.ros.discovery.watch import RobotWatch
from mapspeak.ros.port import RosConnection
from mapspeak.ros.robot.driving import (
    MOVE_BASE,
    NAV2,
    ActionDriver,
    GoalRecord,
    GoalTopicDriver,
)
from mapspeak.ros.robot.maps import MapSubscriber
from mapspeak.ros.robot.plans import NavigationListener
from mapspeak.ros.robot.poses import PoseKeeper, RobotClock
from mapspeak.ros.robot.sensors import Laser, RosCamera, find_camera_yaw_rad, no_camera
from mapspeak.ros.robot.stopping import Brake, stop_everything
from mapspeak.ros.transforms import FrameListener
from mapspeak.spatial import OccupancyGrid

MOST_GOALS_KEPT = 1_000
NOTHING_SAID = RobotOverrides()


class RosRobot:
    """A `Robot` that speaks ROS."""

    def __init__(
        self,
        connection: RosConnection,
        watch: RobotWatch,
        *,
        frames: FrameListener,
        clock: RobotClock,
    ) -> None:
        self.connection = connection
        self._watch = watch
        self._frames = frames
        self._clock = clock
        self._goals: OrderedDict[str, GoalRecord] = OrderedDict()
        self._n_sending = 0
        profile = watch.profile
        self._maps = MapSubscriber(connection, profile)
        self._cameras: dict[str, RosCamera] = {}
        self._laser = Laser(connection, profile, frames=frames, clock=clock)
        self._poses = PoseKeeper(connection, profile, frames)
        self._navigation = NavigationListener(connection, lambda: self.profile, frames, clock)
        self._brake = self._build_brake()
        self._driver = self._build_driver()
        watch.is_driving = self._is_driving
        watch.on_change = self._take_change

    @property
    def profile(self) -> RobotProfile:
        """The robot's interfaces, as far as they have been found."""
        return self._watch.profile

    @property
    def description(self) -> RobotDescription:
        """The fixed properties of this robot."""
        return RobotDescription(
            name=self.profile.name,
            radius_m=self.profile.radius_m,
            map_name=self.profile.map_name,
            cameras=self._name_cameras(),
            has_laser=RobotPart.LASER.is_alive(self.profile),
            detector=None,
            map_frame=self.profile.map_frame,
            is_radius_assumed=not self.profile.radius_source,
        )

    @property
    def map_age_s(self) -> float | None:
        """Since the stamp of the latest map; None where that is not known."""
        stamp_s = self._maps.stamp_s
        if stamp_s is None or not self._clock.is_set:
            return None
        return max(self.now_s - stamp_s, 0.0)

    @property
    def now_s(self) -> float:
        """Robot time: that of /clock in a simulation, else of the robot's own clock."""
        return self._clock.now_s

    async def sleep(self, duration_s: float) -> None:
        """Return when that much robot time has passed."""
        await self._clock.sleep(duration_s)

    async def fetch_map(self) -> OccupancyGrid:
        """Return the latest map; the same value as long as it has not changed."""
        await self.connection.wait_until_connected()
        await self._watch.find(RobotPart.MAP)
        # Where the robot fits on it depends on that.
        await self._watch.wait_for(RobotPart.RADIUS)
        return await self._maps.fetch()

    async def fetch_pose(self) -> StampedPose:
        """Return where the robot believes it is; see the profile for how it is known."""
        await self.connection.wait_until_connected()
        await self._watch.wait_for(RobotPart.POSE)
        return await self._find_pose()

    async def fetch_picture(self, camera: str | None = None) -> CameraPicture:
        """Take a picture with a camera, of which the frames say to which side it looks."""
        await self.connection.wait_until_connected()
        eye = await self._find_camera(camera)
        picture = await eye.fetch()
        doubt = (await self._find_pose()).find_doubt(self.now_s)
        here = self._poses.find_at(picture.stamp_s)
        try:
            yaw_rad = find_camera_yaw_rad(
                self._frames.tree, base=self.profile.base_frame, camera=picture.frame_id
            )
        except LinkError:
            # Robots whose frames do not say have their main camera in front.
            yaw_rad, ahead = 0.0, self.profile.cameras[0].name
            is_ahead = eye is self._cameras.get(ahead)
            doubt = doubt if is_ahead else PoseDoubt.CAMERA_TURN
        return CameraPicture(
            data=picture.data,
            media_type=picture.media_type,
            width_px=picture.width_px,
            height_px=picture.height_px,
            horizontal_fov_rad=await eye.fetch_fov_rad(),
            pose=Pose(here.x, here.y, wrap_angle(here.yaw_rad + yaw_rad)),
            stamp_s=picture.stamp_s,
            pose_doubt=doubt,
        )

    async def fetch_detections(self) -> tuple[Detection, ...]:
        """Return nothing: no message for detections is common to robots."""
        return ()

    async def fetch_scan(self) -> RangeScan | None:
        """Return a scan of the laser that arrives after it was asked for; None where none does."""
        return await self._laser.fetch(self._poses)

    async def fetch_navigation(self) -> tuple[NavigationLook, ...]:
        """Return what Nav2 or move_base publishes of path, footprint and costmaps."""
        await self.connection.wait_until_connected()
        return await self._navigation.fetch()

    async def send_goal(self, goal: Pose) -> str:
        """Start a drive; return when navigation has taken or refused it."""
        await self.connection.wait_until_connected()
        await self._watch.find(RobotPart.NAVIGATION)
        # A drive may need a stop before long.
        self.connection.advertise_early()
        self._n_sending += 1
        try:
            record = await self._wanted_driver().send(goal)
        finally:
            self._n_sending -= 1
        self._goals[record.goal_id] = record
        while len(self._goals) > MOST_GOALS_KEPT:
            self._goals.popitem(last=False)
        return record.goal_id

    async def fetch_goal_status(self, robot_goal_id: str) -> GoalStatus:
        """Return the state of a drive, also long after its end and after a reconnection."""
        record = self._record(robot_goal_id)
        if not record.is_over:
            await self.connection.wait_until_connected()
            await self._wanted_driver().look_at(record)
        return record.status

    async def fetch_foreign_goals(self) -> tuple[GoalState, ...]:
        """Return how goals stand that other clients have sent, as far as navigation tells."""
        await self._watch.wait_for(RobotPart.NAVIGATION)
        return () if self._driver is None else await self._driver.fetch_foreign_goals()

    async def cancel_goal(self, robot_goal_id: str) -> None:
        """Ask navigation to end a drive, and wait a moment until it has."""
        record = self._record(robot_goal_id)
        if not record.is_over:
            await self.connection.wait_until_connected()
            await self._wanted_driver().cancel(record)

    async def stop(self) -> None:
        """End all that we have started, and every drive of others; commands zero velocity.

        Raises:
            LinkError: Names the parts that could not be told to stop, or go on.
        """
        if not self.connection.is_open:
            await self.connection.wait_until_connected()
        ends = [action.end for action in self.connection.started.actions.values()]
        if self._driver is None:
            ends.append(self._end_foreign_goals)
        try:
            self._brake.pull()
        finally:
            await stop_everything(self.connection, ends, velocities=lambda: self._brake.topics)

    async def settle(self) -> None:
        """Return when all that the robot offers counts as found."""
        await self._watch.settle()

    async def _end_foreign_goals(self) -> bool:
        """End goals that others have sent to a navigation which we have not found yet."""
        brake = self._brake
        with anyio.move_on_after(self.connection.patience.answer_s), suppress(LinkError):
            await self._watch.look()
        if self._brake is not brake:
            self._brake.pull()
        found = self.connection.started.actions.get(self.profile.navigation_name or "")
        return False if found is None else await found.end()

    def _name_cameras(self) -> tuple[str, ...]:
        is_alive = RobotPart.CAMERA.is_alive(self.profile)
        return tuple(camera.name for camera in self.profile.cameras) if is_alive else ()

    async def _find_camera(self, said: str | None) -> RosCamera:
        """Return a camera by its name, or the one that looks ahead."""
        await self._watch.find(RobotPart.CAMERA)
        topics = next(iter(self.profile.cameras), None)
        if said is not None:
            if said not in self._name_cameras():
                # It may have been started since.
                await self._watch.look()
            name = self.description.find_camera(said)
            topics = next(each for each in self.profile.cameras if each.name == name)
        if topics is None:
            raise no_camera()
        if topics.name not in self._cameras:
            self._cameras[topics.name] = RosCamera(self.connection, self.profile, topics)
        return self._cameras[topics.name]

    async def _find_pose(self) -> StampedPose:
        return replace(await self._poses.fetch(), is_clock_still=self._clock.is_still)

    def _is_driving(self) -> bool:
        is_under_way = any(not record.is_over for record in self._goals.values())
        return is_under_way or self._n_sending > 0

    def _take_change(self, before: RobotProfile) -> None:
        """Use the newly found parts; keep those that have stayed the same."""
        now = self.profile

        def is_new(part: RobotPart) -> bool:
            return part.values(before) != part.values(now)

        if is_new(RobotPart.MAP):
            self._maps.close()
            self._maps = MapSubscriber(self.connection, now)
        if is_new(RobotPart.CAMERA):
            self._cameras = {}
        if is_new(RobotPart.LASER) or is_new(RobotPart.POSE):
            self._laser = Laser(self.connection, now, frames=self._frames, clock=self._clock)
        if is_new(RobotPart.POSE):
            self._poses.close()
            self._poses = PoseKeeper(self.connection, now, self._frames)
        if is_new(RobotPart.VELOCITY):
            self._brake = self._build_brake()
        if is_new(RobotPart.NAVIGATION):
            self._driver = self._build_driver()
        if now.clock_topic != before.clock_topic:
            self.connection.start_soon(partial(self._clock.start, now.clock_topic))

    def _build_brake(self) -> Brake:
        return Brake(self.connection, self.profile, latest_pose=lambda: self._poses.latest)

    def _build_driver(self) -> ActionDriver | GoalTopicDriver | None:
        profile, name = self.profile, self.profile.navigation_name
        if name is None:
            return None
        match profile.navigation:
            case NavigationKind.NAV2 | NavigationKind.MOVE_BASE:
                return ActionDriver(
                    self.connection,
                    name,
                    NAV2 if profile.navigation is NavigationKind.NAV2 else MOVE_BASE,
                    map_frame=lambda: self.profile.map_frame,
                    now_s=lambda: self.now_s,
                    # Some bases keep the last velocity when their driver has gone.
                    on_lost=lambda: self._brake.pull(),  # noqa: PLW0108 - of then
                )
            case NavigationKind.GOAL_TOPIC:
                return GoalTopicDriver(
                    self.connection,
                    name,
                    profile=lambda: self.profile,
                    fetch_pose=self.fetch_pose,
                    now_s=lambda: self.now_s,
                )
            case NavigationKind.NONE:
                return None

    def _wanted_driver(self) -> ActionDriver | GoalTopicDriver:
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


async def build_ros_robot(
    connection: RosConnection, *, overrides: RobotOverrides = NOTHING_SAID
) -> RosRobot:
    """Return the robot at the other end of a connection, once its interfaces are found."""
    # The caller decides later whether to drive the robot or only watch it.
    connection.advertise_late()
    frames = FrameListener(connection)
    clock = RobotClock(connection)
    watch = RobotWatch(connection, frames, overrides)
    await watch.begin()
    await clock.start(watch.profile.clock_topic)
    robot = RosRobot(connection, watch, frames=frames, clock=clock)
    connection.start_soon(watch.run)
    connection.start_soon(clock.keep_set)
    return robot
