"""The faults and the figures that questions about a ROS ask for; `inspections.yaml` words them."""

from dataclasses import replace
from functools import partial
from itertools import pairwise

from mapspeak.evaluation.tasks.inspecting import AnswerPart, Case, inspection_task
from mapspeak.evaluation.trials import Setting
from mapspeak.ros.definitions.types import parse_definition

OFF_BY = (0.4, 0.5, 2.0, 3.0)
RATE_RATIO = 0.15
"""Tolerance of a rate counted over some seconds."""
LAG_RATIO, LAG_S = 0.1, 1.5
"""A message and the time are asked for one after the other."""
LATE_S = 5.0
"""A transform with an older stamp is late."""
WHOLE, MISSING, LATE = "whole", "missing", "late"


def _names(*names: str) -> list[AnswerPart]:
    return [AnswerPart(name) for name in names]


def _velocity(case: Case) -> Setting:
    topic, system = case.names.velocity, case.system
    return case.ask(*_names(*system.publishers_of(topic), *system.subscribers_of(topic)))


def _fight(case: Case) -> Setting:
    """Let two nodes publish velocities for the motors."""
    names = case.names
    intruder = case.draw.one_of((names.joystick, names.navigator, names.device, names.watcher))
    second = replace(case.system.stream_on(names.velocity), node=intruder)
    system = replace(case.system, streams=(*case.system.streams, second))
    both = system.publishers_of(names.velocity)
    return case.ask(*_names(*both), system=system, is_ordered=False)


def _unheard(case: Case) -> Setting:
    names = case.names
    topics = (names.imu_data, names.range, names.charge, names.joint_states, names.status, "/plan")
    topic = case.draw.one_of(topics)
    left = {
        node: {each: kind for each, kind in wanted.items() if each != topic}
        for node, wanted in case.system.subscriptions.items()
    }
    return case.ask(AnswerPart(topic), system=replace(case.system, subscriptions=left))


def _missing(case: Case) -> Setting:
    parts = (
        *("laser scan", "imu imu_data", "sonar range", "battery charge", "joints joint_states"),
        *("device status", "joystick", "map_server map"),
    )
    node, _, topic = case.draw.one_of(parts).partition(" ")
    node, topic = getattr(case.names, node), getattr(case.names, topic, "/joy")
    launched = ", ".join(case.draw.shuffled(case.system.nodes))
    return case.ask(*_names(node, topic), system=case.system.without_node(node), launched=launched)


def _remap(case: Case) -> Setting:
    """Let a node subscribe to a topic without a publisher."""
    names = case.names
    node = case.draw.one_of((names.locator, names.navigator))
    wrong = case.draw.one_of((f"{names.scan}_filtered", f"/robot{names.scan}", "/laser_scan"))
    wanted = dict(case.system.subscriptions[node])
    wanted[wrong] = wanted.pop(names.scan)
    subscriptions = {**case.system.subscriptions, node: wanted}
    system = replace(case.system, subscriptions=subscriptions)
    return case.ask(*_names(wrong, names.scan), system=system, node=node)


def _parameter(case: Case) -> Setting:
    node = case.names.navigator
    right = case.system.parameters[node]
    numbers = {name: value for name, value in right.items() if isinstance(value, float)}
    wrong = case.draw.one_of(tuple(numbers))
    value = round(numbers[wrong] * case.draw.one_of(OFF_BY), 3)
    system = replace(
        case.system, parameters={**case.system.parameters, node: {**right, wrong: value}}
    )
    sheet = ", ".join(f"{name} {numbers[name]:g}" for name in case.draw.shuffled((*numbers,)))
    set_to = AnswerPart(f"{value:g}", 0.001 * abs(value))
    return case.ask(AnswerPart(wrong), set_to, system=system, sheet=sheet)


def _service(case: Case) -> Setting:
    offered = case.draw.one_of(case.system.services)
    return case.ask(*_names(offered.service, offered.type), deed=offered.deed)


def _type(case: Case) -> Setting:
    own = case.names.device_type
    fields = parse_definition(own, case.system.types[own]).fields
    kind = case.draw.one_of(fields).type
    named = _names(*(field.name for field in fields if field.type == kind))
    return case.ask(*named, is_ordered=False, kind=kind)


def _map(case: Case) -> Setting:
    grid = case.grid
    cell_size = AnswerPart(f"{grid.resolution_m:g} m", 0.001)
    return case.ask(*_names(case.names.map, f"{grid.n_cols} x {grid.n_rows}"), cell_size)


def _rate(case: Case) -> Setting:
    topic = case.names.scan
    rate_hz = case.system.stream_on(topic).rate_hz or 0.0
    return case.ask(AnswerPart(topic), AnswerPart(f"{rate_hz:g} Hz", RATE_RATIO * rate_hz))


def _silent(case: Case) -> Setting:
    names = case.names
    sensors = (names.scan, names.imu_data, names.range, names.charge, names.joint_states, "/odom")
    topic = case.draw.one_of(sensors)
    system = case.system.with_stream(case.system.stream_on(topic), rate_hz=0.0)
    return case.ask(AnswerPart(topic), system=system, sensors=", ".join(sorted(sensors)))


def _battery(case: Case) -> Setting:
    percent = 100 * case.system.stream_on(case.names.charge).values["percentage"]
    least = int(case.draw.random.integers(15, 46))
    # A limit that is just the charge would ask which way to round.
    least += 2 if abs(percent - least) < 2 else 0
    advice = AnswerPart("charge" if percent < least else "stay")
    return case.ask(AnswerPart(f"{percent:.0f} %", 1.0), advice, least=least)


def _clock(case: Case) -> Setting:
    names = case.names
    sensors = (names.imu_data, names.range, names.charge, names.joint_states, "/odom")
    topic = case.draw.one_of(sensors)
    lag_s = float(case.draw.random.integers(8, 90))
    system = case.system.with_stream(case.system.stream_on(topic), lag_s=lag_s)
    lag = AnswerPart(f"{lag_s:g} s", LAG_S + LAG_RATIO * lag_s)
    return case.ask(AnswerPart(topic), lag, system=system)


def _transform(case: Case) -> Setting:
    chain = ("map", "odom", case.names.base_frame, "body", case.names.laser_frame)
    ask = partial(case.ask, chain=", ".join(chain), late_s=f"{LATE_S:g}")
    links = list(pairwise(chain))
    faults = [(MISSING, link) for link in links] + [(LATE, link) for link in links[:2]]
    # One time in seven there is nothing to be found.
    number = int(case.draw.random.integers(len(faults) + 1))
    if number == len(faults):
        return ask(AnswerPart(WHOLE))
    kind, (parent, child) = faults[number]
    lag_s = float(case.draw.random.integers(20, 90))
    stream = case.system.stream_to(child)
    changes: dict[str, object] = {"lag_s": lag_s}
    if kind == MISSING:
        # Those that are told together with it are left.
        left = tuple(each for each in stream.transforms if each.child != child)
        changes = {"transforms": left} if left else {"rate_hz": 0.0}
    system = case.system.with_stream(stream, **changes)
    return ask(*_names(f"{parent} -> {child}", kind), system=system)


_QUESTIONS = (
    *(_velocity, _fight, _unheard, _missing, _remap, _parameter, _service, _type),
    *(_map, _rate, _silent, _transform, _battery, _clock),
)
INSPECTION_TASKS = tuple(inspection_task(ask.__name__.removeprefix("_"), ask) for ask in _QUESTIONS)
