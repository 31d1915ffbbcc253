"""What the robot's laser meets now, made ready for records; nobody waits long for it."""

import anyio

from mapspeak.errors import LinkError
from mapspeak.robot import SCAN_PATIENCE_S, Robot
from mapspeak.semantic import LaserRing, build_ring


async def fetch_ring(robot: Robot) -> LaserRing | None:
    """Gives what the laser meets; None where there is none, or none that answers in time.

    No picture and no write fails for want of it, nor takes longer than `SCAN_PATIENCE_S` for it.
    """
    if not robot.description.has_laser:
        return None
    scan = None
    with anyio.move_on_after(SCAN_PATIENCE_S):
        try:
            scan = await robot.fetch_scan()
        except LinkError:
            return None
    if scan is None:
        return None
    return build_ring(
        scan.pose, angles_rad=scan.angles_rad, ranges_m=scan.ranges_m, reach_m=scan.reach_m
    )
