"""The robot's map: the whole of it once, then its updates."""

from contextlib import suppress

import anyio.to_thread

from mapspeak.errors import LinkError, MapspeakError
from mapspeak.ros.activity import Subscription
from mapspeak.ros.discovery.profile import RobotPart, RobotProfile
from mapspeak.ros.discovery.topics import MAP, MAP_UPDATE
from mapspeak.ros.messages.fields import Message, find_stamp
from mapspeak.ros.messages.grids import apply_grid_update, read_grid
from mapspeak.ros.port import LinkKind, RosConnection
from mapspeak.spatial import OccupancyGrid

MAP_HINT = (
    "Start SLAM or a map server (slam_toolbox, Cartographer, nav2_map_server; ROS 1: gmapping, "
    "map_server)."
)
ROSBRIDGE_HINT = " A map of more than 10 MB needs rosbridge's max_message_size:=200000000."

WAITS_S = (2.0, 4.0)
ROSBRIDGE_WAITS_S = (2.0, 3.0, 10.0)
"""rosbridge writes large maps for many seconds."""


class MapSubscriber:
    """Keeps the latest map message, and makes a value of it on request."""

    def __init__(self, connection: RosConnection, profile: RobotProfile) -> None:
        self._connection = connection
        self._profile = profile
        is_bridged = connection.link.kind is LinkKind.ROSBRIDGE
        usual_s = ROSBRIDGE_WAITS_S if is_bridged else WAITS_S
        waits_s = connection.patience.first_map_s or usual_s
        self._waits_s = waits_s if RobotPart.MAP.is_alive(profile) else ()
        self._hint = MAP_HINT + (ROSBRIDGE_HINT if is_bridged else "")
        self._maps: Subscription | None = None
        self._updates: Subscription | None = None
        self._n_waits = 0
        self._n_read = 0
        self._grid: OccupancyGrid | None = None

    async def fetch(self) -> OccupancyGrid:
        """Return the latest map; the same value until it changes.

        Raises:
            LinkError: None has come, or the message is invalid.
            MapError: The message does not hold a map.
        """
        maps = self._subscribe()
        await self._wait_for_first(maps)
        if maps.latest is not None and isinstance(maps.latest.get("data"), str):
            # Base64 takes long enough to hold up a stop.
            return await anyio.to_thread.run_sync(self._read_latest, maps)
        return self._read_latest(maps)

    def close(self) -> None:
        """End the subscriptions."""
        for subscription in (self._maps, self._updates):
            if subscription is not None:
                self._connection.unsubscribe(subscription)
        self._maps = self._updates = None

    def _subscribe(self) -> Subscription:
        if self._maps is None:
            topic = self._profile.map_topic
            if topic is None:
                raise LinkError(
                    "The robot publishes no map (nav_msgs/OccupancyGrid).", hint=self._hint
                )
            self._maps = self._connection.subscribe(
                topic,
                type_name=self._profile.dialect.type_name(MAP),
            )
            if self._profile.map_updates_topic is not None:
                self._updates = self._connection.subscribe(
                    self._profile.map_updates_topic,
                    type_name=self._profile.dialect.type_name(MAP_UPDATE),
                )
                self._updates.listen(self._take_update)
        return self._maps

    async def _wait_for_first(self, maps: Subscription) -> None:
        """Wait for the map, and ask anew as often as that is worth it.

        The last one goes on however often it was waited for in vain: a map of 4000x4000 cells as
        JSON takes rosbridge twenty seconds, and asking anew would begin them again.
        """
        while maps.latest is None and self._n_waits < len(self._waits_s):
            if self._n_waits:
                self._connection.renew(maps)
            with suppress(LinkError):
                await maps.wait_for_more_than(0, timeout_s=self._waits_s[self._n_waits])
                return
            self._n_waits += 1
            if self._n_waits == len(self._waits_s):
                raise self._silence(maps)
        if maps.latest is None:
            try:
                await maps.wait_for_more_than(0, timeout_s=self._connection.patience.later_map_s)
            except LinkError:
                raise self._silence(maps) from None

    def _silence(self, maps: Subscription) -> LinkError:
        nobody = "" if RobotPart.MAP.is_alive(self._profile) else ": nobody publishes it"
        return LinkError(
            f"No map has come on {maps.topic} yet{nobody}.",
            hint=f"{self._hint} We stay subscribed: ask again.",
        )

    @property
    def stamp_s(self) -> float | None:
        """Robot time of the latest map; None where there is none, or where it has no stamp."""
        latest = None if self._maps is None else self._maps.latest
        return None if latest is None else find_stamp(latest) or None

    def _read_latest(self, maps: Subscription) -> OccupancyGrid:
        if maps.latest is None:
            raise LinkError("The robot's map is gone.", hint=self._hint)
        if self._grid is None or self._n_read != maps.n_received:
            self._grid = None
            self._n_read = maps.n_received
            self._grid = read_grid(maps.latest)
        return self._grid

    def _take_update(self, message: Message) -> None:
        if self._maps is None or self._maps.latest is None:
            return
        # An update that does not fit the map is left out; the next whole map mends that.
        with suppress(MapspeakError):
            self._grid = apply_grid_update(self._read_latest(self._maps), message)
