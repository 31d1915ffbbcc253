"""The one way to stop: it ends everything that was started, and says what it could not end."""

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros import RosConnection, Startable
from mapspeak.ros.robot.velocity import Brake


async def stop_everything(connection: RosConnection, *, brake: Brake) -> None:
    """End all goals of ours, and every drive; the brake was pulled before.

    Args:
        connection: To the robot; knows what was started over it.
        brake: Says where zero velocity is published.

    Raises:
        LinkError: Names all that could not be told, or goes on.
    """
    connection.started.n_stops += 1
    connection.clear_the_way()
    actions = list(connection.started.actions.values())
    faults: list[LinkError] = []

    async def try_to_end(action: Startable) -> None:
        try:
            await action.end()
        except LinkError as error:
            faults.append(error)

    async with anyio.create_task_group() as tasks:
        for action in actions:
            tasks.start_soon(try_to_end, action)
    if not (actions or await _is_heard(connection, brake)):
        raise LinkError(
            "Nobody could be told: no navigation is known, and nobody listens to velocities.",
            hint="Check that the robot runs, and in the ROS system that this server is in.",
        )
    if faults:
        said = dict.fromkeys(fault.message for fault in faults)
        raise LinkError(" ".join(said), hint=faults[0].hint) from faults[0]


async def _is_heard(connection: RosConnection, brake: Brake) -> bool:
    """Return whether anybody listens to zero velocity; True where the robot does not say."""
    for topic in brake.topics:
        try:
            if await connection.fetch_subscribers(topic):
                return True
        except LinkError:
            return True
    return False
