"""The questions about a ROS: its graph, its messages, its transforms."""

from itertools import pairwise

from mapspeak.evaluation.inspected import (
    with_cut_transform,
    with_dead_stream,
    with_late_stream,
    with_late_transform,
    with_lost_hearer,
    with_parameter,
    with_second_publisher,
    without_hearers,
    without_node,
)
from mapspeak.evaluation.inspected.contents import Fields
from mapspeak.evaluation.tasks.inspecting import (
    AskedInspection,
    Case,
    InspectionPart,
    InspectionTask,
    PartKind,
    one_of,
    shuffled,
)
from mapspeak.ros.definitions.types import parse_definition

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
    """Return a node listens to a topic that nobody publishes."""
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


RATE_RATIO = 0.15
"""So far a rate may be off that was counted over some seconds."""
LAG_RATIO, LAG_S = 0.1, 1.5
"""A message and the time are asked for one after the other."""
LATE_S = 5.0
"""A transform with an older stamp is late."""
WHOLE, MISSING, LATE = "whole", "missing", "late"


def _ask_map(case: Case) -> AskedInspection:
    grid = case.grid
    return AskedInspection(
        text="Which topic carries the map of the whole building, of how many cells is it (along x "
        "and y), and how many metres is one cell wide?",
        form="/topic, 384 x 320, 0.05 m",
        parts=(
            InspectionPart(PartKind.NAME, case.names.map),
            InspectionPart(PartKind.SIZE, f"{grid.n_cols} x {grid.n_rows}"),
            InspectionPart(PartKind.NUMBER, f"{grid.resolution_m:g} m", 0.001),
        ),
        system=case.system,
    )


def _ask_rate(case: Case) -> AskedInspection:
    topic = case.names.scan
    rate_hz = case.system.stream_on(topic).rate_hz or 0.0
    return AskedInspection(
        text="On which topic does the laser scanner publish, and how many scans a second?",
        form="/topic, 7.5 Hz",
        parts=(
            InspectionPart(PartKind.NAME, topic),
            InspectionPart(PartKind.NUMBER, f"{rate_hz:g} Hz", RATE_RATIO * rate_hz),
        ),
        system=case.system,
    )


def _ask_silent(case: Case) -> AskedInspection:
    names = case.names
    sensors = (names.scan, names.imu_data, names.range, names.charge, names.joint_states, "/odom")
    topic = one_of(case.random, sensors)
    return AskedInspection(
        text="One of the robot's sensors has died: its node still runs, but nothing comes from it. "
        f"The sensors publish on {', '.join(sorted(sensors))}. Which topic is silent?",
        form="/topic",
        parts=(InspectionPart(PartKind.NAME, topic),),
        system=with_dead_stream(case.system, topic),
    )


def _ask_battery(case: Case) -> AskedInspection:
    content = case.system.stream_on(case.names.charge).content
    charge = content.values["percentage"] if isinstance(content, Fields) else 0.0
    least = int(case.random.integers(15, 46))
    # A limit that is just the charge would ask which way to round.
    least += 2 if abs(100 * charge - least) < 2 else 0
    return AskedInspection(
        text="How full is the battery, in percent? And should the robot go and charge, which it "
        f"has to do below {least} %, or stay?",
        form="80 %, stay - or ANSWER: 5 %, charge",
        parts=(
            InspectionPart(PartKind.NUMBER, f"{100 * charge:.0f} %", 1.0),
            InspectionPart(PartKind.WORD, "charge" if 100 * charge < least else "stay"),
        ),
        system=case.system,
    )


def _ask_clock(case: Case) -> AskedInspection:
    names = case.names
    topic = one_of(
        case.random, (names.imu_data, names.range, names.charge, names.joint_states, "/odom")
    )
    lag_s = float(case.random.integers(8, 90))
    return AskedInspection(
        text="The clock of one sensor is behind: the stamps of its messages are older than they "
        f"should be. The sensors publish on {names.charge}, {names.imu_data}, "
        f"{names.joint_states}, /odom and {names.range}. On which topic are the stamps late, and "
        "by how many seconds of the robot's time?",
        form="/topic, 12.5 s",
        parts=(
            InspectionPart(PartKind.NAME, topic),
            InspectionPart(PartKind.NUMBER, f"{lag_s:g} s", LAG_S + LAG_RATIO * lag_s),
        ),
        system=with_late_stream(case.system, topic, lag_s),
    )


def _ask_transform(case: Case) -> AskedInspection:
    names = case.names
    chain = ("map", "odom", names.base_frame, "body", names.laser_frame)
    links = list(pairwise(chain))
    faults = [(MISSING, link) for link in links] + [(LATE, link) for link in links[:2]]
    # One time in seven there is nothing to be found.
    number = int(case.random.integers(len(faults) + 1))
    text = (
        f"Transforms should lead from map to {names.laser_frame}: {', '.join(chain)}. Is the chain "
        f"whole, or is one of its links missing, or stamped more than {LATE_S:g} s in the past? "
        "Those that never change are published once."
    )
    form = "map -> odom, missing - or ANSWER: map -> odom, late - or ANSWER: whole"
    if number == len(faults):
        parts = (InspectionPart(PartKind.WORD, WHOLE),)
        return AskedInspection(text=text, form=form, parts=parts, system=case.system)
    kind, (parent, child) = faults[number]
    lag_s = float(case.random.integers(20, 90))
    return AskedInspection(
        text=text,
        form=form,
        parts=(
            InspectionPart(PartKind.LINK, f"{parent} -> {child}"),
            InspectionPart(PartKind.WORD, kind),
        ),
        system=with_cut_transform(case.system, child)
        if kind == MISSING
        else with_late_transform(case.system, child, lag_s),
    )


MESSAGE_TASKS = (
    InspectionTask("inspect-map", _ask_map),
    InspectionTask("inspect-rate", _ask_rate),
    InspectionTask("inspect-silent", _ask_silent),
    InspectionTask("inspect-transform", _ask_transform),
    InspectionTask("inspect-battery", _ask_battery),
    InspectionTask("inspect-clock", _ask_clock),
)
