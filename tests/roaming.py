"""A simulated robot in a building drawn as text, on virtual time, with a session around it."""

from pathlib import Path

from causes import CRATE
from drawing import grid_from_text
from mapspeak.geometry import Pose
from mapspeak.links.simulated import SimulatedRobot
from mapspeak.memory import SemanticMapStore
from mapspeak.robot import GoalState, GoalStatus
from mapspeak.session import Session
from mapspeak.simulator import Simulation, World
from mapspeak.simulator.worlds.world import build_map_world

CELL_M = 0.25


def world_from_text(text: str, *, start: tuple[float, float]) -> World:
    """Builds a world from a drawing in cells of 0.25 m; the start is in metres, facing +x."""
    grid = grid_from_text(text, resolution_m=CELL_M)
    return build_map_world(grid, name="drawn", start=Pose(*start))


class RoamingRobot(SimulatedRobot):
    """A simulated robot whose navigation can be told to fail."""

    def __init__(self, world: World, *, seed: int = 1, has_detector: bool = False) -> None:
        self.simulation = Simulation(world, seed=seed)
        super().__init__(self.simulation, has_detector=has_detector)
        self.goals: list[Pose] = []
        self.n_to_fail = 0
        self._failed: set[str] = set()

    async def send_goal(self, goal: Pose) -> str:
        self.goals.append(goal)
        goal_id = await super().send_goal(goal)
        if self.n_to_fail:
            self.n_to_fail -= 1
            self._failed.add(goal_id)
            await super().cancel_goal(goal_id)
        return goal_id

    async def fetch_goal_status(self, robot_goal_id: str) -> GoalStatus:
        if robot_goal_id in self._failed:
            return GoalStatus(state=GoalState.BLOCKED, cause=CRATE)
        return await super().fetch_goal_status(robot_goal_id)


def session_of(robot: RoamingRobot, folder: Path) -> Session:
    """Gives a session over that robot, with its memory in that folder."""
    memory = SemanticMapStore(folder / "semantic_map.yaml")
    return Session(robot, memory, lease_s=60.0, find_model=lambda: None)
