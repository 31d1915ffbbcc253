"""What a robot really gives when it is asked, and what is missing before it can be used."""

import math
from collections.abc import Awaitable, Callable
from functools import partial

import numpy as np

from mapspeak.errors import LinkError, MapError, MapspeakError
from mapspeak.robot import Finding, Health, RangeScan, Robot
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.paths import clearance_m

OLD_POSE_S = 5.0
"""A pose older than this is no answer to where a driving robot is."""
ON_MAP_M = 0.3
"""What a laser meets no farther from what the map has is that very thing."""
LEAST_ON_MAP_RATIO = 0.5
"""People and moved chairs take beams away, but hardly every other one."""


async def examine(robot: Robot) -> tuple[Finding, ...]:
    """Ask a robot for its map, its pose and a picture, and judge what comes."""
    # A map that does not come is waited for once.
    grid: OccupancyGrid | None = None
    try:
        grid = await robot.fetch_map()
    except (LinkError, MapError) as error:
        found = [_missing("map", error)]
    else:
        found = [_judge_map(grid)]
    found.append(await _ask("pose", lambda: _look_at_pose(robot)))
    if grid is not None and found[1].health is not Health.MISSING:
        found.append(await _ask("place", partial(_look_at_place, robot, grid)))
    if goals := await robot.fetch_foreign_goals():
        found.append(_busy(len(goals)))
    if robot.description.has_camera:
        found.append(await _ask("picture", lambda: _look_at_picture(robot)))
    if robot.description.has_laser:
        found.append(await _ask("laser", lambda: _look_at_laser(robot, grid)))
    return tuple(found)


def _busy(n_goals: int) -> Finding:
    return Finding(
        what="goals",
        health=Health.DOUBTFUL,
        said=f"{n_goals} under way that somebody else has sent",
        hint="A new goal replaces them; stop_robot ends them.",
    )


async def _ask(what: str, look: Callable[[], Awaitable[Finding]]) -> Finding:
    try:
        return await look()
    except (LinkError, MapError) as error:
        return _missing(what, error)


def _missing(what: str, error: MapspeakError) -> Finding:
    return Finding(what=what, health=Health.MISSING, said=error.message, hint=error.hint)


def _say_age(robot: Robot, stamp_s: float) -> str:
    return f"{max(robot.now_s - stamp_s, 0.0):.1f} s old"


def _judge_map(grid: OccupancyGrid) -> Finding:
    free_m2 = float(grid.free.sum()) * grid.resolution_m**2
    size = f"{grid.width_m:.1f} x {grid.height_m:.1f} m in cells of {grid.resolution_m:g} m"
    said = f"{size}, {free_m2:.1f} m2 of free floor"
    if free_m2 > 0:
        return Finding(what="map", health=Health.FINE, said=said)
    return Finding(
        what="map",
        health=Health.DOUBTFUL,
        said=said,
        hint="Let SLAM see something: check that the laser publishes.",
    )


async def _look_at_pose(robot: Robot) -> Finding:
    stamped = await robot.fetch_pose()
    pose, age_s = stamped.pose, max(robot.now_s - stamped.stamp_s, 0.0)
    said = f"x {pose.x:.2f}, y {pose.y:.2f}, yaw {pose.yaw_deg:.0f} deg, {age_s:.1f} s old"
    if age_s <= OLD_POSE_S:
        return Finding(what="pose", health=Health.FINE, said=said)
    return Finding(
        what="pose",
        health=Health.DOUBTFUL,
        said=said,
        hint="Check that SLAM or AMCL runs, and that the clocks agree (use_sim_time, NTP).",
    )


async def _look_at_place(robot: Robot, grid: OccupancyGrid) -> Finding:
    cell = grid.cell_at((await robot.fetch_pose()).pose.point)
    if not grid.contains(cell):
        return _misplaced("the robot stands off its map")
    if grid.is_occupied(cell):
        return _misplaced("the robot stands in a wall of its map")
    clear_m, radius_m = _clearance_at(grid, cell.row, cell.col), robot.description.radius_m
    if clear_m < radius_m:
        return _misplaced(
            f"the robot stands {clear_m:.2f} m from an obstacle, its radius is {radius_m:.2f} m"
        )
    room = "no obstacle known" if math.isinf(clear_m) else f"{clear_m:.2f} m to any obstacle"
    return Finding(what="place", health=Health.FINE, said=f"on its map, {room}")


def _clearance_at(grid: OccupancyGrid, row: int, col: int) -> float:
    return float(clearance_m(grid)[row, col])


def _misplaced(said: str) -> Finding:
    return Finding(
        what="place",
        health=Health.DOUBTFUL,
        said=said,
        hint="Set the initial pose, or the robot's radius_m in robot.yaml.",
    )


async def _look_at_picture(robot: Robot) -> Finding:
    picture = await robot.fetch_picture()
    size = f"{picture.width_px} x {picture.height_px} px, {len(picture.data) / 1000:.0f} kB"
    fov_rad = picture.horizontal_fov_rad
    wide = ", angle unknown" if fov_rad is None else f", {math.degrees(fov_rad):.0f} deg wide"
    said = f"{picture.media_type}, {size}{wide}, {_say_age(robot, picture.stamp_s)}"
    return Finding(what="picture", health=Health.FINE, said=said)


async def _look_at_laser(robot: Robot, grid: OccupancyGrid | None) -> Finding:
    scan = await robot.fetch_scan()
    if scan is None:
        return Finding(
            what="laser",
            health=Health.DOUBTFUL,
            said="no scan that can be used came; all else works without",
            hint="Check that it publishes, that the clocks agree, and that TF leads from the "
            "robot's base to its frame.",
        )
    met = np.isfinite(scan.ranges_m)
    said = f"{np.count_nonzero(met)} of {met.size} beams met something"
    age = _say_age(robot, scan.stamp_s)
    if grid is None:
        said += f", {age}; there is no map to compare with"
        return Finding(what="laser", health=Health.FINE, said=said)
    said += f", {age}"
    ratio = _share_on_map(grid, scan)
    if ratio is None:
        return Finding(what="laser", health=Health.DOUBTFUL, said=said, hint="Is it covered?")
    said += f", {100 * ratio:.0f} % of that is on the map"
    if ratio >= LEAST_ON_MAP_RATIO:
        return Finding(what="laser", health=Health.FINE, said=said)
    return Finding(
        what="laser",
        health=Health.DOUBTFUL,
        said=said,
        hint="Set the initial pose, or check how the laser is mounted by TF: turned, or upside "
        "down. On a map that is old it may be right.",
    )


def _share_on_map(grid: OccupancyGrid, scan: RangeScan) -> float | None:
    """Return share of what a laser met that lies at what the map has; None where it met none."""
    is_met = np.isfinite(scan.ranges_m)
    if not is_met.any():
        return None
    ways = scan.pose.yaw_rad + scan.angles_rad[is_met]
    far_m = scan.ranges_m[is_met]
    xs, ys = scan.pose.x + far_m * np.cos(ways), scan.pose.y + far_m * np.sin(ways)
    rows, cols = grid.cells_at(np.stack([xs, ys], axis=1))
    is_inside = grid.contains_cells(rows, cols)
    away_m = clearance_m(grid)[rows[is_inside], cols[is_inside]]
    # From middle to middle of cells, so that one cell more is the very surface.
    n_on_map = np.count_nonzero(away_m <= max(ON_MAP_M, 1.5 * grid.resolution_m))
    return n_on_map / len(rows)
