"""A ROS as rosbridge's operations find it: message types, services, and the skills of its robot.

A skill that takes nothing is a `std_srvs/Trigger`; any other has a type of its own, such as
`robot_skills/Speak`, whose request has its parameters. The message of an answer is why the skill
failed, or as JSON what it gave.
"""

import json
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any

import anyio.abc

from mapspeak.errors import LinkError, MapspeakError
from mapspeak.ros.definitions.checking import check_message
from mapspeak.ros.definitions.texts import GENERATED, known_definitions, write_definition
from mapspeak.ros.definitions.types import FLOATS, WHOLES, Field, TypeBook, name_in_ros2
from mapspeak.ros.messages.fields import Dialect, Message, bare_type, write_header
from mapspeak.rosbridge_server.hub import ROSBRIDGE_NODE, Hub
from mapspeak.rosbridge_server.navigation import BASE_FRAME, Nav2
from mapspeak.skill import Skill, SkillProgress, SkillState

ROS2_DISTRIBUTION = "jazzy"

NO_MORE: Mapping[str, str] = MappingProxyType({})
Values = dict[str, Any]
Answer = Callable[[Values], Values | Awaitable[Values]]


class Interfaces:
    """The message types of one dialect.

    Args:
        more: The texts of types besides those that come with mapspeak, by "package/Type".
    """

    def __init__(self, dialect: Dialect, *, more: Mapping[str, str] = NO_MORE) -> None:
        self._dialect = dialect
        self._book = TypeBook({**known_definitions(dialect, distro=ROS2_DISTRIBUTION), **more})
        self._fixed_arrays: dict[str, bool] = {}

    @property
    def names(self) -> list[str]:
        """All messages, services and actions, as this ROS writes their names."""
        return sorted({GENERATED.sub("", self.said(name)) for name in self._book.texts})

    def said(self, name: str) -> str:
        """Return a type's name as this ROS writes it; keep a name without a package."""
        is_said = "/" not in name or self._dialect is Dialect.ROS1
        return name if is_said else name_in_ros2(name)

    def knows(self, name: str) -> bool:
        """Return True for a type that is described here, however its name is written."""
        return self._book.knows(name)

    def has_fixed_array(self, name: str) -> bool:
        """Return True when a list of fixed length is somewhere within."""
        bare = bare_type(name)
        if bare not in self._fixed_arrays:
            self._fixed_arrays[bare] = any(
                field.length
                for each in self._book.within(bare)
                for field in self._book[each].fields
            )
        return self._fixed_arrays[bare]

    def full_text(self, name: str) -> str:
        """Return a type's definition and those of all types within, as `gendeps --cat` does."""
        return write_definition(self._book.texts, self._book.within(name))

    def details(self, name: str) -> list[dict[str, object]]:
        """Return rosapi's message_details of a type and of all types within."""
        return [self._detail(each) for each in self._book.within(name)]

    def fill(self, name: str, message: object) -> dict[str, Any]:
        """Return a client's message with all fields; those left out hold their defaults.

        Raises:
            LinkError: A field is not of that type, or its value does not fit.
        """
        if self._dialect is Dialect.ROS1:
            message = _with_own_times(message)
        return self._book.fill(name, check_message(self._book, name, message))

    def _detail(self, name: str) -> dict[str, object]:
        message = self._book[name]
        return {
            "type": self.said(name),
            "fieldnames": [each.name for each in message.fields],
            "fieldtypes": [self.said(each.type) for each in message.fields],
            "fieldarraylen": [
                -1 if each.length is None else each.length for each in message.fields
            ],
            "examples": [_example(each) for each in message.fields],
            "constnames": list(message.constants),
            "constvalues": list(message.constants.values()),
        }


def _example(field: Field) -> str:
    if field.length is not None:
        return "[]"
    if field.type in FLOATS:
        return "0.0"
    if field.type in WHOLES:
        return "0"
    return {"string": "", "bool": "False"}.get(field.type, "{}")


def _with_own_times(message: Any) -> Any:  # noqa: ANN401 - ROS JSON
    """Return a message in which each stamp in the words of ROS 2 is silently replaced."""
    if isinstance(message, list):
        return [_with_own_times(each) for each in message]
    if not isinstance(message, Mapping):
        return message
    if {"sec", "nanosec"} & message.keys():
        return {"secs": 0, "nsecs": 0}
    return {name: _with_own_times(value) for name, value in message.items()}


LONGEST_COMPLAINT = 1000
LOGGED_ERROR = 8
"""rosgraph_msgs/Log.ERROR."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Service:
    """One service; without a function it never answers."""

    name: str
    type: str
    node: str
    answer: Answer | None


class RosSystem:
    """The ROS system that clients find.

    Attributes:
        hub: Its topics; on ROS 1 /rosout is one of them.
        nav2: The navigation of ROS 2; None where there is none.
    """

    def __init__(self, hub: Hub, interfaces: Interfaces, *, dialect: Dialect) -> None:
        self.dialect = dialect
        self.hub = hub
        self.interfaces = interfaces
        self.nav2: Nav2 | None = None
        self._services: dict[str, Service] = {}

    @property
    def services(self) -> list[Service]:
        """The services by name."""
        return sorted(self._services.values(), key=lambda service: service.name)

    def offer(self, name: str, type_name: str, *, node: str, answer: Answer | None) -> None:
        """Offer one more service."""
        self._services[name] = Service(name=name, type=type_name, node=node, answer=answer)

    def withdraw(self, name: str) -> None:
        """Withdraw a service; do nothing for one that is not offered."""
        self._services.pop(name, None)

    def offer_typed(self, name: str, type_name: str, *, node: str, answer: Answer) -> None:
        """Offer one more service, whose requests get all their fields before it answers."""
        request = f"{type_name}_Request"
        self.offer(
            name,
            type_name,
            node=node,
            answer=lambda values: answer(self.interfaces.fill(request, values)),
        )

    def find_service(self, name: str) -> Service | None:
        """Find a service; a leading slash may be missing."""
        return self._services.get(f"/{name.strip('/')}")

    async def keep_going(self, *, task_status: anyio.abc.TaskStatus[None]) -> None:
        """Run its own activity until cancelled: this one does nothing."""
        task_status.started()

    def complain(self, text: str) -> None:
        """Report a faulty operation where rosbridge does: on ROS 1, to /rosout."""
        if self.dialect is Dialect.ROS1:
            said = text[:LONGEST_COMPLAINT].encode(errors="replace").decode()
            entry = {"level": LOGGED_ERROR, "name": ROSBRIDGE_NODE, "msg": said}
            self.hub.publish("/rosout", self.interfaces.fill("rosgraph_msgs/Log", entry))


def refusal(error: MapspeakError) -> str:
    """Return the text of an error as rosbridge answers it."""
    return error.message if isinstance(error, LinkError) else str(error)


PACKAGE, NODE = "robot_skills", "/robot_skills"
BATTERY_TOPIC, BATTERY_TYPE = "/battery_state", "sensor_msgs/BatteryState"
TRIGGER, RESPONSE = "std_srvs/Trigger", "bool success\nstring message"
WRITTEN = {"number": "float64", "integer": "int64", "string": "string", "boolean": "bool"}
CHARGING, DISCHARGING, GOOD, LITHIUM_ION = 1, 2, 1, 2


def types_of(skills: Sequence[Skill]) -> dict[str, str]:
    """Return the texts of all types that skills need, by "package/Type_Part"."""
    texts: dict[str, str] = {}
    for skill in skills:
        if not skill.spec.parameters:
            continue
        takes = skill.spec.parameters.items()
        fields = (f"{WRITTEN[schema['type']]} {name}" for name, schema in takes)
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
