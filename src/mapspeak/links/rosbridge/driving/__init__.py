"""Sending goals to the robot's own navigation, in each of the ways robots take them."""

from mapspeak.links.rosbridge.driving.driver import Driver, DrivingPatience
from mapspeak.links.rosbridge.driving.goal_topic import GoalTopicDriver
from mapspeak.links.rosbridge.driving.move_base import MoveBaseDriver
from mapspeak.links.rosbridge.driving.nav2 import Nav2Driver
from mapspeak.links.rosbridge.driving.record import GoalRecord

__all__ = [
    "Driver",
    "DrivingPatience",
    "GoalRecord",
    "GoalTopicDriver",
    "MoveBaseDriver",
    "Nav2Driver",
]
