"""The paper's five tools, under the paper's names: usable in its order, and each alone."""

import math
from collections.abc import Sequence
from typing import Annotated

from mcp.server.mcpserver import Image
from pydantic import BaseModel, ConfigDict, Field

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose, wrap_angle
from mapspeak.navigation.goals import FARTHEST_M
from mapspeak.navigation.places import is_taken_name
from mapspeak.semantic import Landmark, Waypoint
from mapspeak.server.reports import MemoryAnswer, WriteAnswer
from mapspeak.server.toolset import Effect, Tool
from mapspeak.server.wording import say_pose
from mapspeak.session import Session
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.picture import (
    MapPicture,
    draw_map_axis,
    draw_map_plain,
    draw_robot_pose,
)

__all__ = ["PaperTools"]


class LandmarkInput(BaseModel):
    """A landmark with what is known of it."""

    model_config = ConfigDict(extra="forbid")

    label: str = Field(description="what it is", min_length=1, max_length=120)
    purpose: str | None = Field(None, description="used for ...", max_length=200)
    bearing_deg: float | None = Field(
        None, description="from the robot's heading, left positive", allow_inf_nan=False
    )
    range_m: float | None = Field(None, description="metres", ge=0, allow_inf_nan=False)

    def landmark(self) -> Landmark:
        """Gives the value."""
        bearing_rad = None if self.bearing_deg is None else math.radians(self.bearing_deg)
        return Landmark(
            label=self.label, purpose=self.purpose, bearing_rad=bearing_rad, range_m=self.range_m
        )


Name = Annotated[
    str,
    Field(description="unique; an existing name is updated", min_length=1, max_length=120),
]
Description = Annotated[str, Field(description="the place in a sentence or two", max_length=2000)]
Label = Annotated[str, Field(min_length=1, max_length=120)]
Feature = Annotated[str, Field(max_length=300)]
Landmarks = Annotated[
    list[Label | LandmarkInput] | None,
    Field(max_length=50, description="labels, or objects with more"),
]
Features = Annotated[
    list[Feature] | None,
    Field(max_length=50, description="lasting layout: corridors, walls, openings, obstacles"),
]
Metres = Annotated[
    float | None,
    Field(
        description="where from, metres; else the robot's",
        allow_inf_nan=False,
    ),
]
Degrees = Annotated[
    float | None, Field(description="observation heading, degrees", allow_inf_nan=False)
]
WaypointName = Annotated[
    str | None, Field(description="one remembered place by name; all when left out")
]


class PaperTools:
    """The map as the paper draws it, and its semantic data."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def tools(self) -> list[Tool]:
        """Gives the tools in the paper's order."""
        return [
            Tool(
                function=self.subscribe_map_as_image,
                title="The map as a grey picture (paper)",
                effect=Effect.READS,
            ),
            Tool(
                function=self.draw_map_axis,
                title="The map with axes and grid (paper)",
                effect=Effect.READS,
            ),
            Tool(
                function=self.draw_robot_pose,
                title="The map with the robot's pose (paper)",
                effect=Effect.READS,
            ),
            Tool(
                function=self.write_semantic_data,
                title="Remember this place",
                effect=Effect.REMEMBERS,
                has_report=True,
            ),
            Tool(
                function=self.get_semantic_data,
                title="Recall remembered places",
                effect=Effect.READS,
                has_report=True,
            ),
        ]

    async def subscribe_map_as_image(self) -> list[str | Image]:
        """Gives the robot's map as a plain grey picture: white free, grey unknown, dark occupied.

        Use look_at_map instead for rooms, frontiers and numbers; draw_map_axis goes on from here.
        """
        grid = await self._session.robot.fetch_map()
        picture = await self._session.compute(lambda: draw_map_plain(grid))
        return [_say_plain(grid, picture), Image(data=picture.png, format="png")]

    async def draw_map_axis(self) -> list[str | Image]:
        """Gives the map as it is now with axes and a metric grid, numbered in metres.

        Use it after subscribe_map_as_image, or alone.
        """
        grid = await self._session.robot.fetch_map()
        picture = await self._session.compute(lambda: draw_map_axis(grid))
        return [_say_axes(grid, picture), Image(data=picture.png, format="png")]

    async def draw_robot_pose(self) -> list[str | Image]:
        """Gives the map as it is now with axes, and the robot as an arrow at its pose.

        Use it after draw_map_axis, or alone.
        """
        grid = await self._session.robot.fetch_map()
        pose = (await self._session.robot.fetch_pose()).pose
        picture = await self._session.compute(lambda: draw_robot_pose(grid, pose))
        text = f"{_say_axes(grid, picture)} Robot: {say_pose(pose)}."
        return [text, Image(data=picture.png, format="png")]

    async def write_semantic_data(
        self,
        name: Name,
        description: Description,
        safety_landmarks: Landmarks = None,
        functional_landmarks: Landmarks = None,
        geometric_features: Features = None,
        x: Metres = None,
        y: Metres = None,
        yaw_deg: Degrees = None,
    ) -> WriteAnswer:
        """Remembers a place: what is seen from here, with the robot's pose, in the semantic map.

        Use it at every waypoint after look_through_camera. Keep what lasts (safety equipment, fixed
        equipment, layout); leave out people, loose boxes and guesses.
        """
        _check_name(name)
        waypoint = Waypoint(
            name=name,
            description=description,
            pose=await self._observation_pose(x, y, yaw_deg),
            safety_landmarks=_landmarks(safety_landmarks),
            functional_landmarks=_landmarks(functional_landmarks),
            geometric_features=tuple(geometric_features or ()),
            stamp_s=self._session.robot.now_s,
        )
        receipt = await self._session.compute(lambda: self._session.memory.write(waypoint))
        memory = await self._session.compute(self._session.memory.read)
        return WriteAnswer.of(receipt, memory)

    async def get_semantic_data(self, name: WaypointName = None) -> MemoryAnswer:
        """Recalls remembered places with pose, landmarks and layout; they are observations.

        Use it to find an object, a function or a place, then navigate_to its id (W1): that is where
        it was seen from; bearing and range lead on from there.
        """
        memory = await self._session.compute(self._session.memory.read)
        return MemoryAnswer.of(memory, name)

    async def _observation_pose(
        self, x: float | None, y: float | None, yaw_deg: float | None
    ) -> Pose:
        here = (await self._session.robot.fetch_pose()).pose
        if (x is None) != (y is None):
            raise SemanticMapError(
                "Only one of x and y was given.",
                hint="Give both in metres, or neither for the robot's own pose.",
            )
        yaw_rad = here.yaw_rad if yaw_deg is None else wrap_angle(math.radians(yaw_deg))
        if x is None or y is None:
            return Pose(here.x, here.y, yaw_rad)
        if max(abs(x), abs(y)) > FARTHEST_M:
            raise SemanticMapError(
                f"({x:g}, {y:g}) lies farther away than any map reaches.",
                hint="Give metres in the map frame, or leave x and y out for the robot's own pose.",
            )
        return Pose(x, y, yaw_rad)


def _check_name(name: str) -> None:
    if is_taken_name(name):
        raise SemanticMapError(
            f"{name!r} reads like an id, coordinates or the robot itself.",
            hint="Give a name in words, such as 'dock corner'.",
        )


def _landmarks(given: Sequence[str | LandmarkInput] | None) -> tuple[Landmark, ...]:
    return tuple(
        Landmark(label=each) if isinstance(each, str) else each.landmark() for each in given or ()
    )


def _say_plain(grid: OccupancyGrid, picture: MapPicture) -> str:
    return (
        f"{_say_placement(grid, picture)} Grey 127 is unknown, 255 free, darker the more surely "
        "occupied. x grows to the right and y upwards."
    )


def _say_axes(grid: OccupancyGrid, picture: MapPicture) -> str:
    return (
        f"{_say_placement(grid, picture)} A grid line every {picture.spacing_m:g} m, numbered in "
        "metres of the map frame; x grows to the right and y upwards."
    )


def _say_placement(grid: OccupancyGrid, picture: MapPicture) -> str:
    view = picture.view
    left, bottom = view.area_corners()[3]
    return (
        f"Map picture, {view.width_px} x {view.height_px} px; the map in it has "
        f"{view.pixels_per_m * grid.resolution_m:g} px per cell of {grid.resolution_m:g} m; "
        f"lower left corner at x {left:.3f}, y {bottom:.3f}."
    )
