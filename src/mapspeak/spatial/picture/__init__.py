"""The map picture: grey levels, metric grid with numbers, the robot's arrow, marks and areas."""

from mapspeak.spatial.picture.drawing import MapLayers, MapPicture, draw_map
from mapspeak.spatial.picture.marks import (
    LegendEntry,
    Line,
    LineStyle,
    Mark,
    Region,
    RegionLayer,
    Sample,
    Shape,
    Zone,
)
from mapspeak.spatial.picture.palette import Colour
from mapspeak.spatial.picture.paper import (
    draw_map_axis,
    draw_map_plain,
    draw_robot_pose,
    grey_levels,
)
from mapspeak.spatial.picture.plan import Zoom
from mapspeak.spatial.picture.spacing import paper_spacing_m
from mapspeak.spatial.picture.view import NORTH_UP_RAD, Box, Pixel, View

__all__ = [
    "NORTH_UP_RAD",
    "Box",
    "Colour",
    "LegendEntry",
    "Line",
    "LineStyle",
    "MapLayers",
    "MapPicture",
    "Mark",
    "Pixel",
    "Region",
    "RegionLayer",
    "Sample",
    "Shape",
    "View",
    "Zone",
    "Zoom",
    "draw_map",
    "draw_map_axis",
    "draw_map_plain",
    "draw_robot_pose",
    "grey_levels",
    "paper_spacing_m",
]
