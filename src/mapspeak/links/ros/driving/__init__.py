"""Sending goals to the robot's own navigation, in each of the ways robots take them."""

from mapspeak.links.ros.driving.driver import Driver, DrivingPatience
from mapspeak.links.ros.driving.goal_topic import GoalTopicDriver
from mapspeak.links.ros.driving.move_base import MoveBaseDriver
from mapspeak.links.ros.driving.nav2 import Nav2Driver
from mapspeak.links.ros.driving.record import GoalRecord

__all__ = [
    "Driver",
    "DrivingPatience",
    "GoalRecord",
    "GoalTopicDriver",
    "MoveBaseDriver",
    "Nav2Driver",
]
