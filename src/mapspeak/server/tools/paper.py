"""The paper's five tools, under the paper's names: usable in its order, and each alone."""

import math
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from typing import Annotated, Any, NamedTuple

from mcp.server.mcpserver import Image
from pydantic import Field, WithJsonSchema

from mapspeak.driving.episodewriter import Keeping
from mapspeak.errors import LinkError, MapError, MapspeakError, SemanticMapError
from mapspeak.geometry import Pose, wrap_angle
from mapspeak.memory import Merge, TakenPicture, Waypoint, WriteReceipt, name_key
from mapspeak.memory.quoting import quote_name
from mapspeak.places.asking import find_speaking_places
from mapspeak.places.goalcheck import FARTHEST_M
from mapspeak.places.things import find_gone, forget_thing
from mapspeak.robot import PoseDoubt
from mapspeak.server.reports.mappicture import say_axes, say_plain
from mapspeak.server.reports.robot import MemoryAnswer, PlaceWritten, WriteAnswer
from mapspeak.server.text.findings import say_moved
from mapspeak.server.text.memory import say_far
from mapspeak.server.text.offered import say_error
from mapspeak.server.text.recall import (
    say_advice,
    say_gone,
    say_placed,
    say_undescribed,
)
from mapspeak.server.text.wording import say_pose, say_pose_doubt
from mapspeak.server.tools.annotating import (
    Annotator,
    Description,
    Feature,
    Features,
    Functional,
    Landmarks,
    Name,
    PlaceInput,
    Safety,
    SeenIn,
    check_name,
    list_pictures_named,
)
from mapspeak.server.tools.sightings import fetch_ring, find_taken, find_undescribed_pictures
from mapspeak.server.tools.toolset import ToolEffect, tool
from mapspeak.session import Session
from mapspeak.spatial.picture import (
    draw_map_axis,
    draw_map_plain,
    draw_robot_pose,
)

Gone = Annotated[list[Feature] | None, Field(max_length=50, description="labels no longer there")]
X = Annotated[
    float | None,
    Field(description="metres; else the picture's or robot's", allow_inf_nan=False),
]
Y = Annotated[float | None, Field(description="metres", allow_inf_nan=False)]
Degrees = Annotated[
    float | None,
    Field(
        description="else as in the picture of most safety things, or of most", allow_inf_nan=False
    ),
]
Others = Annotated[
    list[PlaceInput],
    Field(max_length=20),
    # A model need not read the same arguments twice.
    WithJsonSchema({"type": "array"}),
]
More = Annotated[
    Others | None,
    Field(description="further places, each with these arguments but gone, x, y, yaw_deg"),
]
Query = Annotated[str | None, Field(description="or by what is there", max_length=200)]
FromRow = Annotated[int, Field(description="row", ge=0)]
WaypointName = Annotated[str | None, Field(description="one; else all")]
MOST_JOINED = 500
"""Of more places the things are not joined anew for the answer to a write: it would wait."""


class Named(NamedTuple):
    """What a write named: a place, and things of it by label."""

    place: str
    labels: tuple[str, ...]


Written = tuple[PlaceWritten, Named]


class PaperTools:
    """The map as the paper draws it, and its semantic data."""

    def __init__(self, session: Session) -> None:
        self._session = session

    @tool(
        "Map as a grey picture (paper)",
        ToolEffect.READS,
        leads="Use {look_at_map} for rooms, frontiers and numbers.",
    )
    async def subscribe_map_as_image(self) -> list[str | Image]:
        """Return the map as a grey picture: white free, grey unknown, dark occupied."""
        grid = await self._session.robot.fetch_map()
        picture = await self._session.compute(lambda: draw_map_plain(grid))
        return [say_plain(grid, picture), Image(data=picture.png, format="png")]

    @tool("Map with axes and grid (paper)", ToolEffect.READS)
    async def draw_map_axis(self) -> list[str | Image]:
        """Return the map with axes and a grid, numbered in metres."""
        grid = await self._session.robot.fetch_map()
        picture = await self._session.compute(lambda: draw_map_axis(grid))
        return [say_axes(grid, picture), Image(data=picture.png, format="png")]

    @tool("Map with the robot's pose (paper)", ToolEffect.READS)
    async def draw_robot_pose(self) -> list[str | Image]:
        """Return the map with axes, and the robot as an arrow at its pose."""
        grid = await self._session.robot.fetch_map()
        here, doubt = await self._find_robot()
        picture = await self._session.compute(lambda: draw_robot_pose(grid, here))
        text = (
            f"{say_axes(grid, picture)} Robot: {say_pose(here)}. {say_pose_doubt(doubt)}".rstrip()
        )
        return [text, Image(data=picture.png, format="png")]

    @tool(
        "Remember this place",
        ToolEffect.REMEMBERS,
        has_report=True,
        leads="Use it at every waypoint after {look_through_camera}.",
    )
    async def write_semantic_data(
        self,
        name: Name,
        description: Description,
        safety_landmarks: Safety = None,
        functional_landmarks: Functional = None,
        geometric_features: Features = None,
        gone: Gone = None,
        x: X = None,
        y: Y = None,
        yaw_deg: Degrees = None,
        picture: SeenIn = None,
        more: More = None,
    ) -> WriteAnswer:
        """Remember a place: what is seen from here.

        A known name is updated: landmarks that you do not name stay. Leave out people, loose boxes
        and guesses.
        """
        first = PlaceInput(
            name=name,
            description=description,
            picture=picture,
            safety_landmarks=safety_landmarks,
            functional_landmarks=functional_landmarks,
            geometric_features=geometric_features,
        )
        written = [await self._write(first, gone=gone, x=x, y=y, yaw_deg=yaw_deg)]
        written += [await self._write_too(each) for each in more or ()]
        places = await self._session.compute(self._session.memory.read)
        told = await self._with_things(written)
        return WriteAnswer.of_all(told, n_places=len(places.waypoints))

    async def _write_too(self, place: PlaceInput) -> Written:
        """Write a further place; what is wrong with one costs no other."""
        try:
            return await self._write(place)
        except MapspeakError as error:
            said = f"{quote_name(place.name)} was not written: {say_error(error)}"
            return PlaceWritten.of_refusal(said), Named(place.name, ())

    async def _write(
        self,
        place: PlaceInput,
        *,
        gone: Sequence[str] | None = None,
        x: float | None = None,
        y: float | None = None,
        yaw_deg: float | None = None,
    ) -> Written:
        safety_landmarks, functional_landmarks = place.safety_landmarks, place.functional_landmarks
        check_name(place.name)
        await self._session.meet_map()
        described = await find_taken(self._session, place.picture)
        earlier = await self._find_earlier(safety_landmarks, functional_landmarks)
        annotator = Annotator(pictures=self._session.pictures, described=described, earlier=earlier)
        origin = annotator.find_origin(safety_landmarks, functional_landmarks)
        here, doubt = await self._find_robot()
        seen_at = _observation_pose(here if origin is None else origin.pose, x, y, yaw_deg)
        shows = place.shows_things or not gone
        pose = await self._find_stand(place.name, seen_at, is_told=x is not None, shows=shows)
        picture = annotator.find_picture_from(pose)
        if pose.point == here.point:
            await self._add_laser(annotator, pose, picture, safety_landmarks, functional_landmarks)
        waypoint = Waypoint(
            name=place.name,
            description=annotator.take_description(place.description),
            pose=pose,
            safety_landmarks=annotator.take(safety_landmarks, pose=pose, picture=picture),
            functional_landmarks=annotator.take(functional_landmarks, pose=pose, picture=picture),
            geometric_features=annotator.take_features(place.geometric_features or ()),
            **self._date(picture),
            room_id=await self._find_room_id(pose),
            picture=None if picture is None else picture.name,
        )
        annotator.require_content(waypoint)
        session, memory = self._session, self._session.memory
        receipt, merge = await session.compute(lambda: memory.remember(waypoint, gone=gone or ()))
        kept = await self._keep_record(waypoint)
        unsure = say_pose_doubt(doubt) if pose.point == here.point else ""
        far = await self._say_far(receipt) + await self._forget_gone(gone, merge, seen_at)
        moved = await say_moved(session.compute(session.keeper.compare))
        places = await session.compute(memory.read)
        told = filter(None, (*annotator.remarks, *far, unsure, kept.fault, moved))
        refused = annotator.refused
        answer = PlaceWritten.of(receipt, places, merge=merge, refused=refused, warnings=(*told,))
        named = (*merge.new, *(each.after for each in merge.merged))
        return answer, Named(receipt.waypoint.name, tuple(each.label for each in named))

    @tool("Recall remembered places", ToolEffect.READS, has_report=True)
    async def get_semantic_data(
        self, name: WaypointName = None, query: Query = None, from_row: FromRow = 0
    ) -> MemoryAnswer:
        """Read remembered places in full, as observed. To find something take {find_place}."""
        if query is None:
            memory = await self._session.compute(self._session.memory.read)
            advice = [] if name else await self._offer_undescribed()
            return MemoryAnswer.of(memory, name, first=from_row, advice=advice)
        if name is not None:
            raise SemanticMapError(
                "Both name and query were given.", hint="Give the one or the other."
            )
        world = await self._session.fetch_world_model()
        shown, answer = await self._session.compute(lambda: find_speaking_places(world, query))
        advice = [say_advice(answer)]
        return MemoryAnswer.of_places(world.memory, shown, first=from_row, advice=advice)

    async def _offer_undescribed(self) -> list[str]:
        try:
            pictures = await find_undescribed_pictures(self._session)
        except SemanticMapError:
            # Observations that cannot be read cost no answer about what is remembered.
            return []
        return say_undescribed(pictures, self._session.pictures)

    async def _find_stand(self, name: str, seen_at: Pose, *, is_told: bool, shows: bool) -> Pose:
        """Return where a place lies; one of which only something is gone stays where it was."""
        if is_told:
            await self._require_on_map(seen_at)
        if is_told or shows:
            return seen_at
        memory, key = await self._session.compute(self._session.memory.read), name_key(name)
        poses = (each.pose for each in memory.waypoints if name_key(each.name) == key)
        return next(poses, seen_at)

    async def _find_robot(self) -> tuple[Pose, PoseDoubt | None]:
        here = await self._session.robot.fetch_pose()
        return here.pose, here.find_doubt(self._session.robot.now_s)

    async def _find_earlier(self, *given: Landmarks | None) -> dict[str, TakenPicture]:
        """Return pictures that landmarks name, kept ones of earlier among them, by those names."""
        found: dict[str, TakenPicture] = {}
        for named in list_pictures_named(*given):
            with suppress(SemanticMapError):
                taken = await find_taken(self._session, named)
                found |= {} if taken is None else {named: taken}
        return found

    async def _add_laser(
        self,
        annotator: Annotator,
        pose: Pose,
        picture: TakenPicture | None,
        *seen: Landmarks | None,
    ) -> None:
        """Fetch the laser's ranges, where no picture has them for a direction told from here."""
        if annotator.wants_laser(*seen, pose=pose, picture=picture):
            annotator.laser = await fetch_ring(self._session.robot)

    def _date(self, picture: TakenPicture | None) -> dict[str, Any]:
        """Return when it was seen: when its picture was taken, else now."""
        if picture is not None:
            return {"stamp_s": picture.stamp_s, "recorded_at": picture.recorded_at}
        session = self._session
        return {"stamp_s": session.robot.now_s, "recorded_at": session.find_wall_time()}

    async def _say_far(self, receipt: WriteReceipt) -> list[str]:
        previous, now = receipt.previous, receipt.waypoint
        if previous is None:
            return []
        rooms = [await self._find_room_id(each.pose) for each in (previous, now)]
        return say_far(previous, now, rooms=rooms)

    async def _forget_gone(self, gone: Sequence[str] | None, merge: Merge, pose: Pose) -> list[str]:
        """Forget what is gone in all records that name it; return what to say of it."""
        if not gone:
            return []
        session = self._session
        world = await session.fetch_world_model(needs_memory=True)
        in_record = {name_key(each.label) for each in merge.gone}

        def forget(label: str) -> str:
            meant = find_gone(world, label, pose.point)
            done = forget_thing(session.memory, meant[0]) if len(meant) == 1 else None
            ids = [each.id for each in meant]
            return say_gone(label, done, ids=ids, is_in_record=name_key(label) in in_record)

        return await session.compute(lambda: [said for each in gone if (said := forget(each))])

    async def _require_on_map(self, pose: Pose) -> None:
        try:
            grid = await self._session.robot.fetch_map()
        except LinkError:
            return
        if not grid.contains(grid.cell_at(pose.point)):
            low, high = grid.bounds()
            raise SemanticMapError(
                f"({pose.x:g}, {pose.y:g}) lies off the map, which spans x {low.x:.1f} to "
                f"{high.x:.1f}, y {low.y:.1f} to {high.y:.1f}.",
                hint="Give metres in the map frame, or leave x and y out for the robot's own pose.",
            )

    async def _keep_record(self, waypoint: Waypoint) -> Keeping:
        keep, name_map = self._session.episodes.keep_record, self._session.memory.name_map
        return await self._session.compute(partial(keep, waypoint, name_map=name_map))

    async def _with_things(self, written: Sequence[Written]) -> list[PlaceWritten]:
        """Add where the things are that were named, where a map is and that is soon told."""
        answers = [answer for answer, _ in written]
        try:
            world = await self._session.fetch_world_model()
        except (LinkError, MapError):
            return answers
        if len(world.places) > MOST_JOINED:
            return answers

        def add() -> list[PlaceWritten]:
            return [
                answer.model_copy(update={"things": say_placed(world, *named)})
                for answer, named in written
            ]

        return await self._session.compute(add)

    async def _find_room_id(self, pose: Pose) -> str | None:
        try:
            return await self._session.find_room_id(pose.point)
        except (LinkError, MapError):
            return None


def _observation_pose(
    origin: Pose, x: float | None, y: float | None, yaw_deg: float | None
) -> Pose:
    """Return the requested pose; take missing values from the origin."""
    if (x is None) != (y is None):
        raise SemanticMapError(
            "Only one of x and y was given.",
            hint="Give both in metres, or neither for the robot's own pose.",
        )
    yaw_rad = origin.yaw_rad if yaw_deg is None else wrap_angle(math.radians(yaw_deg))
    if x is None or y is None:
        return Pose(origin.x, origin.y, yaw_rad)
    if max(abs(x), abs(y)) > FARTHEST_M:
        raise SemanticMapError(
            f"({x:g}, {y:g}) lies farther away than any map reaches.",
            hint="Give metres in the map frame, or leave x and y out for the robot's own pose.",
        )
    return Pose(x, y, yaw_rad)
