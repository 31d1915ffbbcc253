"""The things on the map as JSON: rooms, doors, frontiers, closed areas, the memory.

Points are metres in the map frame, angles degrees counter-clockwise from x.
"""

from collections.abc import Sequence

import cv2
import numpy as np

from mapspeak.geometry import Point
from mapspeak.server.view.document import Spot, ViewPart
from mapspeak.spatial.rooms import RoomMap
from mapspeak.worldmodel.model import WorldModel

SMOOTH_CELLS = 1.5
"""An outline differs from the cells that it encloses by no more."""


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
    """A border between known and unknown floor."""

    id: str
    at: Spot
    border: list[Spot]
    promised_m2: float


class ClosedView(ViewPart):
    """An area that is closed to the robot; an event that closes it has an id."""

    title: str
    outlines: list[list[Spot]]
    event_id: str = ""


class RememberedView(ViewPart):
    """A remembered place or thing; radius_m is how far it may be off."""

    id: str
    name: str
    at: Spot
    yaw_deg: float | None = None
    radius_m: float = 0.0


class Overlay(ViewPart):
    """Everything on the map, as it was looked at last."""

    regions: Sequence[RegionView] = ()
    doors: Sequence[DoorView] = ()
    frontiers: Sequence[FrontierView] = ()
    closed: Sequence[ClosedView] = ()
    places: Sequence[RememberedView] = ()
    things: Sequence[RememberedView] = ()

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
                    event_id=area.event_id,
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
