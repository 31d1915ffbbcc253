"""Observations that move with the map they were made on, also across a crash.

The semantic map file decides which map counts: a move is planned before that file changes, and
done or dropped by what it says afterwards.
"""

import json
import math

from mapspeak.geometry import Pose, wrap_angle
from mapspeak.semantic.episodes.database import EpisodeDatabase

__all__ = ["finish_move", "has_plans", "plan_move"]

_PLAN = "move to "


def plan_move(database: EpisodeDatabase, motion: Pose, *, to: str) -> None:
    """Notes how poses move if the kept map becomes another one.

    Args:
        database: The observations.
        motion: From the frame of their poses to the new one.
        to: The name of the map that would be kept.
    """
    if not database.exists():
        return
    plan = json.dumps([motion.x, motion.y, motion.yaw_rad])
    with database.writing() as connection:
        connection.execute("INSERT OR REPLACE INTO facts VALUES (?, ?)", (_PLAN + to, plan))


def finish_move(database: EpisodeDatabase, *, at: str) -> int:
    """Moves all poses if that was planned for the map that is kept now; forgets other plans.

    Rooms of the old map are left away: their ids mean nothing on the new one.

    Args:
        database: The observations.
        at: The name of the map that is kept.

    Returns:
        How many were moved.
    """
    if not database.exists() or not has_plans(database):
        return 0
    with database.writing() as connection:
        select = "SELECT name, value FROM facts WHERE name GLOB ?"
        plans = dict(connection.execute(select, [f"{_PLAN}*"]).fetchall())
        connection.execute("DELETE FROM facts WHERE name GLOB ?", [f"{_PLAN}*"])
        if _PLAN + at not in plans:
            return 0
        motion = Pose(*json.loads(plans[_PLAN + at]))
        cos, sin = math.cos(motion.yaw_rad), math.sin(motion.yaw_rad)
        connection.create_function("turned", 1, lambda yaw: wrap_angle(yaw + motion.yaw_rad))
        return connection.execute(
            "UPDATE observations SET room_id = NULL, yaw_rad = turned(yaw_rad),"
            " x = ? + ? * x - ? * y, y = ? + ? * x + ? * y",
            (motion.x, cos, sin, motion.y, sin, cos),
        ).rowcount


def has_plans(database: EpisodeDatabase) -> bool:
    """True where a move was planned and neither done nor dropped."""
    with database.reading() as connection:
        found = connection.execute("SELECT 1 FROM facts WHERE name GLOB ?", [f"{_PLAN}*"])
        return found.fetchone() is not None
