"""Repeated looks at a robot: its parts are found bit by bit."""

import json
import math
from collections.abc import Awaitable, Callable, Container
from contextlib import suppress
from dataclasses import replace

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros.discovery.overrides import RobotOverrides
from mapspeak.ros.discovery.profile import (
    RobotPart,
    RobotProfile,
    find_missing,
    improve,
)
from mapspeak.ros.discovery.topics import choose_profile, find_namespaces
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.port import RosConnection, RosGraph
from mapspeak.ros.transforms import FrameListener


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
        """Find out whether others publish a topic, or listen to it where that is for us to do."""
        if topic in self._asked:
            return
        self._asked.add(topic)
        connection, own = self._connection, self._connection.own_ends
        fetch = connection.fetch_subscribers if is_heard else connection.fetch_publishers
        # For us and other clients rosbridge listens to all sorts of topics, and serves none.
        is_own = own.node and (is_heard or topic in own.publishes)
        found = await _ask(fetch(topic))
        if found is None:
            return
        if not [node for node in found if not (is_own and node.endswith(f"/{own.node}"))]:
            self.dead |= {topic}

    async def ask_for_parts(self, profile: RobotProfile, *, actions: Container[str]) -> None:
        """Find it out about the topics of a profile; actions are served where they are listed."""
        for part in RobotPart:
            topic = part.topic(profile)
            if topic is not None and part is not RobotPart.RADIUS and topic not in actions:
                await self.ask(topic, is_heard=part.is_heard(profile))
        for camera in profile.cameras[1:]:
            await self.ask(camera.topic, is_heard=False)


async def _ask(question: Awaitable[tuple[str, ...]]) -> tuple[str, ...] | None:
    """Return an answer; None where the robot does not give it."""
    try:
        return await question
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
"""Nodes, and the prefixes of their parameters' names."""


async def find_radius_m(
    connection: RosConnection,
    dialect: Dialect,
    *,
    namespace: str = "",
    services: frozenset[str] | None = None,
) -> tuple[float, str] | None:
    """Find the radius of the smallest circle around the robot, and which parameter says so.

    Navigation knows it as `footprint`, a polygon around the base, which counts where it is given,
    or as `robot_radius`. None where neither is to be had. Nodes are known by the services that
    the robot lists before they are by name; None where it lists none.
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
    distances_m: list[float] = []
    for corner in outline if isinstance(outline, list) else []:
        match corner:
            case [int() | float() as x, int() | float() as y]:
                distances_m.append(math.hypot(x, y))
    return _plausible(max(distances_m)) if len(distances_m) > 2 else None


def _plausible(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if LEAST_RADIUS_M <= value <= LARGEST_RADIUS_M else None


MOST_ROUNDS = 8
"""Most rounds of checking that the best topics are served, and else choosing the next best."""
ANSWERS = 2
"""How many answers that do not come are waited for while the topics are asked for."""
RADIUS_S = 3.0
"""Longest wait for navigation to tell the radius, in wall time: a hanging one must not block."""


async def look_at_robot(
    connection: RosConnection, frames: frozenset[str], overrides: RobotOverrides
) -> tuple[RobotProfile, frozenset[str]]:
    """Return the robot's present profile, with robot.yaml's overrides, and all names that it lists.

    Raises:
        LinkError: rosapi is missing, and robot.yaml does not say which ROS it is.
    """
    graph = await _fetch_graph(connection, overrides)
    listed = await _ask(connection.fetch_services()) if graph.types else None
    services = None if listed is None else frozenset(listed)
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
    """Return the best of the served interfaces, then of those that exist by name."""
    liveness = Liveness(connection)
    trees = find_namespaces(graph, frozenset())
    # A robot that does not tell must not be waited for once for each topic.
    with anyio.move_on_after(ANSWERS * connection.patience.answer_s):
        for namespace in trees if len(trees) > 1 else ():
            await liveness.ask(f"{namespace}/tf", is_heard=False)
        for _ in range(MOST_ROUNDS if graph.types else 0):
            before = liveness.dead
            profile = choose_profile(
                graph, overrides, frames=frames, dead=before, services=services
            )
            await liveness.ask_for_parts(profile, actions=graph.actions)
            if liveness.dead == before:
                break
    profile = choose_profile(graph, overrides, frames=frames, dead=liveness.dead, services=services)
    used = {part.topic(profile) for part in RobotPart}
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


PAUSE_S, LATER_PAUSE_S, LONGEST_PAUSE_S = 0.3, 5.0, 30.0
"""Between two looks: at first, and when all that is there counts as found, ever longer."""
LONGEST_SETTLING_S = 20.0
"""Some robots' topics come and go all the time."""


class RobotWatch:
    """Looks at a robot until all its parts are known, and later for the missing ones.

    Nodes of ROS 2 are found one by one: some were seen after 4.6 s, and Fast DDS repeats lost
    messages after 3 s.

    Attributes:
        on_change: Called with the earlier profile when a better one is found.
        is_driving: Tells whether a drive of ours runs, so that the navigation must stay.
    """

    def __init__(
        self,
        connection: RosConnection,
        frames: FrameListener,
        overrides: RobotOverrides,
    ) -> None:
        self._connection = connection
        self._frames = frames
        self._overrides = overrides
        self._patience = connection.patience
        self._profile: RobotProfile | None = None
        self._begun_s = self._news_s = anyio.current_time()
        self._names: frozenset[str] = frozenset()
        self._frames_seen: frozenset[str] = frozenset()
        self._is_settled = False
        self.on_change: Callable[[RobotProfile], None] = lambda _: None
        self.is_driving: Callable[[], bool] = lambda: False

    @property
    def profile(self) -> RobotProfile:
        """The profile found so far."""
        if self._profile is None:
            raise LinkError("The robot has not been looked at yet.", hint="Try again in a moment.")
        return self._profile

    @property
    def missing(self) -> tuple[RobotPart, ...]:
        """The parts of which better may be found; robot.yaml's are good enough."""
        return tuple(part for part in find_missing(self.profile) if not self._is_said(part))

    @property
    def is_complete(self) -> bool:
        """True when nothing better is to be found."""
        return not self.missing and self._leads_to_base

    @property
    def is_settled(self) -> bool:
        """True when all that is there counts as found."""
        now_s = anyio.current_time()
        self._is_settled = (
            self._is_settled
            or now_s - self._news_s >= self._patience.settling_s
            or now_s - self._begun_s >= LONGEST_SETTLING_S
            or self.is_complete
        )
        return self._is_settled

    async def begin(self) -> None:
        """Look for the first time, and wait a moment for frames from the map to the base."""
        while self._profile is None:
            try:
                await self.look()
            except LinkError:
                # Right after connecting, the node that would tell may not be found itself.
                if anyio.current_time() - self._begun_s >= self._patience.settling_s:
                    raise
                await anyio.sleep(PAUSE_S)
        with anyio.move_on_after(self._patience.frames_s):
            while not self._leads_to_base:
                await self._wait_for_frames()
                await self.look()

    async def run(self) -> None:
        """Look again and again while something is missing; for the background."""
        pause_s = PAUSE_S
        while not self.is_complete:
            await anyio.sleep(PAUSE_S)
            with anyio.move_on_after(pause_s - PAUSE_S):
                await self._wait_for_frames()
            before = self._profile
            with suppress(LinkError):
                await self.look()
            if self.is_settled:
                longer_s = max(2 * pause_s, LATER_PAUSE_S)
                pause_s = LATER_PAUSE_S if before != self._profile else longer_s
                pause_s = min(pause_s, LONGEST_PAUSE_S)

    async def find(self, part: RobotPart) -> None:
        """Return when a part is found; look once more for one that counts as missing."""
        await self.wait_for(part)
        if part in self.missing:
            await self.look()

    async def wait_for(self, part: RobotPart) -> None:
        """Return when a part is found, or counts as missing."""
        await self._wait_until(lambda: part not in self.missing)

    async def settle(self) -> None:
        """Return when all that is there counts as found."""
        await self._wait_until(lambda: False)

    async def look(self) -> None:
        """Take in the present graph: people start rosbridge first and SLAM later."""
        frames = self._frames.tree.frames
        now, names = await look_at_robot(self._connection, frames, self._overrides)
        if names != self._names or frames != self._frames_seen:
            self._news_s = anyio.current_time()
        self._names, self._frames_seen = names, frames
        before = self._profile
        self._profile = now
        if before is not None:
            self._profile = improve(
                before,
                now,
                is_settled=self._is_settled,
                keeps_navigation=self.is_driving(),
            )
        self._frames.listen(*self._profile.tf_topics, dialect=self._profile.dialect)
        if before is not None and before != self._profile:
            self._news_s = anyio.current_time()
            self.on_change(before)

    async def _wait_until(self, is_found: Callable[[], bool]) -> None:
        while not is_found() and not self.is_settled:
            with suppress(LinkError):
                await self.look()
            if not is_found() and not self.is_settled:
                await anyio.sleep(PAUSE_S)

    def _is_said(self, part: RobotPart) -> bool:
        is_dead = part.topic(self.profile) in self.profile.dead_topics
        return getattr(self._overrides, part) is not None and not is_dead

    @property
    def _leads_to_base(self) -> bool:
        if self._overrides.pose_topic not in (None, "tf"):
            return True
        profile = self.profile
        return self._frames.has_way(outer=profile.map_frame, inner=profile.base_frame)

    async def _wait_for_frames(self) -> None:
        """Return when a frame is there that has not been, or when they lead to the base at last."""
        did_lead = self._leads_to_base
        while self._frames.tree.frames == self._frames_seen and self._leads_to_base == did_lead:
            await self._frames.news.wait()
