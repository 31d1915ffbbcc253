"""One look at what a connected robot is."""

from dataclasses import replace

import anyio

from mapspeak.errors import LinkError
from mapspeak.links.ros.discovery import ranking
from mapspeak.links.ros.discovery.liveness import Liveness
from mapspeak.links.ros.discovery.overrides import RobotOverrides
from mapspeak.links.ros.discovery.parts import PARTS, RADIUS
from mapspeak.links.ros.discovery.profile import RobotProfile, choose_profile
from mapspeak.links.ros.discovery.size import find_radius_m
from mapspeak.ros import RosConnection, RosGraph
from mapspeak.ros.messages import Dialect

MOST_ROUNDS = 8
"""Of asking who serves the best topics, and, where nobody does, choosing the next best."""
RADIUS_S = 3.0
"""For navigation to tell the radius, in wall time: one that hangs holds up nothing else."""


async def look_at_robot(
    connection: RosConnection, frames: frozenset[str], overrides: RobotOverrides
) -> tuple[RobotProfile, frozenset[str]]:
    """Return what the robot offers now, or what robot.yaml says, and all names that it lists.

    Args:
        connection: To the robot.
        frames: The coordinate frames that were heard of.
        overrides: What robot.yaml says.

    Raises:
        LinkError: rosapi is missing, and robot.yaml does not say which ROS it is.
    """
    graph = await _fetch_graph(connection, overrides)
    services = await _fetch_services(connection) if graph.types else None
    profile = await _choose_alive(connection, graph, overrides, frames, services)
    names = frozenset(graph.types) | frozenset(graph.actions) | (services or frozenset())
    if profile.radius_source or not graph.types:
        return profile, names
    with anyio.move_on_after(RADIUS_S):
        found = await find_radius_m(
            connection, profile.dialect, namespace=profile.namespace, services=services
        )
        if found is not None:
            profile = replace(profile, radius_m=found[0], radius_source=found[1])
    return profile, names


async def _choose_alive(
    connection: RosConnection,
    graph: RosGraph,
    overrides: RobotOverrides,
    frames: frozenset[str],
    services: frozenset[str] | None,
) -> RobotProfile:
    """Return the best of what somebody serves, then of what is there by name."""
    liveness = Liveness(connection)
    trees = ranking.find_namespaces(graph, frozenset())
    for namespace in trees if len(trees) > 1 else ():
        await liveness.ask(f"{namespace}/tf", is_heard=False)
    for _ in range(MOST_ROUNDS):
        before = liveness.dead
        profile = choose_profile(graph, overrides, frames=frames, dead=before, services=services)
        for part in PARTS if graph.types else ():
            topic = part.topic(profile)
            if topic is not None and part is not RADIUS and topic not in graph.actions:
                await liveness.ask(topic, is_heard=part.is_heard(profile))
        if liveness.dead == before:
            break
    profile = choose_profile(graph, overrides, frames=frames, dead=liveness.dead, services=services)
    used = {part.topic(profile) for part in PARTS}
    return replace(profile, dead_topics=frozenset(profile.dead_topics & used))


async def _fetch_graph(connection: RosConnection, overrides: RobotOverrides) -> RosGraph:
    said = {1: Dialect.ROS1, 2: Dialect.ROS2}.get(overrides.ros.version or 0)
    try:
        graph = await connection.fetch_graph()
    except LinkError:
        if said is None:
            raise
        return RosGraph(dialect=said)
    return graph if said is None else replace(graph, dialect=said)


async def _fetch_services(connection: RosConnection) -> frozenset[str] | None:
    try:
        return frozenset(await connection.fetch_services())
    except LinkError:
        return None
