"""The robot's map: the whole of it once, and what changes."""

import anyio.to_thread

from mapspeak.errors import LinkError, MapspeakError
from mapspeak.links.ros.discovery import RobotProfile
from mapspeak.links.ros.discovery.ranking import MAP, MAP_UPDATE
from mapspeak.ros import RosConnection, Subscription
from mapspeak.ros.messages import Message, apply_grid_update, read_grid
from mapspeak.spatial import OccupancyGrid

MAP_HINT = (
    "Start SLAM or a map server (slam_toolbox, Cartographer, nav2_map_server; ROS 1: gmapping, "
    "map_server). A map of more than 10 MB needs rosbridge's max_message_size:=200000000."
)


WAITS_S = (2.0, 3.0, 10.0)
"""For the first map, in wall time; between two waits it is asked for anew.

A subscription made before the robot's side knew the publisher never gets the latched map.
"""


class MapKeeper:
    """Keeps the latest map, and makes a value of it when somebody wants it.

    Args:
        connection: Connected to the robot.
        profile: Says which topics.
        waits_s: How long to wait for the first map before asking anew, in wall time.
    """

    def __init__(
        self,
        connection: RosConnection,
        profile: RobotProfile,
        *,
        waits_s: tuple[float, ...] = WAITS_S,
    ) -> None:
        self._connection = connection
        self._profile = profile
        self._waits_s = waits_s
        self._maps: Subscription | None = None
        self._n_waits = 0
        self._n_read = 0
        self._grid: OccupancyGrid | None = None
        self.n_updates_refused = 0
        """Updates that did not fit the map; the next whole map mends that."""

    async def fetch(self) -> OccupancyGrid:
        """Gives the latest map; the same value until it changes.

        Raises:
            LinkError: There is none, or it is none.
            MapError: What came is no map.
        """
        maps = self._subscribe()
        await self._wait_for_first(maps)
        if maps.latest is not None and isinstance(maps.latest.get("data"), str):
            # Base64 takes long enough to hold up a stop.
            return await anyio.to_thread.run_sync(self._read_latest, maps)
        return self._read_latest(maps)

    def _subscribe(self) -> Subscription:
        if self._maps is None:
            topic = self._profile.map_topic
            if topic is None:
                raise LinkError(
                    "The robot publishes no map (nav_msgs/OccupancyGrid).", hint=MAP_HINT
                )
            self._maps = self._connection.subscribe(
                topic,
                type_name=self._profile.dialect.type_name(MAP),
                is_bulky=True,
            )
            if self._profile.map_updates_topic is not None:
                updates = self._connection.subscribe(
                    self._profile.map_updates_topic,
                    type_name=self._profile.dialect.type_name(MAP_UPDATE),
                    is_bulky=True,
                )
                updates.listen(self._take_update)
        return self._maps

    async def _wait_for_first(self, maps: Subscription) -> None:
        """Waits for the map, and asks anew as often as that is worth it.

        The last one goes on however often it was waited for in vain: a map of 4000x4000 cells as
        JSON takes rosbridge twenty seconds, and asking anew would begin them again.
        """
        while maps.latest is None:
            try:
                await maps.wait_for_more_than(0, timeout_s=self._waits_s[self._n_waits])
            except LinkError:
                if self._n_waits == len(self._waits_s) - 1:
                    raise LinkError(
                        f"No map has come on {maps.topic} yet.",
                        hint=f"{MAP_HINT} We stay subscribed: ask again.",
                    ) from None
                self._n_waits += 1
                self._connection.renew(maps)

    def _read_latest(self, maps: Subscription) -> OccupancyGrid:
        if maps.latest is not None and (self._grid is None or self._n_read != maps.n_received):
            self._grid = None
            self._n_read = maps.n_received
            self._grid = read_grid(maps.latest)
        if self._grid is None:
            raise LinkError("The robot's map is gone.", hint=MAP_HINT)
        return self._grid

    def _take_update(self, message: Message) -> None:
        if self._maps is None or self._maps.latest is None:
            return
        try:
            self._grid = apply_grid_update(self._read_latest(self._maps), message)
        except MapspeakError:
            self.n_updates_refused += 1
