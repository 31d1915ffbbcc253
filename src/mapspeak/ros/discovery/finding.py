"""One look at what a connected robot is: who serves its topics, and how large it is."""

import json
import math
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import replace

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros import RosConnection, RosGraph
from mapspeak.ros.discovery import ranking
from mapspeak.ros.discovery.overrides import RobotOverrides
from mapspeak.ros.discovery.parts import PARTS, RADIUS
from mapspeak.ros.discovery.profile import RobotProfile, choose_profile
from mapspeak.ros.messages import Dialect


class Liveness:
    """Asks for the other end of topics, of each once.

    Attributes:
        dead: Topics without one. A topic of which the robot does not tell is not among them.
    """

    def __init__(self, connection: RosConnection) -> None:
        self._connection = connection
        self._asked: set[str] = set()
        self.dead: frozenset[str] = frozenset()

    async def ask(self, topic: str, *, is_heard: bool) -> None:
        """Find out whether others publish a topic, or listen to it.

        Args:
            topic: Its full name.
            is_heard: It is one that we publish, so that others are to listen.
        """
        if topic in self._asked:
            return
        self._asked.add(topic)
        connection, own = self._connection, self._connection.own_ends
        fetch = connection.fetch_subscribers if is_heard else connection.fetch_publishers
        # For us and other clients rosbridge listens to all sorts of topics, and serves none.
        is_own = own.node and (is_heard or topic in own.publishes)
        found = await _ask(fetch, topic)
        if found is None:
            return
        if not [node for node in found if not (is_own and node.endswith(f"/{own.node}"))]:
            self.dead |= {topic}


async def _ask(
    fetch: Callable[[str], Awaitable[tuple[str, ...]]], topic: str
) -> tuple[str, ...] | None:
    try:
        return await fetch(topic)
    except LinkError:
        return None


LEAST_RADIUS_M, LARGEST_RADIUS_M = 0.01, 10.0
COSTMAPS = {
    Dialect.ROS1: (("/move_base", "global_costmap/"), ("/move_base", "local_costmap/")),
    Dialect.ROS2: (
        ("/global_costmap/global_costmap", ""),
        ("/local_costmap/local_costmap", ""),
    ),
}
"""Nodes, and what stands before the names of their parameters."""


async def find_radius_m(
    connection: RosConnection,
    dialect: Dialect,
    *,
    namespace: str = "",
    services: frozenset[str] | None = None,
) -> tuple[float, str] | None:
    """Find the radius of the smallest circle around the robot, and which parameter says so.

    Navigation knows it as `footprint`, a polygon around the base, which counts where it is given,
    or as `robot_radius`. None where neither is to be had.

    Args:
        connection: To the robot.
        dialect: Which ROS: each keeps parameters in its own way.
        namespace: Where the robot's nodes are.
        services: Those that the robot lists; None where it does not. Nodes are known by them
            before they are by name.
    """
    for node, prefix in COSTMAPS[dialect]:
        full = f"{namespace}{node}"
        asked = f"{full}/get_parameters"
        if dialect is Dialect.ROS2 and services is not None and asked not in services:
            continue
        for name, read in (("footprint", _radius_of_outline), ("robot_radius", _plausible)):
            try:
                radius_m = read(await connection.fetch_parameter(full, f"{prefix}{name}"))
            except LinkError:
                # A robot whose navigation does not tell is used as one that has none.
                break
            if radius_m is not None:
                return radius_m, f"{full} {prefix}{name}"
    return None


def _radius_of_outline(outline: object) -> float | None:
    """Read "[[0.2, 0.1], [-0.2, 0.1], ...]", which ROS 2 keeps as a text and ROS 1 as lists."""
    if isinstance(outline, str):
        try:
            outline = json.loads(outline)
        except ValueError:
            return None
    distances_m = list(_distances(outline))
    return _plausible(max(distances_m)) if len(distances_m) > 2 else None


def _distances(outline: object) -> Iterator[float]:
    for corner in outline if isinstance(outline, list) else []:
        match corner:
            case [int() | float() as x, int() | float() as y]:
                yield math.hypot(x, y)


def _plausible(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if LEAST_RADIUS_M <= value <= LARGEST_RADIUS_M else None


MOST_ROUNDS = 8
"""Of asking who serves the best topics, and, where nobody does, choosing the next best."""
RADIUS_S = 3.0
"""For navigation to tell the radius, in wall time: one that hangs holds up nothing else."""


async def look_at_robot(
    connection: RosConnection, frames: frozenset[str], overrides: RobotOverrides
) -> tuple[RobotProfile, frozenset[str]]:
    """Return what the robot offers now, or what robot.yaml says, and all names that it lists.

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
