"""Turning in place, as a drive like any other: a stop or a newer goal ends it."""

import math

from mapspeak.driving.drive import DriveReport, OnProgress
from mapspeak.driving.exploration.site import Site
from mapspeak.geometry import Pose, wrap_angle

__all__ = ["spread_headings", "turn_to"]


async def turn_to(
    site: Site, yaw_rad: float, *, wait_s: float, on_progress: OnProgress, client: str = ""
) -> DriveReport:
    """Turns the robot where it stands, and gives how that went.

    Args:
        site: The robot and its drives.
        yaw_rad: The heading to end with.
        wait_s: Robot time to wait for it.
        on_progress: Told about the turn.
        client: Who asks for it.

    Raises:
        GoalError: The robot was stopped meanwhile.
        LinkError: The robot cannot be reached.
    """
    with site.drives.preparing() as ticket:
        here = (await site.robot.fetch_pose()).pose
        goal = Pose(here.x, here.y, wrap_angle(yaw_rad))
        place = f"a turn to {goal.yaw_deg:.0f} deg"
        drive = await site.drives.start(goal, place=place, ticket=ticket, client=client)
    return await site.drives.wait(drive.goal_id, wait_s=wait_s, on_progress=on_progress)


def spread_headings(first_rad: float, n_headings: int) -> list[float]:
    """Gives headings all around, in radians, evenly spread and counter-clockwise from the first."""
    step_rad = math.tau / n_headings
    return [wrap_angle(first_rad + index * step_rad) for index in range(n_headings)]
