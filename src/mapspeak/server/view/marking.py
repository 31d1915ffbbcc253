"""Things on a map for RViz and Foxglove: the page's overlay as marks, published on ROS."""

import logging
import math
from collections.abc import Iterator, Sequence
from functools import partial

import anyio

from mapspeak.errors import MapspeakError
from mapspeak.geometry import Pose
from mapspeak.memory.quoting import clean_line
from mapspeak.ros.messages.markers import MARKER_ARRAY, Marker, MarkShape, write_markers
from mapspeak.ros.port import RosConnection
from mapspeak.server.view.document import Spot
from mapspeak.server.view.overlay import Overlay
from mapspeak.session import Session
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.revision import MapRevision

PERIOD_S = 1.0
SAME_S = 1e-3
"""Two times by which a connection was begun differ by no more than that where it is the same."""
LINE_M, THICK_M, DOT_M, ARROW_M, TEXT_M = 0.05, 0.08, 0.08, 0.4, 0.25
LEAST_DISC_M = 0.15
LONGEST_LABEL = 80
Colour = tuple[float, float, float, float]
# Doors, frontiers, places and things have the colours of the page and of the picture.
COLOURS: dict[str, Colour] = {
    "room": (0.1, 0.4, 0.9, 1.0),
    "corridor": (0.4, 0.4, 0.45, 1.0),
    "doors": (0.9, 0.62, 0.0, 0.5),
    "frontiers": (0.84, 0.37, 0.0, 1.0),
    "closed": (0.85, 0.1, 0.1, 1.0),
    "places": (0.0, 0.45, 0.7, 1.0),
    "things": (0.8, 0.47, 0.65, 0.5),
}
CYAN: Colour = (0.0, 0.7, 0.8, 1.0)
"""Of open spaces, and of the path."""

logger = logging.getLogger(__name__)


class MarkSource:
    """Draws the things on a robot's map; finds rooms and frontiers of every new map itself."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._surveyed: MapRevision | None = None
        self._path: tuple[str, list[Spot]] = ("", [])

    async def fetch(self) -> tuple[Marker, ...]:
        """Return the marks to draw now.

        Raises:
            MapspeakError: There is no map to draw on.
        """
        world = await self._session.fetch_world_model()
        return await self._session.compute(partial(self._draw, world))

    def _draw(self, world: WorldModel) -> tuple[Marker, ...]:
        # Tools find these when they need them; RViz must not wait for a tool.
        if self._surveyed is not world.map:
            _ = world.rooms, world.frontiers
            self._surveyed = world.map
        _ = world.recollection
        drive = self._session.drives.under_way
        if drive is None:
            self._path = "", []
        elif self._path[0] != drive.goal_id:
            way = world.distances.way_to(drive.goal.point) or ()
            self._path = drive.goal_id, [(round(at.x, 2), round(at.y, 2)) for at in way]
        return tuple(marks_of(Overlay.of(world), path=self._path[1]))


def marks_of(overlay: Overlay, *, path: Sequence[Spot]) -> Iterator[Marker]:
    """Yield what draws each thing of an overlay, and the path of the drive under way."""
    for region in overlay.regions:
        colour = COLOURS.get(region.kind, CYAN)
        yield from _outlined("rooms", region.outlines, colour, LINE_M)
        yield _label("rooms", region.middle, f"{region.id} {region.floor_m2:g} m2", colour)
    for door in overlay.doors:
        yield from _at("doors", MarkShape.CYLINDER, door.at, door.width_m, door.id)
    for frontier in overlay.frontiers:
        yield from _at(
            "frontiers", MarkShape.POINTS, frontier.at, DOT_M, frontier.id, points=frontier.border
        )
    for area in overlay.closed:
        yield from _outlined("closed", area.outlines, COLOURS["closed"], THICK_M)
        for outline in area.outlines[:1]:
            said = f"{area.event_id} {area.title}"
            yield _label("closed", outline[0], said, COLOURS["closed"])
    for place in overlay.places:
        said, yaw_rad = f"{place.id} {place.name}", math.radians(place.yaw_deg or 0.0)
        yield from _at("places", MarkShape.ARROW, place.at, ARROW_M, said, yaw_rad=yaw_rad)
    for thing in overlay.things:
        across_m = max(2 * thing.radius_m, LEAST_DISC_M)
        said = f"{thing.id} {thing.name}"
        yield from _at("things", MarkShape.CYLINDER, thing.at, across_m, said)
    if len(path) > 1:
        yield from _outlined("path", [path], CYAN, THICK_M, is_closed=False)


def _at(
    group: str,
    shape: MarkShape,
    at: Spot,
    size_m: float,
    text: str,
    *,
    points: Sequence[Spot] = (),
    yaw_rad: float = 0.0,
) -> Iterator[Marker]:
    """Yield a mark at a place with its label; single points say themselves where they are."""
    colour, pose = COLOURS[group], Pose(0.0, 0.0) if points else Pose(*at, yaw_rad)
    yield Marker(group=group, shape=shape, size_m=size_m, colour=colour, pose=pose, points=points)
    yield _label(group, at, text, colour)


def _outlined(
    group: str,
    outlines: Sequence[Sequence[Spot]],
    colour: Colour,
    width_m: float,
    *,
    is_closed: bool = True,
) -> Iterator[Marker]:
    for outline in outlines:
        points = [*outline, outline[0]] if is_closed else outline
        yield Marker(
            group=group, shape=MarkShape.LINE, size_m=width_m, colour=colour, points=points
        )


def _label(group: str, at: Spot, text: str, colour: Colour) -> Marker:
    # Texts of people and models may hold characters that ROS cannot carry.
    said = clean_line(text).encode(errors="replace").decode()[:LONGEST_LABEL]
    return Marker(
        group=f"{group} names",
        shape=MarkShape.TEXT,
        size_m=TEXT_M,
        colour=(*colour[:3], 1.0),
        pose=Pose(*at),
        text=said,
    )


def topic_for(name: str) -> str:
    """Return the topic of a robot's markers; of an only one, which has no name, the short one."""
    return f"/mapspeak/{name.replace('-', '_')}/markers" if name else "/mapspeak/markers"


class MarkerPublisher:
    """Publishes the markers of one robot on its own ROS, latched, whenever they have changed.

    They move nothing, and are no command: the guard is not asked for each.

    Args:
        connection: The robot's, without the guard.
    """

    def __init__(self, session: Session, connection: RosConnection, *, name: str = "") -> None:
        self._session = session
        self._connection = connection
        self._topic = topic_for(name)
        self._source = MarkSource(session)
        self._published: tuple[Marker, ...] | None = None
        self._begun_s = math.inf

    async def run(self) -> None:
        """Look and publish, until cancelled."""
        fault = ""
        while True:
            try:
                await self.look()
            except MapspeakError as error:
                if fault != str(error):
                    logger.warning("The markers are not published: %s", error)
                fault = str(error)
            await anyio.sleep(PERIOD_S)

    async def look(self) -> None:
        """Publish the markers where they, or the connection, are new.

        Raises:
            MapspeakError: There is no map, or they cannot be published.
        """
        marks = await self._source.fetch()
        # A restarted robot has lost the latched messages from before.
        begun_s = anyio.current_time() - (self._connection.connected_for_s or 0.0)
        if begun_s < self._begun_s + SAME_S and marks == self._published:
            return
        dialect = (await self._connection.fetch_graph()).dialect
        type_name = dialect.type_name(MARKER_ARRAY)
        self._connection.advertise(self._topic, type_name=type_name, is_latched=True)
        frame_id = self._session.robot.description.map_frame
        message = write_markers(marks, frame_id=frame_id, dialect=dialect)
        await self._connection.publish(self._topic, message)
        self._published, self._begun_s = marks, begun_s
