"""Sending goals to the robot's own navigation, in each of the ways robots take them."""

from mapspeak.links.ros.driving.driver import Driver, DrivingPatience
from mapspeak.links.ros.driving.goal_topic import GoalTopicDriver
from mapspeak.links.ros.driving.move_base import MOVE_BASE
from mapspeak.links.ros.driving.nav2 import NAV2
from mapspeak.links.ros.driving.navigating import ActionDriver
from mapspeak.links.ros.driving.record import GoalRecord

__all__ = [
    "MOVE_BASE",
    "NAV2",
    "ActionDriver",
    "Driver",
    "DrivingPatience",
    "GoalRecord",
    "GoalTopicDriver",
]
