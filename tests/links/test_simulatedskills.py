"""What the simulated robot can do besides driving, through the port of skills."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from mapspeak.geometry import Pose
from mapspeak.links.simulated import SoloRobot
from mapspeak.robot import GoalState, GoalStatus
from mapspeak.simulator import Simulation, StateRecord, World
from mapspeak.skill import JsonValue, SkillCode, SkillOutcome, SkillProgress, SkillState
from skilledworld import make_workshop

pytestmark = pytest.mark.anyio


@pytest.fixture
def workshop(tmp_path: Path) -> World:
    return make_workshop(tmp_path)


class Owner:
    """Runs skills of a robot and looks at the truth."""

    def __init__(self, world: World, start: Pose | None = None) -> None:
        self.simulation = Simulation(world, seed=1, start=start)
        self.robot = SoloRobot(self.simulation, has_detector=False)
        self.told: list[Mapping[str, JsonValue]] = []

    async def run(self, name: str, **arguments: JsonValue) -> SkillOutcome:
        skill = next(each for each in self.robot.build_skills(self.robot) if each.spec.name == name)
        return await skill.run(arguments, self.hear)

    def hear(self, progress: SkillProgress) -> None:
        self.told.append(progress.values)

    @property
    def deeds(self) -> tuple[str, ...]:
        return StateRecord.of(self.simulation).deeds


async def test_the_battery_drains_while_time_passes(workshop: World) -> None:
    owner = Owner(workshop)
    assert await owner.robot.fetch_battery() == pytest.approx(0.4)
    await owner.robot.sleep(60.0)
    drained = await owner.robot.fetch_battery()
    assert drained is not None
    assert 0.398 < drained < 0.4
    told = (await owner.run("read_battery")).outputs
    assert told["battery_percent"] == pytest.approx(100 * drained, abs=0.1)


async def test_an_empty_battery_ends_a_drive(workshop: World) -> None:
    owner = Owner(replace(workshop, battery_ratio=1e-5))
    goal = await owner.robot.send_goal(Pose(1.0, 0.0))
    await owner.robot.sleep(3.0)
    status = await owner.robot.fetch_goal_status(goal)
    assert status.state is GoalState.BLOCKED
    assert status.cause is not None
    assert status.cause.quote == "The battery is empty."


async def test_the_robot_docks_and_charges_until_it_is_full_enough(workshop: World) -> None:
    owner = Owner(workshop)
    outcome = await owner.run("dock", until_percent=60.0)
    assert outcome.state is SkillState.SUCCEEDED
    assert outcome.outputs["battery_percent"] >= 60.0
    assert owner.deeds == ("dock: dock",)
    assert owner.told[-1]["battery_percent"] > owner.told[0]["battery_percent"]
    assert owner.simulation.truth.n_collisions == 0


async def test_where_no_dock_is_near_nothing_is_docked(workshop: World) -> None:
    owner = Owner(workshop, Pose(5.0, 2.0))
    outcome = await owner.run("dock", until_percent=0.0)
    assert (outcome.state, outcome.code) == (SkillState.FAILED, SkillCode.NOT_ACHIEVED)
    assert owner.deeds == ()


async def test_a_shut_door_is_in_the_way_until_it_is_opened(workshop: World) -> None:
    owner = Owner(workshop, Pose(4.9, 1.5))
    assert owner.simulation.scan.ranges_m[360] == pytest.approx(6 - 0.025 - 4.9, abs=0.05)
    outcome = await owner.run("open_door")
    assert outcome.outputs == {"width_m": 1.1}
    assert owner.deeds == ("open_door: store door",)
    assert owner.simulation.scan.ranges_m[360] > 3.5
    assert (await owner.run("open_door")).code is SkillCode.NOT_ACHIEVED


async def test_a_shut_door_is_seen_and_bumped_into(workshop: World) -> None:
    shut = Simulation(workshop, seed=1, start=Pose(4.9, 1.5)).take_picture()
    opened = tuple(replace(door, is_shut=False) for door in workshop.doors)
    through = Simulation(replace(workshop, doors=opened), seed=1, start=Pose(4.9, 1.5))
    assert (shut != through.take_picture()).mean() > 0.2


async def test_the_forklift_lifts_a_pallet_and_puts_it_down(workshop: World) -> None:
    owner = Owner(workshop, Pose(2.4, 2.0))
    assert (await owner.run("lower_pallet")).state is SkillState.FAILED
    assert (await owner.run("lift_pallet")).state is SkillState.SUCCEEDED
    assert (await owner.run("lift_pallet")).state is SkillState.FAILED
    assert (await owner.run("lower_pallet")).state is SkillState.SUCCEEDED
    assert owner.deeds == ("lift_pallet: pallet", "lower_pallet: pallet")


async def test_what_is_said_is_kept_and_takes_its_time(workshop: World) -> None:
    owner = Owner(workshop)
    await owner.run("speak", text="The kettle is on the boil.")
    assert owner.deeds == ("speak: The kettle is on the boil.",)
    assert owner.robot.now_s > 1.0


async def test_a_skill_fails_as_often_as_the_world_says(workshop: World) -> None:
    owner = Owner(replace(workshop, n_faults={"speak": 2}))
    states = [(await owner.run("speak", text="Hello")).state for _ in range(3)]
    assert states == [SkillState.FAILED, SkillState.FAILED, SkillState.SUCCEEDED]
    assert owner.deeds[-1] == "speak: Hello"


class WaitingRobot(SoloRobot):
    """Takes a goal and waits before it begins to drive, as a guarded robot may."""

    n_looks = 0

    async def fetch_goal_status(self, robot_goal_id: str) -> GoalStatus:
        self.n_looks += 1
        if self.n_looks < 3:
            return GoalStatus(state=GoalState.ACCEPTED)
        return await super().fetch_goal_status(robot_goal_id)


async def test_docking_waits_for_a_drive_that_has_not_begun_yet(workshop: World) -> None:
    owner = Owner(workshop)
    owner.robot = WaitingRobot(owner.simulation, has_detector=False)
    outcome = await owner.run("dock", until_percent=0.0)
    assert outcome.state is SkillState.SUCCEEDED
