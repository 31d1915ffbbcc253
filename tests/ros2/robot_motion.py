"""How the robot of the ROS 2 tests moves: straight at its goal, until there is a wall."""

import math

import numpy as np
from numpy.typing import NDArray

from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.spatial import OccupancyGrid

REACHED_M = 0.02
VELOCITY_HOLDS_S = 0.5
FULL_TURN_RAD = 2.0 * math.pi


class Motion:
    """Where the robot is, and the map it drives in; time passes in steps.

    Attributes:
        grid: The map.
        pose: Where the robot is, in the map frame.
        speed_mps: How fast it drives to goals.
        has_power: Whether the motors are on; without them it stands still, and nothing else.
    """

    def __init__(self, *, grid: OccupancyGrid, pose: Pose, speed_mps: float) -> None:
        self.grid = grid
        self.pose = pose
        self.speed_mps = speed_mps
        self.has_power = True
        self._velocity = (0.0, 0.0)
        self._velocity_ends_in_s = 0.0

    def approach(self, goal: Pose, step_s: float) -> bool:
        """Goes on towards a goal, and says whether the way was free."""
        if not self.has_power:
            return True
        here = self.pose.point
        bearing_rad = here.bearing_to(goal.point)
        step_m = min(self.speed_mps * step_s, here.distance_to(goal.point))
        if step_m < REACHED_M / 2.0:
            self.pose = goal
            return True
        ahead = Pose(here.x, here.y, bearing_rad) @ Pose(step_m, 0.0)
        return self._move_to(ahead)

    def has_reached(self, goal: Pose) -> bool:
        turn_rad = wrap_angle(self.pose.yaw_rad - goal.yaw_rad)
        return self.pose.point.distance_to(goal.point) < REACHED_M and abs(turn_rad) < 1e-6

    def take_velocity(self, forward_mps: float, turn_radps: float) -> None:
        self._velocity = (forward_mps, turn_radps)
        self._velocity_ends_in_s = VELOCITY_HOLDS_S

    def coast(self, step_s: float) -> None:
        """Follows the last velocity it was given, for a short while."""
        if self.has_power and self._velocity_ends_in_s > 0.0:
            self._velocity_ends_in_s -= step_s
            forward_mps, turn_radps = self._velocity
            self._move_to(self.pose @ Pose(forward_mps * step_s, 0.0, turn_radps * step_s))

    def _move_to(self, pose: Pose) -> bool:
        if not self.is_free(pose.point):
            return False
        self.pose = pose
        return True

    def is_free(self, point: Point) -> bool:
        cell = self.grid.cell_at(point)
        return self.grid.contains(cell) and bool(self.grid.free[cell.row, cell.col])

    def paint(self, cells: NDArray[np.int8], *, row: int, col: int) -> None:
        """Replaces a rectangle of the map."""
        n_rows, n_cols = cells.shape
        painted = self.grid.cells.copy()
        painted[row : row + n_rows, col : col + n_cols] = cells
        self.grid = OccupancyGrid(
            cells=painted, resolution_m=self.grid.resolution_m, origin=self.grid.origin
        )

    def scan(self, *, n_beams: int, range_m: float) -> list[float]:
        """Gives the distance to the first cell that is not free, all around from behind."""
        steps_m = np.arange(0.0, range_m, self.grid.resolution_m / 4.0)
        return [
            self._first_hit_m(-math.pi + beam * FULL_TURN_RAD / n_beams, steps_m)
            for beam in range(n_beams)
        ]

    def _first_hit_m(self, angle_rad: float, steps_m: NDArray[np.float64]) -> float:
        towards = self.pose.yaw_rad + angle_rad
        x = self.pose.x + steps_m * math.cos(towards)
        y = self.pose.y + steps_m * math.sin(towards)
        rows, cols = self.grid.cells_at(np.column_stack([x, y]))
        inside = self.grid.contains_cells(rows, cols)
        free = np.zeros(len(steps_m), dtype=bool)
        free[inside] = self.grid.free[rows[inside], cols[inside]]
        return math.inf if free.all() else float(steps_m[int(np.argmin(free))])
