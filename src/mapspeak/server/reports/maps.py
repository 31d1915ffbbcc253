"""What all reports share, and a map file as facts, for programs and people, without a robot."""

import math
from typing import Self

from pydantic import BaseModel, ConfigDict, Field

from mapspeak.geometry import Point, Pose
from mapspeak.server.text.world.maps import say_map_warning, say_size
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.areagraph import AreaGraph, Passage
from mapspeak.spatial.coverage import measure_known_area
from mapspeak.spatial.mapfiles import LoadedMap
from mapspeak.spatial.rooms import Region


class Report(BaseModel):
    """Base of all reports: frozen."""

    model_config = ConfigDict(frozen=True)


class PoseReport(Report):
    """A pose in the map frame."""

    x: float = Field(description="metres")
    y: float = Field(description="metres")
    yaw_deg: float = Field(description="counter-clockwise from +x")

    @classmethod
    def of(cls, pose: Pose) -> Self:
        """Make the report of a pose, rounded to millimetres and tenths of a degree."""
        return cls(
            x=round(pose.x, 3) + 0.0,
            y=round(pose.y, 3) + 0.0,
            yaw_deg=round(math.degrees(pose.yaw_rad), 1) + 0.0,
        )


class PointFacts(Report):
    """A point in the map frame."""

    x: float = Field(description="metres")
    y: float = Field(description="metres")

    @classmethod
    def of(cls, point: Point) -> Self:
        """Make it from a point."""
        return cls(x=round(point.x, 3), y=round(point.y, 3))


class RegionFacts(Report):
    """A room, a corridor or an open space."""

    id: str
    label: int = Field(description="its number in the label picture")
    kind: str
    reason: str = Field(description="why it is of that kind")
    floor_area_m2: float = Field(description="with what stands on it")
    free_area_m2: float = Field(description="where nothing stands")
    length_m: float
    width_m: float
    heading_deg: float = Field(description="direction of the longer side")
    centre: PointFacts = Field(description="the floor point farthest from walls")
    clearance_m: float = Field(description="from there to the nearest wall")
    doors: list[str]
    neighbours: list[str]

    @classmethod
    def of(cls, region: Region) -> Self:
        """Make it from a region."""
        return cls(
            id=region.id,
            label=region.index,
            kind=str(region.room_class),
            reason=say_size(region),
            floor_area_m2=round(region.floor_area_m2, 2),
            free_area_m2=round(region.free_area_m2, 2),
            length_m=round(region.length_m, 2),
            width_m=round(region.width_m, 2),
            heading_deg=round(math.degrees(region.heading_rad), 1),
            centre=PointFacts.of(region.widest),
            clearance_m=round(region.clearance_m, 2),
            doors=list(region.door_ids),
            neighbours=list(region.neighbour_ids),
        )


class DoorFacts(Report):
    """A door or opening."""

    id: str
    at: PointFacts
    width_m: float = Field(description="where nothing stands")
    line: tuple[PointFacts, PointFacts] | None = Field(
        description="from post to post; none when its regions do not touch on the map"
    )
    joins: tuple[str, str]

    @classmethod
    def of(cls, passage: Passage) -> Self:
        """Make it from a passage of the area graph."""
        door, line = passage.door, passage.line
        ends = None if line is None else (PointFacts.of(line[0]), PointFacts.of(line[1]))
        return cls(
            id=door.id,
            at=PointFacts.of(door.place),
            width_m=round(door.width_m, 2),
            line=ends,
            joins=door.region_ids,
        )


class MapFacts(Report):
    """Everything that is said about a map file; outlines are in the area graph's own files."""

    name: str
    n_rows: int
    n_cols: int
    resolution_m: float
    origin: PoseReport = Field(description="of the outer corner of the lower left cell")
    width_m: float
    height_m: float
    free_area_m2: float
    occupied_area_m2: float
    unknown_ratio: float
    open_border_m: float = Field(description="where free floor meets the unknown")
    regions: list[RegionFacts] = Field(description="smallest floor first")
    doors: list[DoorFacts]
    warnings: list[str]

    @classmethod
    def of(cls, loaded: LoadedMap, graph: AreaGraph) -> Self:
        """Make the facts of a map file and the area graph found on it."""
        grid: OccupancyGrid = loaded.grid
        known = measure_known_area(grid)
        regions = [area.region for area in graph.areas]
        by_size = sorted(regions, key=lambda region: region.floor_area_m2)
        return cls(
            name=graph.name,
            n_rows=grid.n_rows,
            n_cols=grid.n_cols,
            resolution_m=grid.resolution_m,
            origin=PoseReport.of(grid.origin),
            width_m=round(grid.width_m, 3),
            height_m=round(grid.height_m, 3),
            free_area_m2=round(known.free_area_m2, 2),
            occupied_area_m2=round(known.occupied_area_m2, 2),
            unknown_ratio=round(1 - known.known_ratio, 4),
            open_border_m=round(known.open_border_m, 2),
            regions=[RegionFacts.of(region) for region in by_size],
            doors=[DoorFacts.of(passage) for passage in graph.passages],
            warnings=[say_map_warning(warning) for warning in loaded.warnings],
        )
