"""A fake robot that loses its connection or its pose when a test says so."""

from dataclasses import replace

import anyio

from fakes import FakeRobot, two_rooms
from mapspeak.errors import LinkError
from mapspeak.geometry import Pose
from mapspeak.robot import GoalStatus, StampedPose

SLOWLY = 0.05


class FailingRobot(FakeRobot):
    """Loses one part after the other when a test says so; drives on meanwhile, slowly."""

    def __init__(self) -> None:
        super().__init__(two_rooms())
        self.is_reachable = True
        self.is_mute = False
        self.tells_pose = True
        self.has_map_pose = True
        self.is_clock_still = False
        self.frozen_s: float | None = None
        self.seen = StampedPose(self.pose, 0.0)

    def freeze_pose(self) -> None:
        """Goes on telling the present pose with its present stamp."""
        self.frozen_s = self.now_s
        self.seen = StampedPose(self.pose, self.now_s)

    async def fetch_pose(self) -> StampedPose:
        self._answer()
        if not self.tells_pose:
            raise LinkError("No transform has come.", hint="Check SLAM.")
        here = self.seen if self.frozen_s is not None else await super().fetch_pose()
        return replace(here, is_odometry=not self.has_map_pose, is_clock_still=self.is_clock_still)

    async def fetch_goal_status(self, robot_goal_id: str) -> GoalStatus:
        self._answer()
        if self.is_mute:
            await anyio.sleep_forever()
        return await super().fetch_goal_status(robot_goal_id)

    async def send_goal(self, goal: Pose) -> str:
        self._answer()
        return await super().send_goal(goal)

    async def cancel_goal(self, robot_goal_id: str) -> None:
        self._answer()
        await super().cancel_goal(robot_goal_id)

    async def stop(self) -> None:
        self._answer()
        await super().stop()

    def _answer(self) -> None:
        if not self.is_reachable:
            raise LinkError("There is no connection.", hint="Wait.")

    def _advance(self, duration_s: float) -> None:
        super()._advance(duration_s * SLOWLY)
