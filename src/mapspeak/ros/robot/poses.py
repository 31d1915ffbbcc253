"""The robot's pose estimate and its clock."""

import math
from dataclasses import replace

import anyio

from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.robot import StampedPose
from mapspeak.ros.activity import News, Subscription
from mapspeak.ros.discovery.profile import (
    POSE_WITH_COVARIANCE,
    PoseSource,
    RobotProfile,
)
from mapspeak.ros.messages.fields import Message, read_stamp
from mapspeak.ros.messages.poses import read_pose_stamped
from mapspeak.ros.port import RosConnection
from mapspeak.ros.transforms import FrameListener

FIRST_TICK_S = 1.0
"""A clock topic that stays silent for this time is left over from something else."""
ASK_AGAIN_S = 1.0
"""The node that tells the time may be found only after we have connected."""
OFF_S = 0.3
"""An answer may take as long: what differs less leaves the clock as it runs."""
STILL_S = 2.0
"""Wall time after which a simulated clock that has not moved on counts as still."""
EPSILON_S = 1e-6


class RobotClock:
    """Tells robot time, and waits for it."""

    def __init__(self, connection: RosConnection) -> None:
        self._connection = connection
        self._standstill_s = connection.patience.standstill_s
        self._again_s = connection.patience.clock_s
        self._offset_s: float | None = None
        self._simulated_s: float | None = None
        self._ticked_s = 0.0
        self._moved_on = News()

    @property
    def now_s(self) -> float:
        """Robot time."""
        if self._simulated_s is not None:
            return self._simulated_s
        return anyio.current_time() + (self._offset_s or 0.0)

    @property
    def is_set(self) -> bool:
        """True when the robot has told its time."""
        return self._simulated_s is not None or self._offset_s is not None

    @property
    def is_still(self) -> bool:
        """True while a simulation's clock does not move on."""
        return self._simulated_s is not None and anyio.current_time() - self._ticked_s > STILL_S

    async def start(self, clock_topic: str | None) -> None:
        """Set the clock by the robot's present time."""
        await self._ask_the_time()
        if clock_topic is not None:
            self._connection.subscribe(clock_topic).listen(self._take)
            with anyio.move_on_after(FIRST_TICK_S):
                await self._moved_on.wait()

    async def keep_set(self) -> None:
        """Ask until the robot has told its time, then now and then; for the background.

        Clocks drift apart, and a robot's is set when it finds a time server.
        """
        while True:
            await anyio.sleep(self._again_s if self.is_set else ASK_AGAIN_S)
            if self._simulated_s is None:
                await self._ask_the_time()

    async def sleep(self, duration_s: float) -> None:
        """Return when that much robot time has passed.

        Raises:
            LinkError: The simulation's clock stands still.
        """
        if self._simulated_s is None:
            await anyio.sleep(duration_s)
            return
        left_s, before_s = duration_s, self.now_s
        while left_s > EPSILON_S:
            await self._wait_for_tick()
            # A clock that was set back, by a simulation begun anew, has not run backwards.
            left_s -= max(self.now_s - before_s, 0.0)
            before_s = self.now_s

    async def _ask_the_time(self) -> None:
        try:
            robot_s = await self._connection.fetch_time_s()
        except LinkError:
            return
        if robot_s is None:
            return
        offset_s = robot_s - anyio.current_time()
        if self._offset_s is None or abs(offset_s - self._offset_s) > OFF_S:
            self._offset_s = offset_s

    async def _wait_for_tick(self) -> None:
        with anyio.move_on_after(self._standstill_s):
            await self._moved_on.wait()
            return
        raise LinkError(
            f"The robot's simulated clock has stood still for {self._standstill_s:g} s.",
            hint="Unpause the simulation, or check that /clock is still published.",
        )

    def _take(self, message: Message) -> None:
        stamp = message.get("clock")
        if not isinstance(stamp, dict):
            return
        before_s = self._simulated_s
        try:
            self._simulated_s = read_stamp(stamp)
        except LinkError:
            return
        if self._simulated_s == before_s:
            return
        self._ticked_s = anyio.current_time()
        self._moved_on.tell()


PATIENCE_S = 3.0


class PoseKeeper:
    """Tells the pose from the tree of frames, or from a topic where the tree does not reach."""

    def __init__(
        self, connection: RosConnection, profile: RobotProfile, frames: FrameListener
    ) -> None:
        self._connection = connection
        self._profile = profile
        self._frames = frames
        self._topic: Subscription | None = None
        if profile.pose_topic is not None:
            type_name = profile.dialect.type_name(profile.pose_type or POSE_WITH_COVARIANCE)
            self._topic = connection.subscribe(profile.pose_topic, type_name=type_name)

    def close(self) -> None:
        """End the subscription."""
        if self._topic is not None:
            self._connection.unsubscribe(self._topic)

    async def fetch(self) -> StampedPose:
        """Return the latest pose in the map frame; wait for the first.

        Raises:
            LinkError: The robot does not say where it is.
        """
        with anyio.move_on_after(PATIENCE_S):
            while True:
                try:
                    return self.latest
                except LinkError:
                    await self._wait_for_news()
        return self.latest

    @property
    def latest(self) -> StampedPose:
        """The latest pose in the map frame.

        Raises:
            LinkError: The robot has not said where it is.
        """
        if self._topic is None:
            return self._from_frames(self._profile.base_frame)
        if self._topic.latest is None:
            raise LinkError(
                f"No pose has come on {self._topic.topic}.",
                hint="Start localisation (AMCL, slam_toolbox), or name another pose_topic in "
                "robot.yaml.",
            )
        return self._from_topic(self._topic, self._topic.latest)

    def find_at(self, stamp_s: float) -> Pose:
        """Return where the robot was when something was measured, as far as the frames tell.

        Where a topic tells the pose on the map, it is the latest.

        Raises:
            LinkError: The robot has not said where it is.
        """
        if self._topic is not None:
            return self.latest.pose
        return self._from_frames(self._profile.base_frame, at_s=stamp_s).pose

    def _from_frames(self, frame: str, *, at_s: float = math.inf) -> StampedPose:
        tree = self._frames.tree
        found = tree.find(outer=self._profile.map_frame, inner=frame, at_s=at_s)
        silent_s = self._measure_silence(self._frames.arrived_s, what="transform")
        return replace(found, silent_s=silent_s)

    def _measure_silence(self, arrived_s: float | None, *, what: str) -> float:
        """Return the wall time since the source of the pose said anything new."""
        if arrived_s is None:
            return 0.0
        silent_s = max(anyio.current_time() - arrived_s, 0.0)
        if silent_s > self._connection.patience.pose_silence_s:
            raise LinkError(
                f"The robot's pose is old: no {what} has come for {silent_s:.0f} s.",
                hint="Check that SLAM or localisation and the robot's drivers still run, and that "
                "a simulation is not paused.",
            )
        return silent_s

    def _from_topic(self, topic: Subscription, message: Message) -> StampedPose:
        framed = read_pose_stamped(message)
        outer = self._profile.map_frame
        is_on_map = framed.frame_id in ("", outer)
        if not is_on_map and self._frames.has_way(outer=outer, inner=framed.frame_id):
            outer_from_frame = self._from_frames(framed.frame_id)
            return replace(
                outer_from_frame,
                pose=outer_from_frame.pose @ framed.pose,
                stamp_s=framed.stamp_s,
            )
        if self._profile.pose_source is PoseSource.ODOMETRY:
            # Odometry without a map has no other frame: it is taken for the map's.
            silent_s = self._measure_silence(topic.arrived_s, what="odometry")
            return StampedPose(framed.pose, framed.stamp_s, silent_s=silent_s, is_odometry=True)
        if not is_on_map:
            raise LinkError(
                f"The pose on {topic.topic} is in the frame {framed.frame_id[:80]!r}, and no "
                f"transforms lead from there to the map's, {outer!r}.",
                hint="Name another pose_topic or map_frame in robot.yaml, or publish transforms.",
            )
        # Localisation speaks when the robot has moved: its silence says nothing.
        return StampedPose(framed.pose, framed.stamp_s)

    async def _wait_for_news(self) -> None:
        if self._topic is None:
            await self._frames.news.wait()
        else:
            await self._topic.wait_for_more_than(self._topic.n_received, timeout_s=PATIENCE_S)
