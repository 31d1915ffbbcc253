"""Asking a connected robot what it is."""

from dataclasses import replace

import anyio

from mapspeak.errors import LinkError
from mapspeak.links.rosbridge.client import RosbridgeClient
from mapspeak.links.rosbridge.discovery.graph import RobotGraph, fetch_graph
from mapspeak.links.rosbridge.discovery.overrides import RobotOverrides
from mapspeak.links.rosbridge.discovery.profile import RobotProfile, choose_profile
from mapspeak.links.rosbridge.frames import FrameListener
from mapspeak.links.rosbridge.messages import Dialect


async def discover_robot(
    client: RosbridgeClient, frames: FrameListener, overrides: RobotOverrides
) -> RobotProfile:
    """Gives what the robot offers, or what robot.yaml says it does; waits for its frames.

    Raises:
        LinkError: rosapi is missing, and robot.yaml does not say which ROS it is.
    """
    graph = await _fetch_graph(client, overrides)
    profile = choose_profile(graph, overrides)
    frames.listen(*profile.tf_topics, dialect=profile.dialect)
    with anyio.move_on_after(client.timing.frames_s):
        while not frames.has_way(outer=profile.map_frame, inner=profile.base_frame):
            await frames.wait_for_news()
            profile = choose_profile(graph, overrides, frames=frames.tree.frames)
    return choose_profile(graph, overrides, frames=frames.tree.frames)


async def look_at_robot(
    client: RosbridgeClient, frames: FrameListener, overrides: RobotOverrides
) -> RobotProfile:
    """Gives what the robot offers by now, waiting for nothing but rosapi.

    Raises:
        LinkError: rosapi is missing, and robot.yaml does not say which ROS it is.
    """
    graph = await _fetch_graph(client, overrides)
    return choose_profile(graph, overrides, frames=frames.tree.frames)


async def _fetch_graph(client: RosbridgeClient, overrides: RobotOverrides) -> RobotGraph:
    said = {1: Dialect.ROS1, 2: Dialect.ROS2}.get(overrides.ros or 0)
    try:
        graph = await fetch_graph(client)
    except LinkError:
        if said is None:
            raise
        return RobotGraph(dialect=said)
    return graph if said is None else replace(graph, dialect=said)
