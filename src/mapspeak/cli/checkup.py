"""`mapspeak doctor`: check what a robot offers and delivers, and how to start missing parts."""

import json
import math
import sys
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from functools import partial
from pathlib import Path

import anyio
import click
import numpy as np

from mapspeak.cli.shared.options import ROBOT_OPTIONS, add_options, control_folder
from mapspeak.cli.shared.robots import RobotChoice, open_robot
from mapspeak.errors import LinkError, MapError, MapspeakError
from mapspeak.hold import Hold
from mapspeak.robot import RangeScan, Robot
from mapspeak.ros.discovery.profile import (
    NavigationKind,
    PoseSource,
    RobotPart,
    RobotProfile,
    Worth,
)
from mapspeak.ros.port import LinkKind, LinkName
from mapspeak.ros.robot import RosRobot
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.paths import clearance_m

OLD_POSE_S = 5.0
"""A pose older than this does not locate a driving robot."""
ON_MAP_M = 0.3
"""A laser hit within this distance of an obstacle on the map counts as that obstacle."""
LEAST_ON_MAP_RATIO = 0.5
"""People and moved chairs take beams away, but hardly every other one."""


class Health(StrEnum):
    """The state of one thing that a robot should offer."""

    FINE = "fine"
    DOUBTFUL = "doubtful"
    MISSING = "missing"


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One line of a check-up.

    Attributes:
        said: What was found, with numbers and units.
        hint: What to start or to change; empty where all is well.
    """

    what: str
    health: Health
    said: str
    hint: str = ""


def _fine(what: str, said: str) -> Finding:
    return Finding(what=what, health=Health.FINE, said=said)


def _doubtful(what: str, said: str, hint: str) -> Finding:
    return Finding(what=what, health=Health.DOUBTFUL, said=said, hint=hint)


def _lacking(what: str, said: str, hint: str) -> Finding:
    return Finding(what=what, health=Health.MISSING, said=said, hint=hint)


async def examine(robot: Robot) -> tuple[Finding, ...]:
    """Ask a robot for its map, its pose and a picture, and judge the answers."""
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
        found.append(
            _doubtful(
                "goals",
                f"{len(goals)} under way that somebody else has sent",
                "A new goal replaces them; stop_robot ends them.",
            )
        )
    if robot.description.has_camera:
        found.append(await _ask("picture", lambda: _look_at_picture(robot)))
    if robot.description.has_laser:
        found.append(await _ask("laser", lambda: _look_at_laser(robot, grid)))
    return tuple(found)


async def _ask(what: str, look: Callable[[], Awaitable[Finding]]) -> Finding:
    try:
        return await look()
    except (LinkError, MapError) as error:
        return _missing(what, error)


def _missing(what: str, error: MapspeakError) -> Finding:
    return _lacking(what, error.message, error.hint)


def _say_age(robot: Robot, stamp_s: float) -> str:
    return f"{max(robot.now_s - stamp_s, 0.0):.1f} s old"


def _judge_map(grid: OccupancyGrid) -> Finding:
    free_m2 = float(grid.free.sum()) * grid.resolution_m**2
    size = f"{grid.width_m:.1f} x {grid.height_m:.1f} m in cells of {grid.resolution_m:g} m"
    said = f"{size}, {free_m2:.1f} m2 of free floor"
    if free_m2 > 0:
        return _fine("map", said)
    return _doubtful("map", said, "Let SLAM see something: check that the laser publishes.")


async def _look_at_pose(robot: Robot) -> Finding:
    stamped = await robot.fetch_pose()
    pose, age_s = stamped.pose, max(robot.now_s - stamped.stamp_s, 0.0)
    said = f"x {pose.x:.2f}, y {pose.y:.2f}, yaw {pose.yaw_deg:.0f} deg, {age_s:.1f} s old"
    if age_s <= OLD_POSE_S:
        return _fine("pose", said)
    return _doubtful(
        "pose", said, "Check that SLAM or AMCL runs, and that the clocks agree (use_sim_time, NTP)."
    )


async def _look_at_place(robot: Robot, grid: OccupancyGrid) -> Finding:
    cell = grid.cell_at((await robot.fetch_pose()).pose.point)
    if not grid.contains(cell):
        return _misplaced("the robot stands off its map")
    if grid.is_occupied(cell):
        return _misplaced("the robot stands in a wall of its map")
    clear_m, radius_m = float(clearance_m(grid)[cell.row, cell.col]), robot.description.radius_m
    if clear_m < radius_m:
        return _misplaced(
            f"the robot stands {clear_m:.2f} m from an obstacle, its radius is {radius_m:.2f} m"
        )
    room = "no obstacle known" if math.isinf(clear_m) else f"{clear_m:.2f} m to any obstacle"
    return _fine("place", f"on its map, {room}")


def _misplaced(said: str) -> Finding:
    return _doubtful("place", said, "Set the initial pose, or the robot's radius_m in robot.yaml.")


async def _look_at_picture(robot: Robot) -> Finding:
    picture = await robot.fetch_picture()
    size = f"{picture.width_px} x {picture.height_px} px, {len(picture.data) / 1000:.0f} kB"
    fov_rad = picture.horizontal_fov_rad
    wide = ", angle unknown" if fov_rad is None else f", {math.degrees(fov_rad):.0f} deg wide"
    said = f"{picture.media_type}, {size}{wide}, {_say_age(robot, picture.stamp_s)}"
    return _fine("picture", said)


async def _look_at_laser(robot: Robot, grid: OccupancyGrid | None) -> Finding:
    scan = await robot.fetch_scan()
    if scan is None:
        return _doubtful(
            "laser",
            "no scan that can be used came; all else works without",
            "Check that it publishes, that the clocks agree, and that TF leads from the "
            "robot's base to its frame.",
        )
    met = np.isfinite(scan.ranges_m)
    said = f"{np.count_nonzero(met)} of {met.size} beams met something, "
    said += _say_age(robot, scan.stamp_s)
    if grid is None:
        said += "; there is no map to compare with"
        return _fine("laser", said)
    ratio = _share_on_map(grid, scan)
    if ratio is None:
        return _doubtful("laser", said, "Is it covered?")
    said += f", {100 * ratio:.0f} % of that is on the map"
    if ratio >= LEAST_ON_MAP_RATIO:
        return _fine("laser", said)
    return _doubtful(
        "laser",
        said,
        "Set the initial pose, or check how the laser is mounted by TF: turned, or upside "
        "down. On a map that is old it may be right.",
    )


def _share_on_map(grid: OccupancyGrid, scan: RangeScan) -> float | None:
    """Return the share of laser hits at obstacles on the map; None without hits."""
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


START_MAP = "Start SLAM (slam_toolbox, cartographer, gmapping) or a map server on the robot."
START_POSE = "Start SLAM or AMCL on the robot, so that TF leads from the map to its base."
START_CAMERA = (
    "Start the camera driver, or name camera_topic in robot.yaml; all else works without."
)
START_LASER = "Start the laser's driver, or name scan_topic in robot.yaml; all else works without."
START_NAVIGATION = "Start Nav2 (ROS 1: move_base) on the robot, or name navigation in robot.yaml."
START_RADIUS = "Name radius_m in robot.yaml: the navigation does not tell it (robot_radius)."
START_VELOCITY = "Name velocity_topic in robot.yaml, so that a stop can command zero velocity."


def describe_profile(
    profile: RobotProfile, link: LinkName, *, reason: str = "", map_age_s: float | None = None
) -> tuple[Finding, ...]:
    """Return a line for each thing that mapspeak uses of a robot.

    Args:
        reason: Why in that way; empty where it is obvious.
        map_age_s: Since the map's stamp; None where there is no map.
    """
    ros = "ROS 1" if profile.dialect == "ros1" else "ROS 2"
    distro = profile.distro or "distribution not told"
    age = "" if map_age_s is None else f", stamped {map_age_s:.1f} s ago"
    return (
        _fine("link", _say_link(link) + (reason and f", {reason}")),
        _fine("ROS", f"{ros}, {distro}"),
        *_describe_namespace(profile),
        _describe(RobotPart.MAP, "map topic", profile, START_MAP, Health.MISSING, more=age),
        _describe_pose(profile),
        _describe(RobotPart.CAMERA, "camera topic", profile, START_CAMERA),
        _describe(RobotPart.LASER, "scan topic", profile, START_LASER),
        _describe_navigation(profile),
        _describe_planner(profile),
        _describe(RobotPart.VELOCITY, "velocity topic", profile, START_VELOCITY),
        _describe_radius(profile),
    )


def _say_link(link: LinkName) -> str:
    return f"{link.kind}{' at' if link.kind is LinkKind.ROSBRIDGE else ','} {link.place}"


def _describe(
    part: RobotPart,
    what: str,
    profile: RobotProfile,
    hint: str,
    health: Health = Health.DOUBTFUL,
    *,
    more: str = "",
) -> Finding:
    topic = part.topic(profile)
    match part.worth(profile):
        case Worth.MISSING:
            return Finding(what=what, health=health, said="none found", hint=hint)
        case Worth.NAMED:
            nobody = "listens to it" if part.is_heard(profile) else "publishes it"
            said = f"{topic} is named, but nobody {nobody}"
            return Finding(what=what, health=health, said=said, hint=hint)
        case _:
            return _fine(what, f"{topic}{more}")


def _describe_namespace(profile: RobotProfile) -> tuple[Finding, ...]:
    others = profile.other_namespaces
    if others:
        said = f"{len(others)} robots are here: {', '.join(others)}"
        hint = f"Say in robot.yaml which one is meant: `namespace: {others[0]}`."
        return (_lacking("namespace", said, hint),)
    if not profile.namespace:
        return ()
    return (_fine("namespace", profile.namespace),)


def _describe_pose(profile: RobotProfile) -> Finding:
    what = "pose source"
    match profile.pose_source:
        case PoseSource.TF:
            said = f"TF from {profile.map_frame} to {profile.base_frame}"
            return _fine(what, said)
        case PoseSource.POSE_TOPIC:
            return _fine(what, f"{profile.pose_topic}")
        case PoseSource.ODOMETRY:
            said = f"{profile.pose_topic}: odometry, which drifts against the map"
            return _doubtful(what, said, START_POSE)
        case PoseSource.NONE:
            return _lacking(what, "none found", START_POSE)


def _describe_planner(profile: RobotProfile) -> Finding:
    said = profile.planner_name or "none found, and none needed for goals"
    return _fine("planner", said)


def _describe_radius(profile: RobotProfile) -> Finding:
    said = f"{profile.radius_m:.2f} m, {profile.radius_source or 'assumed'}"
    if profile.radius_source:
        return _fine("radius", said)
    return _doubtful("radius", said, START_RADIUS)


def _describe_navigation(profile: RobotProfile) -> Finding:
    what, name = "navigation", profile.navigation_name
    worth = RobotPart.NAVIGATION.worth(profile)
    if worth is Worth.MISSING:
        return _lacking(what, "none found", START_NAVIGATION)
    if worth is Worth.NAMED:
        said = f"{profile.navigation}: {name} is named, but nobody serves it"
        return _lacking(what, said, START_NAVIGATION)
    if profile.navigation is NavigationKind.GOAL_TOPIC:
        said = f"{name}: a topic for goals, which does not say how a drive ends"
        return _doubtful(what, said, START_NAVIGATION)
    return _fine(what, f"{profile.navigation}: {name}")


SIGNS = {Health.FINE: "ok", Health.DOUBTFUL: "??", Health.MISSING: "--"}


@click.command()
@add_options(ROBOT_OPTIONS)
@click.option("--json", "as_json", is_flag=True, help="Print the findings as JSON.")
def doctor(
    robot: str,
    robot_file: Path | None,
    ca_file: Path | None,
    seed: int,
    as_json: bool,  # noqa: FBT001 - a flag
) -> None:
    """Check a robot: what was found, how fresh it is, what is missing and how to start it.

    Exit status: 0 if all is well, 1 if something is missing, 2 if it cannot be
    reached.
    """
    choice = RobotChoice(robot=robot, robot_file=robot_file, ca_file=ca_file, seed=seed)
    findings = anyio.run(examine_choice, choice)
    if as_json:
        click.echo(json.dumps([asdict(finding) for finding in findings], indent=2))
    else:
        _show(findings)
    sys.exit(1 if any(finding.health is Health.MISSING for finding in findings) else 0)


async def examine_choice(choice: RobotChoice) -> list[Finding]:
    """Return what the robot offers, once all of it has been found, and what it really gives."""
    async with open_robot(choice) as robot:
        if not isinstance(robot, RosRobot):
            return [*await examine(robot)]
        await robot.settle()
        found = await examine(robot)
        link = robot.connection.link
        is_second_choice = choice.robot.startswith("ros2") and link.kind is LinkKind.DDS
        reason = "because this Python has no rclpy" if is_second_choice else ""
        lines = describe_profile(robot.profile, link, reason=reason, map_age_s=robot.map_age_s)
        return [*lines, *find_servers(choice), *found]


def find_servers(choice: RobotChoice) -> list[Finding]:
    """Return which servers of this user drive the same robot; nothing where none does."""
    processes = Hold(control_folder(None)).servers_of(choice.address)
    if not processes:
        return []
    if len(processes) == 1:
        said = f"1 serves this robot: process {processes[0]}"
        return [_fine("servers", said)]
    said = f"{len(processes)} serve this robot: processes {', '.join(map(str, processes))}"
    hint = "Their goals replace each other and their velocities alternate: end all but one."
    return [_doubtful("servers", said, hint)]


def _show(findings: Sequence[Finding]) -> None:
    for finding in findings:
        click.echo(f"{SIGNS[finding.health]}  {finding.what}: {finding.said}")
        if finding.hint:
            click.echo(f"      {finding.hint}")
    n_missing = sum(finding.health is Health.MISSING for finding in findings)
    n_doubtful = sum(finding.health is Health.DOUBTFUL for finding in findings)
    click.echo(f"{n_missing} missing, {n_doubtful} doubtful, {len(findings)} looked at.")
