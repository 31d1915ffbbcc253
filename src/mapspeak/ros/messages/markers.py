"""Markers that RViz and Foxglove draw over a map, as messages of visualization_msgs."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from mapspeak.geometry import Pose
from mapspeak.ros.messages.fields import LATEST_S, Dialect, write_header
from mapspeak.ros.messages.poses import write_pose

MARKER_ARRAY = "visualization_msgs/MarkerArray"
ADD, DELETE_ALL = 0, 3
ORIGIN = Pose(0.0, 0.0)


class MarkShape(IntEnum):
    """Shapes, as visualization_msgs/Marker numbers them."""

    ARROW = 0
    CYLINDER = 3
    LINE = 4
    POINTS = 8
    TEXT = 9


SCALES = {
    MarkShape.ARROW: (1.0, 0.2, 0.2),
    MarkShape.CYLINDER: (1.0, 1.0, 0.1),
    MarkShape.LINE: (1.0, 0.0, 0.0),
    MarkShape.POINTS: (1.0, 1.0, 0.0),
    MarkShape.TEXT: (0.0, 0.0, 1.0),
}
"""The three numbers of a scale, as multiples of the size."""
HEIGHT_M = 0.05
"""Above the floor, so that the map does not hide it; texts are over the rest."""
TEXT_HEIGHT_M = 0.3


@dataclass(frozen=True, slots=True, kw_only=True)
class Marker:
    """One thing to draw in the map frame.

    Attributes:
        group: The name of marks shown and hidden together, such as "rooms".
        size_m: How wide a line, a point or a disc is; how high a text; how long an arrow.
        colour: Red, green, blue and opacity, each from 0 to 1.
        points: Of a line, or single ones.
    """

    group: str
    shape: MarkShape
    size_m: float
    colour: tuple[float, float, float, float]
    pose: Pose = ORIGIN
    points: Sequence[tuple[float, float]] = ()
    text: str = ""


def write_markers(marks: Sequence[Marker], *, frame_id: str, dialect: Dialect) -> dict[str, Any]:
    """Write visualization_msgs/MarkerArray, in place of all that was drawn before."""
    # Things on a map stay where they are.
    header = write_header(frame_id, LATEST_S, dialect=dialect)
    erase = {"header": header, "ns": "", "id": 0, "type": 0, "action": DELETE_ALL}
    written = (_write(mark, number, header) for number, mark in enumerate(marks, start=1))
    return {"markers": [erase, *written]}


def _write(mark: Marker, number: int, header: dict[str, Any]) -> dict[str, Any]:
    pose = write_pose(mark.pose)
    pose["position"]["z"] = TEXT_HEIGHT_M if mark.shape is MarkShape.TEXT else HEIGHT_M
    return {
        "header": header,
        "ns": mark.group,
        "id": number,
        "type": int(mark.shape),
        "action": ADD,
        "pose": pose,
        "scale": dict(zip("xyz", (mark.size_m * part for part in SCALES[mark.shape]), strict=True)),
        "color": dict(zip("rgba", map(float, mark.colour), strict=True)),
        "points": [{"x": float(x), "y": float(y), "z": 0.0} for x, y in mark.points],
        "text": mark.text,
    }
