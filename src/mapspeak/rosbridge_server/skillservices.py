"""The skills of a robot as services of its ROS, and its battery as a topic.

A skill that takes nothing is a `std_srvs/Trigger`; any other has a type of its own, such as
`robot_skills/Speak`, whose request has its parameters. The message of an answer is why the skill
failed, or as JSON what it gave.
"""

import json
from collections.abc import Sequence
from functools import partial

from mapspeak.errors import MapspeakError
from mapspeak.ros.messages.fields import Dialect, Message, write_header
from mapspeak.rosbridge_server.interfaces import RosSystem, Values
from mapspeak.rosbridge_server.navigation import BASE_FRAME
from mapspeak.skill import ParameterKind, Skill, SkillProgress, SkillState

PACKAGE, NODE = "robot_skills", "/robot_skills"
BATTERY_TOPIC, BATTERY_TYPE = "/battery_state", "sensor_msgs/BatteryState"
TRIGGER, RESPONSE = "std_srvs/Trigger", "bool success\nstring message"
WRITTEN = {
    ParameterKind.NUMBER: "float64",
    ParameterKind.WHOLE: "int64",
    ParameterKind.TEXT: "string",
    ParameterKind.FLAG: "bool",
}
CHARGING, DISCHARGING, GOOD, LITHIUM_ION = 1, 2, 1, 2


def types_of(skills: Sequence[Skill]) -> dict[str, str]:
    """Return the texts of all types that skills need, by "package/Type_Part"."""
    texts: dict[str, str] = {}
    for skill in skills:
        if not skill.spec.parameters:
            continue
        fields = (f"{WRITTEN[each.kind]} {each.name}" for each in skill.spec.parameters)
        texts[f"{_type_of(skill)}_Request"] = "\n".join(fields)
        texts[f"{_type_of(skill)}_Response"] = RESPONSE
    return texts


def offer_skills(system: RosSystem, skills: Sequence[Skill]) -> None:
    """Offer each skill as a service."""
    for skill in skills:
        system.offer_typed(
            f"{NODE}/{skill.spec.name}",
            _type_of(skill),
            node=NODE,
            answer=partial(_answer, skill),
        )


def write_battery(ratio: float, stamp_s: float, *, dialect: Dialect) -> Message:
    """Return a battery's message."""
    return {
        "header": write_header(BASE_FRAME, stamp_s, dialect=dialect),
        "voltage": round(20.0 + 5.2 * ratio, 2),
        "percentage": ratio,
        "power_supply_status": DISCHARGING,
        "power_supply_health": GOOD,
        "power_supply_technology": LITHIUM_ION,
        "present": True,
    }


def _type_of(skill: Skill) -> str:
    if not skill.spec.parameters:
        return TRIGGER
    return f"{PACKAGE}/{skill.spec.name.title().replace('_', '')}"


async def _answer(skill: Skill, request: Values) -> Values:
    try:
        outcome = await skill.run(request, _hear)
    except MapspeakError as error:
        return {"success": False, "message": str(error)}
    given = json.dumps(dict(outcome.outputs)) if outcome.outputs else outcome.code.value
    is_done = outcome.state is SkillState.SUCCEEDED
    return {"success": is_done, "message": outcome.quote or given}


def _hear(_progress: SkillProgress) -> None:
    """Take no note: a service tells nothing on its way."""
