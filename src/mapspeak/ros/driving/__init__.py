"""Sending goals to the robot's own navigation, in each of the ways robots take them."""

from mapspeak.ros.driving.driver import Driver, DrivingPatience
from mapspeak.ros.driving.goal_topic import GoalTopicDriver
from mapspeak.ros.driving.move_base import MOVE_BASE
from mapspeak.ros.driving.nav2 import NAV2
from mapspeak.ros.driving.navigating import ActionDriver
from mapspeak.ros.driving.record import GoalRecord

__all__ = [
    "MOVE_BASE",
    "NAV2",
    "ActionDriver",
    "Driver",
    "DrivingPatience",
    "GoalRecord",
    "GoalTopicDriver",
]
