"""How the robot of the ROS 2 tests moves: straight at its goal, until there is a wall."""

from faulty import AT_REST, Base, Faults
from mapspeak.geometry import Pose, wrap_angle
from mapspeak.spatial import OccupancyGrid

REACHED_M = 0.02


class Motion(Base):
    """Where the robot is, and the map it drives in; time passes in steps.

    Attributes:
        speed_mps: How fast it drives to goals.
        faults: What is wrong with the robot.
    """

    def __init__(
        self, grid: OccupancyGrid, *, pose: Pose, speed_mps: float, faults: Faults
    ) -> None:
        super().__init__(grid, pose=pose, faults=faults)
        self.speed_mps = speed_mps
        self.faults = faults

    def approach(self, goal: Pose, step_s: float) -> bool:
        """Go on towards a goal with no wheels in between, and say whether the way was free."""
        here = self.pose.point
        step_m = min(self.speed_mps * step_s, here.distance_to(goal.point))
        if step_m < REACHED_M / 2.0:
            return self.move_to(goal)
        bearing_rad = here.bearing_to(goal.point)
        return self.move_to(Pose(here.x, here.y, bearing_rad) @ Pose(step_m, 0.0))

    def pass_time(self, step_s: float, *, is_carried: bool) -> None:
        """Let time pass: the wheels follow velocities unless navigation carries the robot."""
        if is_carried:
            self.velocity = AT_REST
        self.move(step_s)

    def has_reached(self, goal: Pose) -> bool:
        turn_rad = wrap_angle(self.pose.yaw_rad - goal.yaw_rad)
        return self.pose.point.distance_to(goal.point) < REACHED_M and abs(turn_rad) < 1e-6
