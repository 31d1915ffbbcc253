"""A robot's ROS to be inspected: described as values, put out of order on purpose, and played.

The description is the truth of the questions that are asked of it. An agent that inspects it sees
only what a rosbridge server says on the wire.
"""

from mapspeak.evaluation.inspected.drawing import Names, draw_names, draw_system
from mapspeak.evaluation.inspected.playing import InspectedSystem, play

__all__ = ["InspectedSystem", "Names", "draw_names", "draw_system", "play"]
