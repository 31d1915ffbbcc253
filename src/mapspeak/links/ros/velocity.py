"""Commanding a stand: zero velocity, over every socket there is."""

from functools import partial

import anyio

from mapspeak.links.ros.discovery import RobotProfile
from mapspeak.links.ros.discovery.profile import TWIST, TWIST_STAMPED
from mapspeak.links.ros.driving.driver import LATEST_S
from mapspeak.ros import RosConnection
from mapspeak.ros.messages import Message, Twist, write_header, write_twist

N_REPEATS = 2
PAUSE_S = 0.05
STAND = Twist(forward_mps=0.0, left_mps=0.0, turn_radps=0.0)


class Brake:
    """Publishes zero velocity; says beforehand that it will, so that the robot listens in time.

    Args:
        connection: Connected to the robot.
        profile: Says which topic.
    """

    def __init__(self, connection: RosConnection, profile: RobotProfile) -> None:
        self._connection = connection
        self._profile = profile
        if profile.velocity_topic is not None:
            type_name = profile.dialect.type_name(profile.velocity_type or TWIST)
            connection.advertise(profile.velocity_topic, type_name=type_name)

    def pull(self) -> None:
        """Commands a stand at once, and again soon: a message may be overtaken by another."""
        if self._profile.velocity_topic is not None:
            stand = self._stand()
            self._connection.publish_everywhere(self._profile.velocity_topic, stand)
            self._connection.start_soon(partial(self._repeat, self._profile.velocity_topic, stand))

    async def _repeat(self, topic: str, stand: Message) -> None:
        for _ in range(N_REPEATS):
            await anyio.sleep(PAUSE_S)
            self._connection.publish_everywhere(topic, stand)

    def _stand(self) -> Message:
        if self._profile.velocity_type != TWIST_STAMPED:
            return write_twist(STAND)
        header = write_header(self._profile.base_frame, LATEST_S, dialect=self._profile.dialect)
        return {"header": header, "twist": write_twist(STAND)}
