"""What a page draws, as one JSON document: the map, and everything on it under its id.

Points are metres in the map frame, angles degrees counter-clockwise from x.
"""

import cv2
import numpy as np
from pydantic import BaseModel, ConfigDict

from mapspeak.geometry import Point, Pose
from mapspeak.server.view.tiles import TILE_CELLS, name_tiles
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.rooms import RoomMap
from mapspeak.worldmodel.model import WorldModel

Spot = tuple[float, float]
SMOOTH_CELLS = 1.5
"""An outline goes by no more beside the cells that it encloses."""


class ViewPart(BaseModel):
    """A part of the document."""

    model_config = ConfigDict(frozen=True)


class PoseView(ViewPart):
    """A place and a heading."""

    x: float
    y: float
    yaw_deg: float

    @classmethod
    def of(cls, pose: Pose) -> "PoseView":
        """Round a pose to the millimetre and a tenth of a degree."""
        return cls(x=round(pose.x, 3), y=round(pose.y, 3), yaw_deg=round(pose.yaw_deg, 1))


class GridView(ViewPart):
    """The grid: where it lies, and the names of its tiles from its origin on."""

    origin: PoseView
    resolution_m: float
    n_rows: int
    n_cols: int
    tile_cells: int = TILE_CELLS
    tiles: list[list[str]]

    @classmethod
    def of(cls, grid: OccupancyGrid) -> "GridView":
        """Name the tiles of a map."""
        return cls(
            origin=PoseView.of(grid.origin),
            resolution_m=grid.resolution_m,
            n_rows=grid.n_rows,
            n_cols=grid.n_cols,
            tiles=name_tiles(grid),
        )


class RegionView(ViewPart):
    """A room, corridor or open space."""

    id: str
    kind: str
    floor_m2: float
    middle: Spot
    outlines: list[list[Spot]]


class DoorView(ViewPart):
    """A door."""

    id: str
    at: Spot
    joins: list[str]
    width_m: float


class FrontierView(ViewPart):
    """Where the known meets the unknown."""

    id: str
    at: Spot
    border: list[Spot]
    promised_m2: float


class ClosedView(ViewPart):
    """An area that is closed to the robot."""

    title: str
    outlines: list[list[Spot]]


class RememberedView(ViewPart):
    """A remembered place or thing; radius_m is how far it may be off."""

    id: str
    name: str
    at: Spot
    yaw_deg: float | None = None
    radius_m: float = 0.0


class Overlay(ViewPart):
    """All that lies on the map, as it was looked at last."""

    regions: list[RegionView] = []
    doors: list[DoorView] = []
    frontiers: list[FrontierView] = []
    closed: list[ClosedView] = []
    places: list[RememberedView] = []
    things: list[RememberedView] = []

    @classmethod
    def of(cls, world: WorldModel) -> "Overlay":
        """List what has been found on the map so far; nothing is computed for the page's sake."""
        rooms, frontiers = world.map.latest_rooms, world.latest_frontiers
        recollection = world.recollector.latest
        return cls(
            regions=[] if rooms is None else _regions(rooms),
            doors=[] if rooms is None else _doors(rooms),
            frontiers=[
                FrontierView(
                    id=each.id,
                    at=_spot(each.pose.point),
                    border=[(round(x, 2), round(y, 2)) for x, y in each.points.tolist()],
                    promised_m2=round(each.gain_m2, 1),
                )
                for each in (frontiers.frontiers if frontiers else ())
            ],
            closed=[
                ClosedView(
                    title=area.title,
                    outlines=[[_spot(at) for at in outline] for outline in area.outlines],
                )
                for area in world.map.areas
            ],
            places=[
                RememberedView(
                    id=each.id,
                    name=each.waypoint.name,
                    at=_spot(each.waypoint.pose.point),
                    yaw_deg=round(each.waypoint.pose.yaw_deg, 1),
                )
                for each in world.places
            ],
            things=[
                RememberedView(
                    id=each.id,
                    name=each.thing.label,
                    at=_spot(each.point),
                    radius_m=round(each.thing.uncertainty_m or 0.0, 2),
                )
                for each in (recollection.things if recollection else ())
            ],
        )


def _regions(rooms: RoomMap) -> list[RegionView]:
    return [
        RegionView(
            id=region.id,
            kind=region.room_class.value,
            floor_m2=round(region.floor_area_m2, 1),
            middle=_spot(region.widest),
            outlines=_outlines(rooms, region.index, rooms.window_of(region)),
        )
        for region in rooms.regions
    ]


def _doors(rooms: RoomMap) -> list[DoorView]:
    return [
        DoorView(
            id=door.id,
            at=_spot(door.place),
            joins=list(door.region_ids),
            width_m=round(door.width_m, 2),
        )
        for door in rooms.doors
    ]


def _outlines(rooms: RoomMap, index: int, window: tuple[slice, slice]) -> list[list[Spot]]:
    """Return the outer borders of a region."""
    inside = np.pad((rooms.labels[window] == index).astype(np.uint8), 1)
    contours, _ = cv2.findContours(inside, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    outlines = []
    for contour in contours:
        corners = cv2.approxPolyDP(contour, SMOOTH_CELLS, closed=True)[:, 0]
        rows = corners[:, 1].astype(np.intp) + window[0].start - 1
        cols = corners[:, 0].astype(np.intp) + window[1].start - 1
        outlines.append([(round(x, 2), round(y, 2)) for x, y in rooms.grid.points_at(rows, cols)])
    return outlines


def _spot(point: Point) -> Spot:
    return round(point.x, 2), round(point.y, 2)
