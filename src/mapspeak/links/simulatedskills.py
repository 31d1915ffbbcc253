"""The simulated robot's skills besides driving: dock, doors, pallets, speech."""

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import anyio

from mapspeak.geometry import Pose
from mapspeak.robot import GoalState, Robot
from mapspeak.simulator import Equipment
from mapspeak.skill import (
    Arguments,
    OnProgress,
    Schema,
    Skill,
    SkillCode,
    SkillEffect,
    SkillOutcome,
    SkillProgress,
    SkillSpec,
    parameter,
)

if TYPE_CHECKING:
    from mapspeak.links.simulated import SimulatedRobot

DOOR_S, LIFT_S, LETTERS_PER_S = 2.0, 6.0, 15.0
"""How long a door and a forklift take, and how fast the robot speaks."""
LOOK_S = 0.5
MOST_LETTERS = 300

Doing = Callable[["Hands", Arguments, OnProgress], Awaitable[SkillOutcome]]


@dataclass(frozen=True, slots=True)
class Hands:
    """The context of a skill.

    Attributes:
        driven: Where goals are sent.
        equipment: The state of the things that the robot can use.
    """

    robot: "SimulatedRobot"
    driven: Robot
    equipment: Equipment


def build_skills(robot: "SimulatedRobot", driven: Robot, equipment: Equipment) -> tuple[Skill, ...]:
    """Return all skills of a simulated robot; the first runs fail that the world says do."""
    hands = Hands(robot, driven, equipment)

    async def run(
        spec: SkillSpec, doing: Doing, given: Arguments, on_progress: OnProgress
    ) -> SkillOutcome:
        if await robot.compute(partial(equipment.has_fault, spec.name)):
            return SkillOutcome(SkillCode.ABORTED, quote="The device reports a fault.")
        return await doing(hands, given, on_progress)

    return tuple(Skill(spec, partial(run, spec, doing)) for spec, doing in _SKILLS)


async def _dock(hands: Hands, given: Arguments, on_progress: OnProgress) -> SkillOutcome:
    """Drive onto a dock that is near, and stay until the battery is as full as asked for."""
    robot, equipment = hands.robot, hands.equipment
    place = await robot.compute(equipment.find_dock)
    if place is None:
        return SkillOutcome(SkillCode.NOT_ACHIEVED, quote="No dock answers within 2.5 m.")
    if await robot.compute(equipment.dock_in_contact) is None:
        goal = (await robot.fetch_pose()).pose @ place
        if await _drive(hands.driven, goal) is not GoalState.ARRIVED:
            return SkillOutcome(SkillCode.ABORTED, quote="The way onto the dock is blocked.")
    dock = await robot.compute(equipment.dock_in_contact)
    if dock is None:
        return SkillOutcome(SkillCode.NOT_ACHIEVED, quote="The contacts of the dock do not touch.")
    await robot.compute(partial(equipment.note, "dock", dock.name))
    wanted = given["until_percent"] / 100
    while (charge := equipment.charge_ratio) < wanted:
        on_progress(SkillProgress(values={"battery_percent": round(100 * charge, 1)}))
        await robot.sleep(LOOK_S)
        if await robot.compute(equipment.dock_in_contact) is None:
            return SkillOutcome(SkillCode.ABORTED, quote="The robot has left the dock.")
    return SkillOutcome(outputs={"battery_percent": round(100 * charge, 1)})


async def _drive(robot: Robot, goal: Pose) -> GoalState:
    goal_id = await robot.send_goal(goal)
    state = GoalState.ACCEPTED
    try:
        while not state.is_final:
            await robot.sleep(LOOK_S)
            state = (await robot.fetch_goal_status(goal_id)).state
    finally:
        if not state.is_final:
            with anyio.CancelScope(shield=True):
                await robot.cancel_goal(goal_id)
    return state


async def _open_door(hands: Hands, _given: Arguments, _told: OnProgress) -> SkillOutcome:
    robot, equipment = hands.robot, hands.equipment
    door = await robot.compute(equipment.find_shut_door)
    if door is None:
        return SkillOutcome(SkillCode.NOT_ACHIEVED, quote="No shut door answers within 1.8 m.")
    await robot.sleep(DOOR_S)
    await robot.compute(partial(equipment.open_door, door))
    await robot.compute(partial(equipment.note, "open_door", door.name))
    return SkillOutcome(outputs={"width_m": door.width_m})


async def _move_pallet(
    hands: Hands, _given: Arguments, _told: OnProgress, *, is_lifted: bool
) -> SkillOutcome:
    robot, equipment = hands.robot, hands.equipment
    skill = "lift_pallet" if is_lifted else "lower_pallet"
    pallet = await robot.compute(partial(equipment.find_pallet, is_lifted=not is_lifted))
    if pallet is None:
        which = "on the floor" if is_lifted else "that is lifted"
        return SkillOutcome(
            SkillCode.NOT_ACHIEVED,
            quote=f"No pallet {which} is within 1.8 m, or there is no forklift.",
        )
    await robot.sleep(LIFT_S)
    await robot.compute(partial(equipment.lift, pallet, is_lifted=is_lifted))
    await robot.compute(partial(equipment.note, skill, pallet.name))
    return SkillOutcome()


async def _speak(hands: Hands, given: Arguments, _told: OnProgress) -> SkillOutcome:
    await hands.robot.sleep(len(given["text"]) / LETTERS_PER_S)
    await hands.robot.compute(partial(hands.equipment.note, "speak", given["text"]))
    return SkillOutcome()


async def _read_battery(hands: Hands, _given: Arguments, _told: OnProgress) -> SkillOutcome:
    return SkillOutcome(outputs={"battery_percent": round(100 * hands.equipment.charge_ratio, 1)})


_UNTIL = parameter(
    "number",
    description="stay until the battery is so full",
    unit="%",
    minimum=0.0,
    maximum=100.0,
    default=0.0,
)
_TEXT = parameter("string", description="what to say", maxLength=MOST_LETTERS, required=True)


def _spec(
    name: str,
    description: str,
    effect: SkillEffect = SkillEffect.CHANGES,
    timeout_s: float = 60.0,
    **parameters: Schema,
) -> SkillSpec:
    return SkillSpec(name, description, effect, timeout_s=timeout_s, parameters=parameters)


_MOVES, _CHANGES, _READS = SkillEffect.MOVES, SkillEffect.CHANGES, SkillEffect.READS
_DOCK = "Drive onto a charging dock within 2.5 m, and charge there."
_LIFT = "Have the forklift lift the pallet within 1.8 m."
_LOWER = "Have the forklift put down the lifted pallet within 1.8 m."
_SPEAK = "Say something aloud where the robot stands."
_SKILLS: tuple[tuple[SkillSpec, Doing], ...] = (
    (_spec("dock", _DOCK, _MOVES, 1200.0, until_percent=_UNTIL), _dock),
    (_spec("open_door", "Open the nearest shut door within 1.8 m."), _open_door),
    (_spec("lift_pallet", _LIFT), partial(_move_pallet, is_lifted=True)),
    (_spec("lower_pallet", _LOWER), partial(_move_pallet, is_lifted=False)),
    (_spec("speak", _SPEAK, _CHANGES, text=_TEXT), _speak),
    (_spec("read_battery", "Tell how full the battery is.", _READS), _read_battery),
)
