"""The map picture: grey levels, metric grid with numbers, the robot's arrow, marks and areas."""

from mapspeak.spatial.picture.drawing import (
    EDGE_PX,
    MapPicture,
    draw_map,
    draw_map_axis,
    draw_map_plain,
    draw_robot_pose,
)
from mapspeak.spatial.picture.marks import (
    Colour,
    LegendEntry,
    LegendSample,
    Line,
    LineStyle,
    MapLayers,
    Mark,
    PictureRegion,
    RegionLayer,
    Shape,
    Zone,
)
from mapspeak.spatial.picture.plan import Zoom
from mapspeak.spatial.picture.transform import NORTH_UP_RAD, Box, PictureView, paper_spacing_m

__all__ = [
    "EDGE_PX",
    "NORTH_UP_RAD",
    "Box",
    "Colour",
    "LegendEntry",
    "LegendSample",
    "Line",
    "LineStyle",
    "MapLayers",
    "MapPicture",
    "Mark",
    "PictureRegion",
    "PictureView",
    "RegionLayer",
    "Shape",
    "Zone",
    "Zoom",
    "draw_map",
    "draw_map_axis",
    "draw_map_plain",
    "draw_robot_pose",
    "paper_spacing_m",
]
