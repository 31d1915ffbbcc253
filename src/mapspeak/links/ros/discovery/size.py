"""How large the robot is, as its own navigation has been told."""

import json
import math
from collections.abc import Iterator

from mapspeak.errors import LinkError
from mapspeak.ros import RosConnection
from mapspeak.ros.messages import Dialect

LEAST_RADIUS_M, LARGEST_RADIUS_M = 0.01, 10.0
COSTMAPS = {
    Dialect.ROS1: (("/move_base", "global_costmap/"), ("/move_base", "local_costmap/")),
    Dialect.ROS2: (
        ("/global_costmap/global_costmap", ""),
        ("/local_costmap/local_costmap", ""),
    ),
}
"""Nodes, and what stands before the names of their parameters."""


async def find_radius_m(
    connection: RosConnection,
    dialect: Dialect,
    *,
    namespace: str = "",
    services: frozenset[str] | None = None,
) -> tuple[float, str] | None:
    """Find the radius of the smallest circle around the robot, and which parameter says so.

    Navigation knows it as `footprint`, a polygon around the base, which counts where it is given,
    or as `robot_radius`. None where neither is to be had.

    Args:
        connection: To the robot.
        dialect: Which ROS: each keeps parameters in its own way.
        namespace: Where the robot's nodes are.
        services: Those that the robot lists; None where it does not. Nodes are known by them
            before they are by name.
    """
    for node, prefix in COSTMAPS[dialect]:
        full = f"{namespace}{node}"
        asked = f"{full}/get_parameters"
        if dialect is Dialect.ROS2 and services is not None and asked not in services:
            continue
        for name, read in (("footprint", _radius_of_outline), ("robot_radius", _plausible)):
            try:
                radius_m = read(await connection.fetch_parameter(full, f"{prefix}{name}"))
            except LinkError:
                # A robot whose navigation does not tell is used as one that has none.
                break
            if radius_m is not None:
                return radius_m, f"{full} {prefix}{name}"
    return None


def _radius_of_outline(outline: object) -> float | None:
    """Reads "[[0.2, 0.1], [-0.2, 0.1], ...]", which ROS 2 keeps as a text and ROS 1 as lists."""
    if isinstance(outline, str):
        try:
            outline = json.loads(outline)
        except ValueError:
            return None
    distances_m = list(_distances(outline))
    return _plausible(max(distances_m)) if len(distances_m) > 2 else None


def _distances(outline: object) -> Iterator[float]:
    for corner in outline if isinstance(outline, list) else []:
        match corner:
            case [int() | float() as x, int() | float() as y]:
                yield math.hypot(x, y)


def _plausible(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if LEAST_RADIUS_M <= value <= LARGEST_RADIUS_M else None
