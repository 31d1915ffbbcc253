"""Whether the connection held: what was asked for before a loss may be old."""

import math

import anyio

from mapspeak.ros import RosConnection


def say_loss(connection: RosConnection, *, since_s: float) -> str:
    """Says that the connection is lost, or was lost after a moment; empty where it held.

    Args:
        connection: To the robot.
        since_s: That moment, by the event loop's clock; minus infinity where nothing was asked or
            heard before.
    """
    lost_s = connection.lost_for_s
    if lost_s is not None:
        return (
            f"The connection was lost {lost_s:.1f} s ago and is not back yet: this is as old as "
            "that."
        )
    up_s = connection.connected_for_s
    if up_s is not None and anyio.current_time() - up_s > since_s > -math.inf:
        return (
            f"The connection was lost meanwhile and is back since {up_s:.1f} s: what came before "
            "may be old."
        )
    return ""
