"""Questions about a ROS: the faults and figures they ask for, and how answers are judged.

`inspections.yaml` words them.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from importlib import resources
from itertools import pairwise
from string import Template
from typing import Any

from ruamel.yaml import YAML

from mapspeak.evaluation.inspected import InspectedSystem, Names, draw_names, draw_system
from mapspeak.evaluation.scores.groundtruth import GroundTruth
from mapspeak.evaluation.scores.judging import Evidence, no_answer, read_said, verdict
from mapspeak.evaluation.tasks.task import NO_DRIVING, Draw, Task, Truth
from mapspeak.evaluation.trials import Failure, Limits, Score, Setting
from mapspeak.ros.definitions.types import parse_definition
from mapspeak.ros.messages.fields import Dialect
from mapspeak.spatial import OccupancyGrid

QUOTES = " \t'\"`*"
NUMBER = re.compile(r"([-+]?\d+(?:\.\d+)?)\s*(?:%|percent|Hz|m|s|seconds?|met(?:re|er)s?)?")
SIZE = re.compile(r"(\d+)\s*(?:x|\u00d7|by)\s*(\d+)(?:\s*cells)?")
LINK = re.compile(r"(\S+)\s*(?:->|\u2192|\bto\b)\s*(\S+)")
KIND = re.compile(r"/(?:msg|srv|action)/")


@dataclass(frozen=True, slots=True)
class AnswerPart:
    """One part of a right answer: a name, a type, a word, a size, a link or a number.

    Attributes:
        tolerance: Tolerance of a number, in its own unit; None if it is not a number.
    """

    said: str
    tolerance: float | None = None

    def fits(self, said: str) -> bool:
        """Return True when something said is right."""
        if self.tolerance is None:
            return _plain(said) == _plain(self.said)
        ours, theirs = NUMBER.fullmatch(self.said), NUMBER.fullmatch(said)
        if ours is None or theirs is None:
            return False
        return abs(float(ours[1]) - float(theirs[1])) <= self.tolerance


def _plain(said: str) -> list[str]:
    """Return words without what may be written in several ways.

    Leading slashes of names may be missing, types are written as either ROS does, and a size and a
    link are two words with a sign between them.
    """
    text = KIND.sub("/", SIZE.sub(r"\1 \2", LINK.sub(r"\1 \2", said.casefold())))
    return [word.strip("/") for word in text.split()]


def judge_parts(
    evidence: Evidence, truth: Sequence[AnswerPart], *, is_ordered: bool = True
) -> Score:
    """Judge an answer in parts: all have to be right, and no other may be there."""
    said = read_said(evidence.answer)
    parts = [] if said is None else [each.strip(QUOTES) for each in said.split(",")]
    if not any(parts):
        return no_answer(evidence)
    pairs = zip(truth, parts, strict=False)
    n_right = (
        sum(part.fits(each) for part, each in pairs)
        if is_ordered
        else sum(any(part.fits(each) for each in parts) for part in truth)
    )
    figures = {"n_right": float(n_right), "n_asked": float(len(truth))}
    reason = f"It said {said}; true is {', '.join(part.said for part in truth)}."
    is_right = n_right == len(truth) == len(parts)
    return verdict(reason, figures, failure=None if is_right else Failure.WRONG_ANSWER)


LIMITS = Limits(n_calls=60, robot_time_s=600.0, wall_s=600.0)
OPENING = (
    "Inspect the robot's ROS. "
    "The node /rosbridge_websocket, through which you look, does not count."
)
COARSENINGS = (1, 2, 3, 4)


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A robot as drawn, without faults, and the name of the question's subject."""

    name: str
    draw: Draw
    names: Names
    system: InspectedSystem
    grid: OccupancyGrid

    def ask(
        self,
        *parts: AnswerPart,
        system: InspectedSystem | None = None,
        is_ordered: bool = True,
        **told: object,
    ) -> Setting:
        """Return the setting of the question.

        Args:
            parts: Of the right answer.
            system: With a fault; None for the one in good order.
            told: What the question has drawn, by the names in its text.
        """
        question = _read_questions()[self.name]
        text = Template(question["ask"]).substitute(vars(self.names), **told)
        form = question["form"]
        return Setting(
            prompt=f"{OPENING} {text} {NO_DRIVING} End with a line of the form ANSWER: {form}.",
            start=self.draw.site.world.start,
            is_known=False,
            toolsets=("ros",),
            limits=LIMITS,
            inspected=system or self.system,
            truth={
                "said": ", ".join(part.said for part in parts),
                "parts": parts,
                "is_ordered": is_ordered,
            },
        )


@cache
def _read_questions() -> dict[str, Any]:
    text = resources.files(__package__).joinpath("inspections.yaml").read_text(encoding="utf-8")
    return dict(YAML(typ="safe", pure=True).load(text))


def inspection_task(name: str, ask: Callable[[Case], Setting]) -> Task:
    """Return the task of answering a question by what the robot's ROS says.

    Nothing is simulated but the ROS. The world gives the map that the robot carries, so that it
    needs no exploration. Trials with an odd seed are of ROS 1, those with an even one of ROS 2.
    """

    def draw(draw: Draw) -> Setting:
        grid = _coarsen(draw.site.floor.visible, draw.one_of(COARSENINGS))
        names = draw_names(draw.random)
        dialect = Dialect.ROS1 if draw.seed % 2 else Dialect.ROS2
        system = draw_system(draw.random, names, grid, dialect=dialect)
        return ask(Case(name=name, draw=draw, names=names, system=system, grid=grid))

    return Task(name=f"inspect-{name}", draw=draw, judge=_judge, needs_map=False)


def _judge(_site: GroundTruth, truth: Truth, evidence: Evidence) -> Score:
    return judge_parts(evidence, truth["parts"], is_ordered=truth["is_ordered"])


def _coarsen(grid: OccupancyGrid, factor: int) -> OccupancyGrid:
    """Return a map with cells a factor wider; each holds the highest value within it."""
    n_rows, n_cols = grid.n_rows // factor, grid.n_cols // factor
    blocks = grid.cells[: n_rows * factor, : n_cols * factor]
    return OccupancyGrid(
        cells=blocks.reshape(n_rows, factor, n_cols, factor).max(axis=(1, 3)),
        resolution_m=round(grid.resolution_m * factor, 4),
        origin=grid.origin,
    )


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
