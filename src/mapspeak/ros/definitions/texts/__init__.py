"""Definitions that come with mapspeak, as their files in ROS say, without the remarks.

Each begins with a line of its kind and name; `---` parts a service and an action.
"""

from mapspeak.ros.definitions.texts.actions import ACTIONS
from mapspeak.ros.definitions.texts.geometry import GEOMETRY
from mapspeak.ros.definitions.texts.navigation import NAVIGATION
from mapspeak.ros.definitions.texts.parameters import PARAMETERS
from mapspeak.ros.definitions.texts.rosapi import ROSAPI
from mapspeak.ros.definitions.texts.sensors import SENSORS
from mapspeak.ros.definitions.texts.standard import STANDARD

__all__ = ["ACTIONS", "GEOMETRY", "NAVIGATION", "PARAMETERS", "ROSAPI", "SENSORS", "STANDARD"]
