"""Asking a connected robot what it is."""

from dataclasses import replace

import anyio

from mapspeak.errors import LinkError
from mapspeak.links.ros.discovery.overrides import RobotOverrides
from mapspeak.links.ros.discovery.profile import RobotProfile, choose_profile
from mapspeak.links.ros.frames import FrameListener
from mapspeak.ros import RosConnection, RosGraph
from mapspeak.ros.messages import Dialect

FRAMES_S = 2.0


async def discover_robot(
    connection: RosConnection,
    frames: FrameListener,
    overrides: RobotOverrides,
    *,
    frames_s: float = FRAMES_S,
) -> RobotProfile:
    """Gives what the robot offers, or what robot.yaml says it does; waits for its frames.

    Args:
        connection: To the robot.
        frames: Listens to its frames.
        overrides: What robot.yaml says.
        frames_s: In wall time, for the robot's frames to lead from the map to its base; static ones
            come at once, moving ones many times a second.

    Raises:
        LinkError: rosapi is missing, and robot.yaml does not say which ROS it is.
    """
    graph = await _fetch_graph(connection, overrides)
    profile = choose_profile(graph, overrides)
    frames.listen(*profile.tf_topics, dialect=profile.dialect)
    with anyio.move_on_after(frames_s):
        while not frames.has_way(outer=profile.map_frame, inner=profile.base_frame):
            await frames.wait_for_news()
            profile = choose_profile(graph, overrides, frames=frames.tree.frames)
    return choose_profile(graph, overrides, frames=frames.tree.frames)


async def look_at_robot(
    connection: RosConnection, frames: FrameListener, overrides: RobotOverrides
) -> RobotProfile:
    """Gives what the robot offers by now, waiting for nothing but rosapi.

    Raises:
        LinkError: rosapi is missing, and robot.yaml does not say which ROS it is.
    """
    graph = await _fetch_graph(connection, overrides)
    return choose_profile(graph, overrides, frames=frames.tree.frames)


async def _fetch_graph(connection: RosConnection, overrides: RobotOverrides) -> RosGraph:
    said = {1: Dialect.ROS1, 2: Dialect.ROS2}.get(overrides.ros or 0)
    try:
        graph = await connection.fetch_graph()
    except LinkError:
        if said is None:
            raise
        return RosGraph(dialect=said)
    return graph if said is None else replace(graph, dialect=said)
