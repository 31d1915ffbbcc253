"""Everything the ROS tools change on the robot, through one door."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros import RosConnection
from mapspeak.ros.messages import Message
from mapspeak.safety import (
    Act,
    Call,
    GuardedConnection,
    Publish,
    SetParameter,
    zero_velocity_of,
)

SETTLE_S = 0.3
"""From the first advertisement until the robot's nodes hear what is published, in wall time."""
LONGEST_SETTLE_S = 1.0
"""So much longer where the robot, under load, does not know yet that anybody publishes."""
LOOK_S = 0.1
N_STANDS = 3
PAUSE_S = 0.05
STAND_S = 1.0
VELOCITIES = frozenset(
    {
        "geometry_msgs/Twist",
        "geometry_msgs/TwistStamped",
        "ackermann_msgs/AckermannDrive",
        "ackermann_msgs/AckermannDriveStamped",
    }
)
"""Types on which a robot goes on until it is told otherwise, or its driver loses patience."""


class RosCommands:
    """Publishes, calls, sends goals and sets parameters: by the methods of the port alone.

    Args:
        connection: Gives the connection, which may be guarded.
    """

    def __init__(self, connection: Callable[[], RosConnection]) -> None:
        self._connection = connection
        self._advertised: set[tuple[str, str]] = set()

    def check_name(self, command: Publish | Call | Act | SetParameter) -> None:
        """Returns when a command is not denied for its name: said before anything else is checked.

        Raises:
            PolicyError: It is.
        """
        connection = self._connection()
        if isinstance(connection, GuardedConnection):
            connection.check_name(command)

    async def prepare(self, topic: str, type_name: str) -> None:
        """Advertises a topic, and waits until the robot has noticed.

        It stays advertised: the robot's brake may use the same topic.
        """
        self._connection().advertise(topic, type_name=type_name)
        if (topic, type_name) not in self._advertised:
            await anyio.sleep(SETTLE_S)
            await self._wait_until_known(topic)
            self._advertised.add((topic, type_name))

    async def _wait_until_known(self, topic: str) -> None:
        """Returns when the robot knows somebody who publishes, or cannot say, or after a while."""
        with suppress(LinkError), anyio.move_on_after(LONGEST_SETTLE_S):
            fetch = self._connection().fetch_publishers
            while not await fetch(topic):  # noqa: ASYNC110 - it happens in other programs
                await anyio.sleep(LOOK_S)

    async def publish(self, topic: str, message: Message) -> None:
        """Publishes one message on a topic that was prepared."""
        await self._connection().publish(topic, message)

    async def publish_at_once(self, topic: str, message: Message) -> None:
        """Publishes one message on a topic that was prepared, now or not at all.

        Raises:
            LinkError: There is no connection.
        """
        connection = self._connection()
        if connection.lost_for_s is not None:
            raise LinkError(
                f"Nothing can be sent on {topic}: there is no connection.",
                hint="Try again: the connection is made anew by itself.",
            )
        await connection.publish(topic, message)

    def note_velocity(self, topic: str, message: Message) -> None:
        """Let every stop from now on publish zero velocity on a topic too."""
        self._connection().started.note_velocity(topic, zero=zero_velocity_of(message))

    async def stand(self, topic: str, message: Message) -> bool:
        """Publishes the stand for a velocity, whatever happens to the call that moved the robot.

        Where the connection is lost it is waited for a moment. Gives whether a stand was sent.
        """
        zero = zero_velocity_of(message)
        n_sent = 0
        with anyio.CancelScope(shield=True), anyio.move_on_after(STAND_S):
            while n_sent < N_STANDS:
                if self._connection().publish_everywhere(topic, zero):
                    n_sent += 1
                await anyio.sleep(PAUSE_S)
        return n_sent > 0

    async def call(
        self, service: str, arguments: Mapping[str, Any], *, type_name: str, timeout_s: float
    ) -> dict[str, Any]:
        """Gives what a service answers."""
        return await self._connection().call_service(
            service, arguments, type_name=type_name, timeout_s=timeout_s
        )

    async def set_parameter(
        self,
        node: str,
        name: str,
        value: Any,  # noqa: ANN401 - any value ROS has
    ) -> None:
        """Sets a node's parameter."""
        await self._connection().set_parameter(node, name, value)
