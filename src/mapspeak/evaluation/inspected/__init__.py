"""A robot's ROS to be inspected: described as values, put out of order on purpose, and played.

The description is the truth of the questions that are asked of it. Nobody who inspects it sees
more than what a rosbridge server says on the wire.
"""

from mapspeak.evaluation.inspected.contents import (
    Beams,
    Cells,
    Content,
    Fields,
    Transform,
    Transforms,
)
from mapspeak.evaluation.inspected.drawing import Names, draw_names, draw_system
from mapspeak.evaluation.inspected.playing import (
    Hearing,
    InspectedSystem,
    OfferedService,
    Stream,
    play,
    with_cut_transform,
    with_dead_stream,
    with_late_stream,
    with_late_transform,
    with_lost_hearer,
    with_parameter,
    with_second_publisher,
    without_hearers,
    without_node,
)

__all__ = [
    "Beams",
    "Cells",
    "Content",
    "Fields",
    "Hearing",
    "InspectedSystem",
    "Names",
    "OfferedService",
    "Stream",
    "Transform",
    "Transforms",
    "draw_names",
    "draw_system",
    "play",
    "with_cut_transform",
    "with_dead_stream",
    "with_late_stream",
    "with_late_transform",
    "with_lost_hearer",
    "with_parameter",
    "with_second_publisher",
    "without_hearers",
    "without_node",
]
