"""What files say about areas and passages, in one vocabulary for all of them."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from mapspeak.errors import MapError
from mapspeak.geometry import Point
from mapspeak.installation import shell_command
from mapspeak.spatial.areagraph.graph import Polygon, Ring, signed_area_m2
from mapspeak.spatial.rooms import Door, Region, RoomClass

FILE_VERSION = 1

Position = tuple[FiniteFloat, FiniteFloat]
RingPositions = Annotated[list[Position], Field(min_length=4)]
PolygonPositions = Annotated[list[RingPositions], Field(min_length=1)]
"""The outer ring first, then the holes: as RFC 7946 has it."""


class Record(BaseModel):
    """A part of a file; what it does not know is left aside."""

    model_config = ConfigDict(frozen=True)


class AreaRecord(Record):
    """What is known about an area besides its outline: metres and radians in the map frame."""

    id: str
    label: int
    kind: RoomClass
    reason: str
    floor_area_m2: FiniteFloat
    free_area_m2: FiniteFloat
    length_m: FiniteFloat
    width_m: FiniteFloat
    heading_rad: FiniteFloat
    centre: Position
    clearance_m: FiniteFloat
    doors: list[str]
    neighbours: list[str]

    @classmethod
    def facts_of(cls, region: Region) -> dict[str, object]:
        """Gives the fields of a region under their names in files."""
        return {
            "id": region.id,
            "label": region.index,
            "kind": str(region.room_class),
            "reason": region.reason,
            "floor_area_m2": float(region.floor_area_m2),
            "free_area_m2": float(region.free_area_m2),
            "length_m": float(region.length_m),
            "width_m": float(region.width_m),
            "heading_rad": float(region.heading_rad),
            "centre": position_of(region.widest),
            "clearance_m": float(region.clearance_m),
            "doors": list(region.door_ids),
            "neighbours": list(region.neighbour_ids),
        }

    def to_region(self) -> Region:
        """Gives the region again."""
        return Region(
            id=self.id,
            index=self.label,
            room_class=self.kind,
            reason=self.reason,
            free_area_m2=self.free_area_m2,
            floor_area_m2=self.floor_area_m2,
            length_m=self.length_m,
            width_m=self.width_m,
            heading_rad=self.heading_rad,
            widest=Point(*self.centre),
            clearance_m=self.clearance_m,
            door_ids=tuple(self.doors),
            neighbour_ids=tuple(self.neighbours),
        )


class PassageRecord(Record):
    """What is known about a passage besides its line: metres in the map frame."""

    id: str
    at: Position
    width_m: FiniteFloat
    joins: tuple[str, str]

    @classmethod
    def facts_of(cls, door: Door) -> dict[str, object]:
        """Gives the fields of a door under their names in files."""
        return {
            "id": door.id,
            "at": position_of(door.place),
            "width_m": float(door.width_m),
            "joins": list(door.region_ids),
        }

    def to_door(self) -> Door:
        """Gives the door again."""
        return Door(id=self.id, place=Point(*self.at), width_m=self.width_m, region_ids=self.joins)


def position_of(point: Point) -> tuple[float, float]:
    """Gives x and y as files list them."""
    return float(point.x), float(point.y)


def polygon_from(rings: list[Ring]) -> Polygon:
    """Gives a polygon from rings that may run either way round, as other programs leave them."""
    outer, *holes = rings
    return Polygon(
        outer=outer if signed_area_m2(outer) > 0 else outer[::-1],
        holes=tuple(hole if signed_area_m2(hole) < 0 else hole[::-1] for hole in holes),
    )


def refusal_of(error: ValidationError, form: str) -> MapError:
    """Gives the first fault that was found in a file, with its place."""
    fault = error.errors()[0]
    place = ".".join(map(str, fault["loc"])) or "the whole of it"
    return MapError(
        f"This is no area graph as {form}: at {place!a}: {fault['msg']}.",
        hint=f"Write it anew with `{shell_command('map')}`, or mend that place.",
    )
