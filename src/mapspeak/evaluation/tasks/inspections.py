"""The questions about a ROS: its graph, its messages, its transforms."""

from dataclasses import replace
from itertools import pairwise

from mapspeak.evaluation.tasks.inspecting import (
    Case,
    InspectionPart,
    PartKind,
    inspection_task,
)
from mapspeak.evaluation.trials import Setting
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


def _ask_velocity(case: Case) -> Setting:
    topic, system = case.names.velocity, case.system
    return case.ask(
        f"Which node sends velocities on {topic}, and which node drives the motors by them?",
        "/sender, /driver",
        (_name(*system.publishers_of(topic)), _name(*system.subscribers_of(topic))),
        system,
    )


def _ask_fight(case: Case) -> Setting:
    """Let two nodes publish velocities for the motors."""
    names = case.names
    intruder = case.draw.one_of((names.joystick, names.navigator, names.device, names.watcher))
    second = replace(case.system.stream_on(names.velocity), node=intruder)
    system = replace(case.system, streams=(*case.system.streams, second))
    return case.ask(
        "The robot jerks to and fro as if two drivers held its wheel. Which two nodes both "
        "send velocities to the motors?",
        "/one, /other",
        tuple(_name(node) for node in system.publishers_of(names.velocity)),
        system,
        is_ordered=False,
    )


def _ask_unheard(case: Case) -> Setting:
    names = case.names
    topics = (names.imu_data, names.range, names.charge, names.joint_states, names.status, "/plan")
    topic = case.draw.one_of(topics)
    left = {
        node: {each: kind for each, kind in wanted.items() if each != topic}
        for node, wanted in case.system.subscriptions.items()
    }
    return case.ask(
        "One topic is published and no node hears it. Which one?",
        "/topic",
        (_name(topic),),
        replace(case.system, subscriptions=left),
    )


def _ask_missing(case: Case) -> Setting:
    names = case.names
    node, topic = case.draw.one_of(
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
    launched = ", ".join(case.draw.shuffled(case.system.nodes))
    return case.ask(
        f"The robot's launch file starts the nodes {launched}. One of them is not running. "
        "Which one, and which topic do others wait for in vain for want of it?",
        "/node, /topic",
        (_name(node), _name(topic)),
        case.system.without_node(node),
    )


def _ask_remap(case: Case) -> Setting:
    """Let a node subscribe to a topic without a publisher."""
    names = case.names
    node = case.draw.one_of((names.locator, names.navigator))
    wrong = case.draw.one_of((f"{names.scan}_filtered", f"/robot{names.scan}", "/laser_scan"))
    wanted = dict(case.system.subscriptions[node])
    wanted[wrong] = wanted.pop(names.scan)
    return case.ask(
        f"The laser scanner works, yet {node} gets no scans. On which topic does it wait for "
        "them, and on which do they come?",
        "/waits_here, /they_come_here",
        (_name(wrong), _name(names.scan)),
        replace(case.system, subscriptions={**case.system.subscriptions, node: wanted}),
    )


def _ask_parameter(case: Case) -> Setting:
    node = case.names.navigator
    right = case.system.parameters[node]
    numbers = {name: value for name, value in right.items() if isinstance(value, float)}
    wrong = case.draw.one_of(tuple(numbers))
    value = round(numbers[wrong] * case.draw.one_of(OFF_BY), 3)
    parameters = {**case.system.parameters, node: {**right, wrong: value}}
    sheet = ", ".join(f"{name} {numbers[name]:g}" for name in case.draw.shuffled((*numbers,)))
    return case.ask(
        f"By the robot's data sheet the parameters of {node} are: {sheet}. One of them is set "
        "otherwise. Which one, and to what?",
        "parameter, 0.5",
        (_name(wrong), _number(f"{value:g}", 0.001 * abs(value))),
        replace(case.system, parameters=parameters),
    )


def _ask_service(case: Case) -> Setting:
    offered = case.draw.one_of(case.system.services)
    last = offered.service.removeprefix(offered.node)
    deed = next(deed for word, deed in DEEDS.items() if word in last)
    return case.ask(
        f"Which service {deed}, and of what type is it?",
        "/node/service, package/srv/Type",
        (_name(offered.service), InspectionPart(PartKind.TYPE, offered.type)),
    )


def _ask_type(case: Case) -> Setting:
    names = case.names
    fields = parse_definition(names.device_type, case.system.types[names.device_type]).fields
    kind = case.draw.one_of(fields).type
    return case.ask(
        f"Which fields of the messages on {names.status} are of the type {kind}?",
        "field, field",
        tuple(_name(field.name) for field in fields if field.type == kind),
        is_ordered=False,
    )


RATE_RATIO = 0.15
"""So far a rate may be off that was counted over some seconds."""
LAG_RATIO, LAG_S = 0.1, 1.5
"""A message and the time are asked for one after the other."""
LATE_S = 5.0
"""A transform with an older stamp is late."""
WHOLE, MISSING, LATE = "whole", "missing", "late"


def _ask_map(case: Case) -> Setting:
    grid = case.grid
    return case.ask(
        "Which topic carries the map of the whole building, of how many cells is it (along x "
        "and y), and how many metres is one cell wide?",
        "/topic, 384 x 320, 0.05 m",
        (
            _name(case.names.map),
            InspectionPart(PartKind.SIZE, f"{grid.n_cols} x {grid.n_rows}"),
            _number(f"{grid.resolution_m:g} m", 0.001),
        ),
    )


def _ask_rate(case: Case) -> Setting:
    topic = case.names.scan
    rate_hz = case.system.stream_on(topic).rate_hz or 0.0
    return case.ask(
        "On which topic does the laser scanner publish, and how many scans a second?",
        "/topic, 7.5 Hz",
        (
            _name(topic),
            _number(f"{rate_hz:g} Hz", RATE_RATIO * rate_hz),
        ),
    )


def _ask_silent(case: Case) -> Setting:
    names = case.names
    sensors = (names.scan, names.imu_data, names.range, names.charge, names.joint_states, "/odom")
    topic = case.draw.one_of(sensors)
    return case.ask(
        "One of the robot's sensors has died: its node still runs, but nothing comes from it. "
        f"The sensors publish on {', '.join(sorted(sensors))}. Which topic is silent?",
        "/topic",
        (_name(topic),),
        case.system.with_stream(case.system.stream_on(topic), rate_hz=0.0),
    )


def _ask_battery(case: Case) -> Setting:
    charge = case.system.stream_on(case.names.charge).values["percentage"]
    least = int(case.draw.random.integers(15, 46))
    # A limit that is just the charge would ask which way to round.
    least += 2 if abs(100 * charge - least) < 2 else 0
    return case.ask(
        "How full is the battery, in percent? And should the robot go and charge, which it "
        f"has to do below {least} %, or stay?",
        "80 %, stay - or ANSWER: 5 %, charge",
        (
            _number(f"{100 * charge:.0f} %", 1.0),
            InspectionPart(PartKind.WORD, "charge" if 100 * charge < least else "stay"),
        ),
    )


def _ask_clock(case: Case) -> Setting:
    names = case.names
    topic = case.draw.one_of(
        (names.imu_data, names.range, names.charge, names.joint_states, "/odom")
    )
    lag_s = float(case.draw.random.integers(8, 90))
    return case.ask(
        "The clock of one sensor is behind: the stamps of its messages are older than they "
        f"should be. The sensors publish on {names.charge}, {names.imu_data}, "
        f"{names.joint_states}, /odom and {names.range}. On which topic are the stamps late, and "
        "by how many seconds of the robot's time?",
        "/topic, 12.5 s",
        (
            _name(topic),
            _number(f"{lag_s:g} s", LAG_S + LAG_RATIO * lag_s),
        ),
        case.system.with_stream(case.system.stream_on(topic), lag_s=lag_s),
    )


def _ask_transform(case: Case) -> Setting:
    names = case.names
    chain = ("map", "odom", names.base_frame, "body", names.laser_frame)
    links = list(pairwise(chain))
    faults = [(MISSING, link) for link in links] + [(LATE, link) for link in links[:2]]
    # One time in seven there is nothing to be found.
    number = int(case.draw.random.integers(len(faults) + 1))
    text = (
        f"Transforms should lead from map to {names.laser_frame}: {', '.join(chain)}. Is the chain "
        f"whole, or is one of its links missing, or stamped more than {LATE_S:g} s in the past? "
        "Those that never change are published once."
    )
    form = "map -> odom, missing - or ANSWER: map -> odom, late - or ANSWER: whole"
    if number == len(faults):
        return case.ask(text, form, (InspectionPart(PartKind.WORD, WHOLE),))
    kind, (parent, child) = faults[number]
    lag_s = float(case.draw.random.integers(20, 90))
    stream = case.system.stream_to(child)
    changes: dict[str, object] = {"lag_s": lag_s}
    if kind == MISSING:
        # Those that are told together with it are left.
        left = tuple(each for each in stream.transforms if each.child != child)
        changes = {"transforms": left} if left else {"rate_hz": 0.0}
    parts = (
        InspectionPart(PartKind.LINK, f"{parent} -> {child}"),
        InspectionPart(PartKind.WORD, kind),
    )
    return case.ask(text, form, parts, case.system.with_stream(stream, **changes))


def _name(name: str) -> InspectionPart:
    return InspectionPart(PartKind.NAME, name)


def _number(said: str, tolerance: float) -> InspectionPart:
    return InspectionPart(PartKind.NUMBER, said, tolerance)


INSPECTION_TASKS = tuple(
    inspection_task(f"inspect-{name}", ask)
    for name, ask in (
        ("velocity", _ask_velocity),
        ("fight", _ask_fight),
        ("unheard", _ask_unheard),
        ("missing", _ask_missing),
        ("remap", _ask_remap),
        ("parameter", _ask_parameter),
        ("service", _ask_service),
        ("type", _ask_type),
        ("map", _ask_map),
        ("rate", _ask_rate),
        ("silent", _ask_silent),
        ("transform", _ask_transform),
        ("battery", _ask_battery),
        ("clock", _ask_clock),
    )
)
