"""The robot's body in the true world: it moves, and what is solid stops it."""

from mapspeak.geometry import Point, Pose
from mapspeak.simulator.motion import (
    BODY_RADIUS_M,
    DifferentialDrive,
    Velocity,
    move_along_arc,
)
from mapspeak.simulator.slices import Slice

__all__ = ["RobotBody"]

_APART_M = 0.05
"""Before the robot is this far from a thing again, pushing at it is no new collision."""
_NEAR_M = 1.0
"""What is farther away than this touches no body in the next steps."""


class RobotBody:
    """A round body on two driven wheels.

    Attributes:
        world_from_base: Where it truly stands.
        n_collisions: How often it has bumped into something.
        driven_m: How far its centre has moved.
    """

    def __init__(self, solids: Slice, start: Pose) -> None:
        self.world_from_base = start
        self.n_collisions = 0
        self.driven_m = 0.0
        self._solids = solids
        self._near = solids.near(start.point, reach_m=2 * _NEAR_M)
        self._near_from = start.point
        self._drive = DifferentialDrive()
        self._is_touching = False

    @property
    def velocity(self) -> Velocity:
        """How it moves now."""
        return self._drive.velocity

    def move(self, command: Velocity, duration_s: float) -> Pose:
        """Moves for a moment and gives the step it took, in its frame before the step."""
        before = self.world_from_base
        velocity = self._drive.follow(command, duration_s)
        wanted = move_along_arc(before, velocity, duration_s)
        room_m = self._room_m_at(wanted.point)
        if velocity.speed_mps and room_m < 0:
            self._bump()
            wanted = Pose(before.x, before.y, wanted.yaw_rad)
        elif room_m > _APART_M:
            self._is_touching = False
        self.world_from_base = wanted
        self.driven_m += before.point.distance_to(wanted.point)
        return before.inverse() @ wanted

    def _room_m_at(self, point: Point) -> float:
        """Gives how far the body's edge would be from what is near; more than that, if nothing is.

        Most of a world is far away, and is not looked at in every step.
        """
        if point.distance_to(self._near_from) > _NEAR_M:
            self._near = self._solids.near(point, reach_m=2 * _NEAR_M)
            self._near_from = point
        return self._near.distance_to(point) - BODY_RADIUS_M

    def _bump(self) -> None:
        """Stops; a robot that keeps pushing against the same thing has bumped once."""
        if not self._is_touching:
            self.n_collisions += 1
        self._is_touching = True
        self._drive.halt()
