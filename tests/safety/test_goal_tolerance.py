"""Legs for a navigation that is content near its goal, as Nav2 is within 0.25 m by default."""

from pathlib import Path

import numpy as np
import pytest

from fakes import FakeRobot
from guarding import audit_of, corners, make_guard, rectangle
from mapspeak.geometry import Point, Pose
from mapspeak.robot import GoalState
from mapspeak.safety import AreaRule, GuardedRobot, MapReviser, Policy
from mapspeak.safety.monitor import KEEP_M
from mapspeak.spatial import OccupancyGrid
from mapspeak.worldmodel.keepout import ClosedArea

pytestmark = pytest.mark.anyio

TOLERANCE_M = 0.25
SLOWER = 0.4
"""Than the fake robot's metre a second."""
RADIUS_M = 0.2


def hall(*, wall_from_m: float = 8.0) -> OccupancyGrid:
    """Gives a hall of 12 m by 8 m, with a wall above a height."""
    cells = np.zeros((160, 240), dtype=np.int8)
    cells[round(wall_from_m / 0.05) :] = 100
    return OccupancyGrid(cells=cells, resolution_m=0.05, origin=Pose(0.0, 0.0))


class ContentRobot(FakeRobot):
    """Stops and calls it arrived as soon as it is near its goal; stands still for a nearer one."""

    async def send_goal(self, goal: Pose) -> str:
        goal_id = await super().send_goal(goal)
        self._be_content()
        return goal_id

    def _advance(self, duration_s: float) -> None:
        steps = max(round(duration_s / 0.02), 1)
        for _ in range(steps):
            super()._advance(SLOWER * duration_s / steps)
            self._be_content()

    def _be_content(self) -> None:
        if self._current is not None:
            left_m = self.pose.point.distance_to(self.goals[self._current].point)
            if left_m <= TOLERANCE_M:
                self._end(GoalState.ARRIVED)


PIT = rectangle("pit", (4.0, 2.0), (6.0, 4.0))
U_TURN = AreaRule(
    name="fence",
    outline=corners((4.0, 0.0), (4.2, 5.0)),
)
CASES = {
    "past a block": (PIT, Pose(2.0, 3.0), Pose(9.0, 3.0), 8.0),
    "round its corner": (PIT, Pose(5.0, 1.5), Pose(6.6, 3.0), 8.0),
    "close round a fence": (U_TURN, Pose(3.5, 4.0), Pose(4.75, 4.0), 8.0),
    "round a fence": (U_TURN, Pose(3.0, 1.0), Pose(5.2, 1.0), 8.0),
    "to beside it": (PIT, Pose(2.0, 3.0), Pose(6.4, 3.9), 8.0),
    "from beside it": (PIT, Pose(3.6, 3.9), Pose(9.0, 3.0), 8.0),
    "between it and a wall": (PIT, Pose(2.0, 3.0), Pose(9.0, 3.0), 4.75),
    "between a fence and a wall": (U_TURN, Pose(3.0, 1.0), Pose(5.2, 1.0), 5.75),
}


@pytest.mark.parametrize("case", CASES)
async def test_a_robot_that_ends_each_leg_early_still_gets_round_and_keeps_off(
    tmp_path: Path, case: str
) -> None:
    rule, start, goal, wall_m = CASES[case]
    fake = ContentRobot(hall(wall_from_m=wall_m), pose=start)
    guard = make_guard(tmp_path, Policy(areas=(rule,)))
    robot = GuardedRobot(
        fake, guard=guard, reviser=MapReviser((rule,), wall_clock=guard.wall_clock)
    )
    area = ClosedArea(name="", outline=rule.outline)
    goal_id = await robot.send_goal(goal)
    nearest_m = 99.0
    for _ in range(900):
        status = await robot.fetch_goal_status(goal_id)
        if status.state.is_final:
            break
        nearest_m = min(nearest_m, area.distance_to(fake.pose.point))
        await robot.sleep(0.1)
    assert (status.state, status.cause) == (GoalState.ARRIVED, None)
    assert fake.pose.point.distance_to(Point(goal.x, goal.y)) <= TOLERANCE_M
    assert nearest_m >= RADIUS_M + KEEP_M
    assert [line.event for line in audit_of(tmp_path)].count("leg") <= 12
