"""What the robot's navigation publishes of itself: planned path, footprint, costmaps.

Nav2 and move_base name these topics in a few ways. They are looked for when somebody asks, and
subscribed to for as long as somebody goes on asking.
"""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial

import anyio
import numpy as np

from mapspeak.errors import LinkError, MapError, MapspeakError
from mapspeak.geometry import Point, Pose
from mapspeak.robot import NavigationLook, NavigationPart
from mapspeak.ros.activity import Subscription
from mapspeak.ros.discovery.profile import RobotProfile
from mapspeak.ros.discovery.topics import MAP, MAP_UPDATE
from mapspeak.ros.messages.fields import Message, number_of, part_of, parts_of, read_header
from mapspeak.ros.messages.grids import apply_grid_update, read_grid
from mapspeak.ros.messages.poses import read_pose
from mapspeak.ros.port import RosConnection
from mapspeak.ros.robot.poses import RobotClock
from mapspeak.ros.robot.sensors import IdleSubscriptions
from mapspeak.ros.transforms import FrameListener
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.fieldofview import trace_outlines
from mapspeak.spatial.grid import FloatArray

PATH, POLYGON = "nav_msgs/Path", "geometry_msgs/PolygonStamped"
USUAL_NAMES = {
    NavigationPart.PLAN: (PATH, ("/plan", "/received_global_plan", "/global_plan")),
    NavigationPart.FOOTPRINT: (
        POLYGON,
        ("/local_costmap/published_footprint", "/local_costmap/footprint", "/footprint"),
    ),
    NavigationPart.GLOBAL_COSTMAP: (MAP, ("/global_costmap/costmap",)),
    NavigationPart.LOCAL_COSTMAP: (MAP, ("/local_costmap/costmap",)),
}
"""Type and ends of names, the usual one first."""
COSTMAPS = (NavigationPart.GLOBAL_COSTMAP, NavigationPart.LOCAL_COSTMAP)
INSCRIBED = 99
"""The least cost at which the middle of the robot would make it collide (nav2_costmap_2d)."""
THROTTLE_MS = 500
FIRST_S = 1.0
"""Wall time for the first messages to come."""
MOST_POINTS = 2_000
"""Of a path; longer ones are thinned out."""
LEAST_OUTLINE_M = 0.3


def find_navigation_topics(
    types: Mapping[str, str], *, namespace: str
) -> dict[NavigationPart, str]:
    """Return the topic of each part that a robot's navigation publishes.

    Args:
        types: Of all topics, as "package/Type".
        namespace: The robot's, such as /robot1; empty for none.
    """
    found = {}
    for part, (type_name, endings) in USUAL_NAMES.items():
        ranked = [
            (place, topic.count("/"), topic)
            for topic, listed in types.items()
            for place, ending in enumerate(endings)
            if listed == type_name and topic.endswith(ending)
            if topic.startswith(f"{namespace}/")
        ]
        if ranked:
            found[part] = min(ranked)[-1]
    return found


class NavigationListener:
    """Tells the parts in the map frame."""

    def __init__(
        self,
        connection: RosConnection,
        profile: Callable[[], RobotProfile],
        frames: FrameListener,
        clock: RobotClock,
    ) -> None:
        self._connection = connection
        self._profile = profile
        self._frames = frames
        self._clock = clock
        self._topics: dict[NavigationPart, str] = {}
        self._heard: dict[NavigationPart, Subscription] = {}
        self._grids: dict[NavigationPart, OccupancyGrid] = {}
        self._idle = IdleSubscriptions(connection, self._subscribe)

    async def fetch(self) -> tuple[NavigationLook, ...]:
        """Return what each part told last; empty where navigation publishes none of them.

        Raises:
            LinkError: The robot does not list its topics.
        """
        profile = self._profile()
        if not self._idle.subscriptions:
            types = await self._connection.fetch_topics()
            self._topics = find_navigation_topics(types, namespace=profile.namespace)
        if not self._topics:
            return ()
        with self._idle.look():
            for heard in self._heard.values():
                left_s = heard.begun_s + FIRST_S - anyio.current_time()
                with suppress(LinkError):
                    await heard.wait_for_more_than(0, timeout_s=max(left_s, 0.0))
            # Outlines of a large costmap take a while.
            robot_s = self._clock.now_s if self._clock.is_set else None
            age_of = partial(_measure_age_s, wall_s=anyio.current_time(), robot_s=robot_s)
            read = partial(self._read_all, profile.map_frame, age_of)
            return await anyio.to_thread.run_sync(read)

    def _subscribe(self) -> tuple[Subscription, ...]:
        dialect, updates = self._profile().dialect, list[Subscription]()
        self._grids, self._heard = {}, {}
        for part, topic in self._topics.items():
            type_name = dialect.type_name(USUAL_NAMES[part][0])
            # Of costmaps none is left out: parts that follow change the whole one before them.
            throttle_ms = 0 if part in COSTMAPS else THROTTLE_MS
            heard = self._connection.subscribe(topic, type_name=type_name, throttle_ms=throttle_ms)
            self._heard[part] = heard
            if part in COSTMAPS:
                heard.listen(partial(self._forget_grid, part))
                type_name = dialect.type_name(MAP_UPDATE)
                updates.append(self._connection.subscribe(f"{topic}_updates", type_name=type_name))
                updates[-1].listen(partial(self._take_update, part))
        return (*self._heard.values(), *updates)

    def _forget_grid(self, part: NavigationPart, _message: Message) -> None:
        self._grids.pop(part, None)

    def _take_update(self, part: NavigationPart, message: Message) -> None:
        # One that does not fit is left out; the next whole costmap mends that.
        with suppress(MapspeakError):
            self._grids[part] = apply_grid_update(self._grid(part), message)

    def _grid(self, part: NavigationPart) -> OccupancyGrid:
        latest, grid = self._heard[part].latest, self._grids.get(part)
        if grid is not None:
            return grid
        if latest is None:
            raise LinkError("No costmap has come yet.", hint="Wait for it.")
        self._grids[part] = read_grid(latest)
        return self._grids[part]

    def _read_all(
        self, map_frame: str, age_of: Callable[[Subscription, float], float]
    ) -> tuple[NavigationLook, ...]:
        looks = []
        for part, heard in tuple(self._heard.items()):
            look, stamp_s = self._read(part, heard, map_frame)
            age_s = None if stamp_s is None else age_of(heard, stamp_s)
            looks.append(replace(look, age_s=age_s))
        return tuple(looks)

    def _read(
        self, part: NavigationPart, heard: Subscription, map_frame: str
    ) -> tuple[NavigationLook, float | None]:
        """Return what a part told last, without its age, and its stamp; None for nothing."""
        nothing = NavigationLook(part=part, age_s=None)
        message = heard.latest
        if message is None:
            return nothing, None
        try:
            frame, stamp_s = read_header(message)
            if part in COSTMAPS:
                stamp_s = max(stamp_s, self._grid(part).stamp_s)
                lines = outline_costs(self._grid(part))
            else:
                read = _read_path if part is NavigationPart.PLAN else _read_ring
                lines = [read(message)]
        except (LinkError, MapError):
            return nothing, None
        try:
            placed = [self._place(each, frame or map_frame, map_frame) for each in lines]
        except LinkError:
            return replace(nothing, unplaced_frame=frame), stamp_s
        return replace(nothing, lines=tuple(filter(None, placed))), stamp_s

    def _place(self, points: FloatArray, frame: str, map_frame: str) -> tuple[Point, ...]:
        """Return points, shape (n, 2), in the map frame, by where that frame is now."""
        if frame != map_frame:
            matrix = self._frames.tree.find_matrix(map_frame, frame)
            points = points @ matrix[:2, :2].T + matrix[:2, 3]
        return tuple(Point(x, y) for x, y in points.tolist())


def _measure_age_s(
    heard: Subscription, stamp_s: float, *, wall_s: float, robot_s: float | None
) -> float:
    """Return how old a message is; where it has no stamp, since when it is here."""
    if stamp_s and robot_s is not None:
        return max(robot_s - stamp_s, 0.0)
    return wall_s - heard.arrived_s


def outline_costs(grid: OccupancyGrid) -> list[FloatArray]:
    """Return rings around what a costmap closes to the middle of the robot, each of shape (n, 2).

    They are in metres in the costmap's own frame.
    """
    rings = trace_outlines(grid, grid.cells >= INSCRIBED, least_m=LEAST_OUTLINE_M)
    return [np.concatenate([ring, ring[:1]]) for ring in rings]


def _read_path(message: Message) -> FloatArray:
    """Return the points of nav_msgs/Path, shape (n, 2)."""
    told = parts_of(message, "poses")
    step = max(len(told) // MOST_POINTS, 1)
    thinned = [*told[:-1:step], *told[-1:]]
    poses: list[Pose] = [read_pose(part_of(each, "pose")) for each in thinned]
    return np.array([[pose.x, pose.y] for pose in poses]).reshape(-1, 2)


def _read_ring(message: Message) -> FloatArray:
    """Return the corners of geometry_msgs/PolygonStamped, the first one again at the end."""
    corners = parts_of(part_of(message, "polygon"), "points")
    ring = [[number_of(each, "x"), number_of(each, "y")] for each in (*corners, *corners[:1])]
    return np.array(ring).reshape(-1, 2)
