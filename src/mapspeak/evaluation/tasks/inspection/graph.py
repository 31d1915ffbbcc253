"""Questions about who does what: nodes, topics, services, parameters, types."""

from mapspeak.evaluation.inspected import (
    with_lost_hearer,
    with_parameter,
    with_second_publisher,
    without_hearers,
    without_node,
)
from mapspeak.evaluation.tasks.inspection.asking import (
    AskedInspection,
    Case,
    InspectionTask,
    one_of,
    shuffled,
)
from mapspeak.evaluation.tasks.inspection.parts import InspectionPart, PartKind
from mapspeak.ros.definitions import parse_definition

__all__ = ["GRAPH_TASKS"]

OFF_BY = (0.4, 0.5, 2.0, 3.0)
DEEDS = {
    "odom": "sets the odometry back to zero",
    "motor": "switches the motors on or off",
    "costmap": "empties the costmap",
    "map": "writes the map to the disk",
    "imu": "calibrates the inertial unit",
}
"""What services do, by a word that is in their names and in none but theirs."""


def _ask_velocity(case: Case) -> AskedInspection:
    topic, system = case.names.velocity, case.system
    return AskedInspection(
        text=f"Which node sends velocities on {topic}, and which node drives the motors by them?",
        form="/sender, /driver",
        parts=(_name(*system.publishers_of(topic)), _name(*system.hearers_of(topic))),
        system=system,
    )


def _ask_fight(case: Case) -> AskedInspection:
    """Two nodes publish velocities for the motors."""
    names = case.names
    intruder = one_of(case.random, (names.joystick, names.navigator, names.device, names.watcher))
    system = with_second_publisher(case.system, names.velocity, intruder)
    return AskedInspection(
        text="The robot jerks to and fro as if two drivers held its wheel. Which two nodes both "
        "send velocities to the motors?",
        form="/one, /other",
        parts=tuple(_name(node) for node in system.publishers_of(names.velocity)),
        system=system,
        is_ordered=False,
    )


def _ask_unheard(case: Case) -> AskedInspection:
    names = case.names
    topics = (names.imu_data, names.range, names.charge, names.joint_states, names.status, "/plan")
    topic = one_of(case.random, topics)
    return AskedInspection(
        text="One topic is published and no node hears it. Which one?",
        form="/topic",
        parts=(_name(topic),),
        system=without_hearers(case.system, topic),
    )


def _ask_missing(case: Case) -> AskedInspection:
    names = case.names
    node, topic = one_of(
        case.random,
        (
            (names.laser, names.scan),
            (names.imu, names.imu_data),
            (names.sonar, names.range),
            (names.battery, names.charge),
            (names.joints, names.joint_states),
            (names.device, names.status),
            (names.joystick, "/joy"),
            (names.map_server, names.map),
        ),
    )
    launched = ", ".join(shuffled(case.random, case.system.nodes))
    return AskedInspection(
        text=f"The robot's launch file starts the nodes {launched}. One of them is not running. "
        "Which one, and which topic do others wait for in vain for want of it?",
        form="/node, /topic",
        parts=(_name(node), _name(topic)),
        system=without_node(case.system, node),
    )


def _ask_remap(case: Case) -> AskedInspection:
    """A node listens to a topic that nobody publishes."""
    names = case.names
    node = one_of(case.random, (names.locator, names.navigator))
    wrong = one_of(case.random, (f"{names.scan}_filtered", f"/robot{names.scan}", "/laser_scan"))
    return AskedInspection(
        text=f"The laser scanner works, yet {node} gets no scans. On which topic does it wait for "
        "them, and on which do they come?",
        form="/waits_here, /they_come_here",
        parts=(_name(wrong), _name(names.scan)),
        system=with_lost_hearer(case.system, node, names.scan, wrong),
    )


def _ask_parameter(case: Case) -> AskedInspection:
    node = case.names.navigator
    right = case.system.parameters[node]
    numbers = {name: value for name, value in right.items() if isinstance(value, float)}
    wrong = one_of(case.random, tuple(numbers))
    value = round(numbers[wrong] * one_of(case.random, OFF_BY), 3)
    sheet = ", ".join(f"{name} {numbers[name]:g}" for name in shuffled(case.random, (*numbers,)))
    return AskedInspection(
        text=f"By the robot's data sheet the parameters of {node} are: {sheet}. One of them is set "
        "otherwise. Which one, and to what?",
        form="parameter, 0.5",
        parts=(_name(wrong), InspectionPart(PartKind.NUMBER, f"{value:g}", 0.001 * abs(value))),
        system=with_parameter(case.system, node, wrong, value),
    )


def _ask_service(case: Case) -> AskedInspection:
    offered = one_of(case.random, case.system.services)
    last = offered.service.removeprefix(offered.node)
    deed = next(deed for word, deed in DEEDS.items() if word in last)
    return AskedInspection(
        text=f"Which service {deed}, and of what type is it?",
        form="/node/service, package/srv/Type",
        parts=(_name(offered.service), InspectionPart(PartKind.TYPE, offered.type)),
        system=case.system,
    )


def _ask_type(case: Case) -> AskedInspection:
    names, random = case.names, case.random
    fields = parse_definition(names.device_type, case.system.types[names.device_type]).fields
    kind = one_of(random, fields).type
    return AskedInspection(
        text=f"Which fields of the messages on {names.status} are of the type {kind}?",
        form="field, field",
        parts=tuple(_name(field.name) for field in fields if field.type == kind),
        system=case.system,
        is_ordered=False,
    )


def _name(name: str) -> InspectionPart:
    return InspectionPart(PartKind.NAME, name)


GRAPH_TASKS = (
    InspectionTask("inspect-velocity", _ask_velocity),
    InspectionTask("inspect-fight", _ask_fight),
    InspectionTask("inspect-unheard", _ask_unheard),
    InspectionTask("inspect-missing", _ask_missing),
    InspectionTask("inspect-remap", _ask_remap),
    InspectionTask("inspect-parameter", _ask_parameter),
    InspectionTask("inspect-service", _ask_service),
    InspectionTask("inspect-type", _ask_type),
)
