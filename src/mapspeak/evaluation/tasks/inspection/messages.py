"""Questions about what is published: maps, rates, silence, transforms, figures, stamps."""

from itertools import pairwise

from mapspeak.evaluation.inspected import (
    with_cut_transform,
    with_dead_stream,
    with_late_stream,
    with_late_transform,
)
from mapspeak.evaluation.inspected.contents import Fields
from mapspeak.evaluation.tasks.inspection.asking import (
    AskedInspection,
    Case,
    InspectionTask,
    one_of,
)
from mapspeak.evaluation.tasks.inspection.parts import InspectionPart, PartKind

__all__ = ["MESSAGE_TASKS"]

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
