"""Asking a connected robot what it is."""

from dataclasses import replace

import anyio

from mapspeak.errors import LinkError
from mapspeak.links.ros.discovery.overrides import RobotOverrides
from mapspeak.links.ros.discovery.profile import RobotProfile, choose_profile
from mapspeak.links.ros.discovery.size import find_radius_m
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
    profile = choose_profile(graph, overrides, frames=frames.tree.frames)
    return await _with_radius(connection, profile, overrides)


async def look_at_robot(
    connection: RosConnection,
    frames: FrameListener,
    overrides: RobotOverrides,
    *,
    before: RobotProfile,
) -> RobotProfile:
    """Gives what the robot offers by now, waiting for no frames.

    Args:
        connection: To the robot.
        frames: Listens to its frames.
        overrides: What robot.yaml says.
        before: What it offered when it was last looked at.

    Raises:
        LinkError: rosapi is missing, and robot.yaml does not say which ROS it is.
    """
    graph = await _fetch_graph(connection, overrides)
    profile = choose_profile(graph, overrides, frames=frames.tree.frames)
    if before.radius_source:
        return replace(profile, radius_m=before.radius_m, radius_source=before.radius_source)
    return await _with_radius(connection, profile, overrides)


async def _with_radius(
    connection: RosConnection, profile: RobotProfile, overrides: RobotOverrides
) -> RobotProfile:
    if profile.radius_source:
        return profile
    found = await find_radius_m(connection, profile.dialect, namespace=overrides.namespace or "")
    if found is None:
        return profile
    radius_m, source = found
    return replace(profile, radius_m=radius_m, radius_source=source)


async def _fetch_graph(connection: RosConnection, overrides: RobotOverrides) -> RosGraph:
    said = {1: Dialect.ROS1, 2: Dialect.ROS2}.get(overrides.ros.version or 0)
    try:
        graph = await connection.fetch_graph()
    except LinkError:
        if said is None:
            raise
        return RosGraph(dialect=said)
    return graph if said is None else replace(graph, dialect=said)
