"""The one way to stop: all that was started is ended, and zero velocity is sent until it stands."""

from collections.abc import Awaitable, Callable, Iterable
from contextlib import suppress
from functools import partial

import anyio

from mapspeak.errors import LinkError
from mapspeak.robot import StampedPose
from mapspeak.ros.discovery.profile import TWIST, TWIST_STAMPED, RobotProfile
from mapspeak.ros.messages.fields import LATEST_S, Message, write_header
from mapspeak.ros.messages.poses import Twist, write_twist
from mapspeak.ros.port import RosConnection, has_listeners

PAUSE_S = 0.05
N_AT_LEAST = 2
STANDING_S = 0.5
"""Time without a change of pose, by its own stamps, after which the robot stands."""
STANDING_M = 0.02
STANDING_RAD = 0.03
BLIND_S = 3.0
"""How long zero velocity is repeated where no pose tells whether the robot stands."""
LONGEST_S = 15.0
STAND = Twist(forward_mps=0.0, left_mps=0.0, turn_radps=0.0)


class Brake:
    """Publishes zero velocity; advertises it beforehand, so that the robot subscribes in time.

    Args:
        latest_pose: Returns the robot's latest pose; raises `LinkError` where it is unknown.
    """

    def __init__(
        self,
        connection: RosConnection,
        profile: RobotProfile,
        *,
        latest_pose: Callable[[], StampedPose],
    ) -> None:
        self._connection = connection
        self._profile = profile
        self._latest_pose = latest_pose
        if profile.velocity_topic is not None:
            type_name = profile.dialect.type_name(profile.velocity_type or TWIST)
            connection.advertise(profile.velocity_topic, type_name=type_name)

    @property
    def topics(self) -> tuple[str, ...]:
        """The topics for zero velocity: the robot's own, and those that we have published on."""
        return tuple(self._zeros())

    def pull(self) -> None:
        """Publish zero velocity at once, then until the robot stands or a new motion begins.

        Raises:
            LinkError: Nothing can be sent on one of the topics.
        """
        self._connection.start_soon(partial(self._repeat, self._connection.started.n_begun))
        self._publish()

    def _publish(self) -> None:
        faults: list[LinkError] = []
        for topic, zero in self._zeros().items():
            try:
                self._connection.publish_everywhere(topic, zero)
            except LinkError as error:
                faults.append(error)
        if faults:
            raise faults[0]

    async def _repeat(self, n_begun: int) -> None:
        """Publish again, since a message may be overtaken and a base may keep to the last."""
        standing = _Standing()
        begun_s = seen_s = anyio.current_time()
        n_sent = 0
        while self._connection.started.n_begun == n_begun:
            await anyio.sleep(PAUSE_S)
            now_s = anyio.current_time()
            with suppress(LinkError):
                self._publish()
                n_sent += 1
                if standing.take(self._latest_pose()):
                    seen_s = now_s
            is_known = n_sent >= N_AT_LEAST and standing.is_so
            if is_known or now_s - seen_s > BLIND_S or now_s - begun_s > LONGEST_S:
                return

    def _zeros(self) -> dict[str, Message]:
        zeros = dict(self._connection.started.velocities)
        if self._profile.velocity_topic is not None:
            zeros[self._profile.velocity_topic] = self._zero()
        return zeros

    def _zero(self) -> Message:
        if self._profile.velocity_type != TWIST_STAMPED:
            return write_twist(STAND)
        header = write_header(self._profile.base_frame, LATEST_S, dialect=self._profile.dialect)
        return {"header": header, "twist": write_twist(STAND)}


class _Standing:
    """Whether poses say that the robot stands.

    Attributes:
        is_so: True when the pose has not changed for long enough.
    """

    def __init__(self) -> None:
        self.is_so = False
        self._since: StampedPose | None = None
        self._latest_s = float("-inf")

    def take(self, stamped: StampedPose) -> bool:
        """Take a pose; return whether it is newer than those before."""
        is_new = stamped.stamp_s != self._latest_s
        self._latest_s = stamped.stamp_s
        since = self._since
        if (
            since is None
            or stamped.stamp_s < since.stamp_s
            or not since.pose.is_near(stamped.pose, off_m=STANDING_M, turn_rad=STANDING_RAD)
        ):
            self._since = stamped
        else:
            self.is_so = stamped.stamp_s - since.stamp_s >= STANDING_S
        return is_new


async def stop_everything(
    connection: RosConnection,
    ends: Iterable[Callable[[], Awaitable[bool]]],
    *,
    velocities: Callable[[], Iterable[str]],
) -> None:
    """End all that is under way at once; the brake was pulled before.

    Args:
        connection: The robot's.
        ends: Each ends some goals, and returns whether anybody was told; it may raise `LinkError`.
        velocities: Returns the topics for zero velocity.

    Raises:
        LinkError: Names all that could not be told, or goes on.
    """
    connection.started.n_stops += 1
    connection.clear_the_way()
    faults: list[LinkError] = []
    told: list[bool] = []

    async def attempt(end: Callable[[], Awaitable[bool]]) -> None:
        try:
            told.append(await end())
        except LinkError as error:
            faults.append(error)

    async with anyio.create_task_group() as tasks:
        for end in ends:
            tasks.start_soon(attempt, end)
    if faults:
        said = dict.fromkeys(fault.message for fault in faults)
        raise LinkError(" ".join(said), hint=faults[0].hint) from faults[0]
    if any(told):
        return
    for topic in velocities():
        if await has_listeners(connection, topic):
            return
    raise LinkError(
        "Nobody could be told: no navigation is there, and nobody listens to velocities.",
        hint="Check that the robot runs, and in the ROS system that this server is in.",
    )
