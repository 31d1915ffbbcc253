"""The robot's map: the whole of it once, and what changes."""

from dataclasses import dataclass

from mapspeak.errors import LinkError, MapspeakError
from mapspeak.links.rosbridge.client import RosbridgeClient, Subscription
from mapspeak.links.rosbridge.discovery import RobotProfile
from mapspeak.links.rosbridge.discovery.ranking import MAP, MAP_UPDATE
from mapspeak.links.rosbridge.messages import Message, apply_grid_update, read_grid
from mapspeak.links.rosbridge.protocol import Encoding
from mapspeak.spatial import OccupancyGrid

MAP_HINT = (
    "Start SLAM or a map server (slam_toolbox, Cartographer, nav2_map_server; ROS 1: gmapping, "
    "map_server). A map of more than 10 MB needs rosbridge's max_message_size:=200000000."
)


@dataclass(frozen=True, slots=True)
class Attempt:
    """One way of asking for the map.

    Attributes:
        encoding: How it is to be written.
        timeout_s: How long to wait for it, in wall time.
    """

    encoding: Encoding
    timeout_s: float


ATTEMPTS = (
    Attempt(Encoding.CBOR, 2.0),
    # A subscription made before the server knew the publisher never gets the latched map.
    Attempt(Encoding.CBOR, 3.0),
    # Where CBOR is beyond the size limit it is dropped in silence, while JSON comes in pieces.
    Attempt(Encoding.JSON, 10.0),
)


class MapKeeper:
    """Keeps the latest map, and makes a value of it when somebody wants it.

    Args:
        client: Connected to the robot.
        profile: Says which topics.
        attempts: What to try until the first map has come.
    """

    def __init__(
        self,
        client: RosbridgeClient,
        profile: RobotProfile,
        *,
        attempts: tuple[Attempt, ...] = ATTEMPTS,
    ) -> None:
        self._client = client
        self._profile = profile
        self._attempts = attempts
        self._maps: Subscription | None = None
        self._n_attempts = 0
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
        return self._read_latest(maps)

    def _subscribe(self) -> Subscription:
        if self._maps is None:
            topic = self._profile.map_topic
            if topic is None:
                raise LinkError(
                    "The robot publishes no map (nav_msgs/OccupancyGrid).", hint=MAP_HINT
                )
            self._maps = self._client.subscribe(
                topic,
                type_name=self._profile.dialect.type_name(MAP),
                encoding=self._attempts[0].encoding,
            )
            if self._profile.map_updates_topic is not None:
                updates = self._client.subscribe(
                    self._profile.map_updates_topic,
                    type_name=self._profile.dialect.type_name(MAP_UPDATE),
                    encoding=Encoding.CBOR,
                )
                updates.listen(self._take_update)
        return self._maps

    async def _wait_for_first(self, maps: Subscription) -> None:
        """Waits for the attempt under way, and makes the next ones, as far as they are not over.

        The last one goes on however often it was waited for in vain: a map of 4000x4000 cells as
        JSON takes rosbridge twenty seconds, and asking anew would begin them again.
        """
        while maps.latest is None:
            attempt = self._attempts[self._n_attempts]
            try:
                await maps.wait_for_more_than(0, timeout_s=attempt.timeout_s)
            except LinkError:
                if self._n_attempts == len(self._attempts) - 1:
                    raise LinkError(
                        f"No map has come on {maps.topic} yet.",
                        hint=f"{MAP_HINT} We stay subscribed: ask again.",
                    ) from None
                self._n_attempts += 1
                encoding = self._attempts[self._n_attempts].encoding
                self._client.renew(maps, encoding=encoding)

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
