"""A robot's ROS in good order; `robot.yaml` says what it consists of and what is drawn."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib import resources
from string import Template
from types import SimpleNamespace
from typing import Any

import numpy as np
from ruamel.yaml import YAML

from mapspeak.evaluation.inspected.playing import InspectedSystem, OfferedService, Stream
from mapspeak.geometry import Pose
from mapspeak.ros.messages.fields import Dialect
from mapspeak.ros.messages.grids import write_grid
from mapspeak.ros.messages.poses import FrameTransform
from mapspeak.spatial import OccupancyGrid

Names = SimpleNamespace
"""Names of the parts of one robot's ROS."""
TRANSFORMS = "tf2_msgs/TFMessage"
FIRST_S, LAST_S = 1_700_000_000, 1_760_000_000
"""Robots that run by the time of day have such clocks."""
LOCAL_CELLS = 60
SLOWEST_HZ, FASTER = 3.0, 8.0
"""Of laser scanners, and how many times as fast the fastest is."""
N_BEAMS = 90


@cache
def _read_parts() -> tuple[Mapping[str, Sequence[str]], Any]:
    """Return what parts may be called, and the whole in which `$` stands before what is drawn."""
    text = resources.files(__package__).joinpath("robot.yaml").read_text(encoding="utf-8")
    names, parts = YAML(typ="safe", pure=True).load_all(text)
    return names, parts


def _fill(told: Any, drawn: Mapping[str, object]) -> Any:  # noqa: ANN401 - a tree of YAML
    """Return a tree with what was drawn in its places."""
    if isinstance(told, dict):
        return {_fill(key, drawn): _fill(value, drawn) for key, value in told.items()}
    if isinstance(told, list):
        return [_fill(value, drawn) for value in told]
    if not isinstance(told, str):
        return told
    whole = drawn.get(told[1:]) if told.startswith("$") else None
    return Template(told).substitute(drawn) if whole is None else whole


def draw_names(random: np.random.Generator) -> Names:
    """Draw what everything is called."""
    return Names(**{part: _one(random, choices) for part, choices in _read_parts()[0].items()})


def draw_system(
    random: np.random.Generator, names: Names, grid: OccupancyGrid, *, dialect: Dialect
) -> InspectedSystem:
    """Draw a system in which everything is as it should be."""
    charge_ratio = round(float(random.uniform(0.06, 0.96)), 2)
    figures = {
        # Evenly on a logarithmic scale, so that no one figure is near to most of them.
        "laser_hz": round(2 * SLOWEST_HZ * FASTER ** random.random()) / 2,
        "ranges_m": [round(float(random.uniform(1.0, 6.0)), 2)] * N_BEAMS,
        "range_m": round(float(random.uniform(0.3, 3.0)), 2),
        "charge_ratio": charge_ratio,
        "voltage": round(22.0 + 4.0 * charge_ratio, 2),
    }
    told = _fill(_read_parts()[1], {**vars(names), **figures})
    local = OccupancyGrid(
        cells=np.zeros((LOCAL_CELLS, LOCAL_CELLS), dtype=np.int8), resolution_m=0.05
    )
    grids = {names.map: grid, f"{names.navigator}/local_costmap": local}
    streams = tuple(_stream(row, grids.get(row["topic"]), dialect) for row in told["streams"])
    types = {stream.topic: stream.type for stream in streams}
    system = InspectedSystem(
        dialect=dialect,
        started_s=float(random.integers(FIRST_S, LAST_S)),
        streams=streams,
        subscriptions={
            node: {topic: types[topic] for topic in topics}
            for node, topics in told["subscriptions"].items()
        },
        services=tuple(_draw_service(random, **row) for row in told["services"]),
        types={names.device_type: _draw_type(random, told["measured"], told["kinds"])},
    )
    numbers = {
        name: round(float(random.uniform(low, high)), places)
        for name, (low, high, places) in told["navigation"].items()
    }
    parameters: dict[str, dict[str, Any]] = {node: {} for node in system.nodes}
    parameters[names.navigator] = {**numbers, "global_frame": "map"}
    parameters[names.laser] = {"frame_id": names.laser_frame, "angle_compensate": True}
    return replace(system, parameters=parameters)


def _stream(row: dict[str, Any], grid: OccupancyGrid | None, dialect: Dialect) -> Stream:
    transforms = tuple(
        FrameTransform(
            parent_from_child=Pose(x, y, yaw_rad), parent=parent, child=child, stamp_s=0.0
        )
        for parent, child, x, y, yaw_rad in row.pop("transforms", ())
    )
    values = row.pop("values", {}) if grid is None else write_grid(grid, dialect=dialect)
    usual = {"type": TRANSFORMS, "rate_hz": None}
    return Stream(**{**usual, **row}, values=values, transforms=transforms)


def _draw_service(
    random: np.random.Generator,
    *,
    node: str,
    names: Sequence[str],
    types: Sequence[str],
    deed: str,
) -> OfferedService:
    return OfferedService(
        node=node, service=f"{node}/{_one(random, names)}", type=_one(random, types), deed=deed
    )


def _draw_type(random: np.random.Generator, measured: Sequence[str], kinds: Sequence[str]) -> str:
    """Draw the text of a message type: five fields, of which two are of one kind."""
    names = [measured[at] for at in random.permutation(len(measured))[:5].tolist()]
    drawn = [kinds[at] for at in random.permutation(len(kinds))[:4].tolist()]
    rows = zip((*drawn, drawn[0]), names, strict=True)
    return "\n".join(f"{kind} {name}" for kind, name in rows)


def _one(random: np.random.Generator, choices: Sequence[str]) -> str:
    return choices[int(random.integers(len(choices)))]
