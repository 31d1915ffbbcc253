"""The robot's skills besides driving: a battery and its dock, doors, a forklift, a voice.

The robot senses what is near, as by a beacon at a dock or the radio of a door: everything here uses
its true pose, and reveals no pose of the world.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.simulator.robot.physics import RobotBody
from mapspeak.simulator.worlds.world import World, WorldDoor, WorldObject

DOCK, PALLET, FORKLIFT = "charging_dock", "pallet", "forklift"
DOCK_REACH_M = 2.5
"""Range of a dock's beacon."""
DOOR_REACH_M = 1.8
PALLET_REACH_M = 1.8
"""From the robot's middle to that of a door or a pallet."""
STAND_OFF_M = 0.65
"""From a dock's back to the middle of a robot that stands at it."""
CONTACT_M, CONTACT_RAD = 0.2, 0.35
LIFTED_M = 1.0
DRIVING_HOURS, STANDING_HOURS, CHARGING_HOURS = 8.0, 24.0, 0.2
"""Endurance of a full battery when driving and standing, and time for a full charge."""


@dataclass(frozen=True, slots=True)
class Deed:
    """A completed action, kept for scoring."""

    skill: str
    what: str

    def __str__(self) -> str:
        """Return it in the format of the state log."""
        return f"{self.skill}: {self.what}"


class Equipment:
    """State of all equipment.

    Args:
        change: Called with the new world after something in it was moved.

    Attributes:
        charge_ratio: Of the battery.
        deeds: All completed actions, in order.
    """

    def __init__(self, world: World, body: RobotBody, change: Callable[[World], None]) -> None:
        self.charge_ratio = world.battery_ratio
        self.deeds: list[Deed] = []
        self._world = world
        self._body = body
        self._change = change
        self._n_faults_left = dict(world.n_faults)

    def pass_time(self, duration_s: float) -> None:
        """Drain the battery, or charge it if the robot is at a dock."""
        is_standing = self._body.velocity.speed_mps == 0
        hours = STANDING_HOURS if is_standing else DRIVING_HOURS
        if is_standing and self.dock_in_contact() is not None:
            hours = -CHARGING_HOURS
        ratio = self.charge_ratio - duration_s / (3600 * hours)
        self.charge_ratio = min(max(ratio, 0.0), 1.0)

    def has_fault(self, skill: str) -> bool:
        """Return True for the first uses of a skill that the world declares out of order."""
        n_left = self._n_faults_left.get(skill, 0)
        self._n_faults_left[skill] = max(n_left - 1, 0)
        if n_left:
            self.note(f"{skill} fault", f"{n_left - 1} left")
        return n_left > 0

    def note(self, skill: str, what: str) -> None:
        """Record a completed action."""
        self.deeds.append(Deed(skill, what))

    # --- the dock ---

    def dock_in_contact(self) -> WorldObject | None:
        """Return the dock whose contacts the robot touches."""
        here = self._body.world_from_base
        for dock in self._of_kind(DOCK):
            if _pose_at(dock).is_near(here, off_m=CONTACT_M, turn_rad=CONTACT_RAD):
                return dock
        return None

    def find_dock(self) -> Pose | None:
        """Return where to stand at the nearest dock in reach, in the robot's own frame."""
        dock = self._nearest(DOCK, DOCK_REACH_M)
        return None if dock is None else self._body.world_from_base.inverse() @ _pose_at(dock)

    # --- doors and pallets ---

    def find_shut_door(self) -> WorldDoor | None:
        """Return the nearest shut door in reach."""
        here = self._body.world_from_base.point
        shut = [door for door in self._world.doors if door.is_shut]
        near = [door for door in shut if door.pose.point.distance_to(here) <= DOOR_REACH_M]
        return min(near, key=lambda door: door.pose.point.distance_to(here), default=None)

    def open_door(self, door: WorldDoor) -> None:
        """Open a door: its leaf no longer blocks the way."""
        opened = replace(door, is_shut=False)
        doors = tuple(opened if each.name == door.name else each for each in self._world.doors)
        self._put(replace(self._world, doors=doors))

    def find_pallet(self, *, is_lifted: bool) -> WorldObject | None:
        """Return the nearest pallet in reach that is lifted, or is not, where a forklift is."""
        pallet = self._nearest(PALLET, PALLET_REACH_M, is_lifted=is_lifted)
        return pallet if self._of_kind(FORKLIFT) else None

    def lift(self, pallet: WorldObject, *, is_lifted: bool) -> None:
        """Let the forklift lift a pallet, or put it down."""
        moved = replace(pallet, base_height_m=LIFTED_M if is_lifted else None)
        things = (moved if each.name == pallet.name else each for each in self._world.objects)
        self._put(replace(self._world, objects=tuple(things)))

    def _put(self, world: World) -> None:
        self._world = world
        self._change(world)

    def _of_kind(self, kind: str) -> list[WorldObject]:
        return [thing for thing in self._world.objects if thing.kind == kind]

    def _nearest(self, kind: str, reach_m: float, *, is_lifted: bool = False) -> WorldObject | None:
        here = self._body.world_from_base.point
        away_m = {
            thing.name: thing.pose.point.distance_to(here)
            for thing in self._of_kind(kind)
            if (thing.base_height_m is not None) == is_lifted
        }
        near = [
            thing for thing in self._of_kind(kind) if away_m.get(thing.name, math.inf) <= reach_m
        ]
        return min(near, key=lambda thing: away_m[thing.name], default=None)


def _pose_at(dock: WorldObject) -> Pose:
    """Return where a robot stands at a dock, turned to it."""
    place = dock.pose.transform(Point(STAND_OFF_M, 0.0))
    return Pose(place.x, place.y, wrap_angle(dock.pose.yaw_rad + math.pi))
