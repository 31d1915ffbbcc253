"""Driving for pictures: which walls no picture shows yet, and where to stop for one."""

import math
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Protocol

import cv2
import numpy as np

from mapspeak.driving.drive import OnProgress
from mapspeak.driving.drivereport import Drive, DriveReport
from mapspeak.driving.exploration.trips import Target, TripContext, name_turn, turn_to
from mapspeak.errors import GoalError, PolicyError
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.memory import PictureBook, PictureReading, TakenPicture
from mapspeak.places.relations.choosing import CheckedGoal, GoalPurpose
from mapspeak.places.relations.viewpoints import (
    Face,
    aim_for_picture,
    face_new_walls,
    face_room,
    find_room_near,
)
from mapspeak.places.standing import spread_places
from mapspeak.robot import GoalState
from mapspeak.safety import ApprovalScope
from mapspeak.spatial.fieldofview import (
    SIGHT_M,
    CameraView,
    find_half_view_rad,
    find_walls_by_heading,
    heading_rad,
    mask_pictured,
    measure_pictured,
    sum_by_heading,
)
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.grid import FloatArray, Mask, OccupancyGrid
from mapspeak.spatial.paths.rounds import find_ways_between, find_worthiest_first
from mapspeak.worldmodel.model import WorldModel

TURN_WORTH_M = 0.5
"""So much new wall in one picture is worth a turn where the robot stands."""
DRIVE_WORTH_M = 1.0
"""So much new wall all around a place is worth a drive there."""
WAY_WORTH = 2.0
"""So many metres of way are worth a metre of new wall; see `benchmarks/views.py`."""
MOST_ORDERED = 9
"""What is farther off does not come first, and all orders of these are looked at."""
SAME_SPOT_M = 0.15
SAME_WAY_RAD = math.radians(12.0)
"""A picture taken so near to another shows no more, whatever single rays meet."""
APART_M = 1.0
APART_RAD = math.radians(25.0)
TURN_S = 10.0
"""Robot time that a turn on arrival may take."""
MOST_DRIVES = 4
"""To the goal, to where it fits after more of it is mapped, and the turn."""
SCOPE_S = 600.0
OCCUPIED = np.int8(100)
SAME_M, SAME_RATIO = 1.0, 0.1
"""Things of one label this near to each other, and by this share of their distance, are one."""
NEARER_RATIO = 0.75
"""From so much nearer a thing is worth telling again: it is placed better from there."""
EXPLORING_LOOK = "a look while exploring,"


def is_view_due(robot: Pose, views: Sequence[CameraView]) -> bool:
    """Return True when a robot on its way has moved on from where the last picture was taken."""
    if not views:
        return True
    last = views[-1].pose
    is_apart = robot.point.distance_to(last.point) >= APART_M
    return is_apart or abs(wrap_angle(robot.yaw_rad - last.yaw_rad)) >= APART_RAD


def find_untold(
    pictures: Iterable[TakenPicture], on_the_way: Collection[str]
) -> tuple[TakenPicture, ...]:
    """Return the pictures taken on the way, with what the detector reports in them and no others.

    A reader who is not shown them would else take for seen what only they show. Each thing is told
    where it was nearest.

    Args:
        pictures: All of them; those not taken on the way since the last answer count as told.
        on_the_way: Ids of those to tell.
    """
    untold, told = [], defaultdict[str, list[tuple[Point, float]]](list)
    for picture in pictures:
        for reading in picture.readings:
            if (range_m := reading.range_m) is None:
                continue
            if picture.id in on_the_way:
                untold.append((range_m, picture, reading))
            else:
                place = picture.pose.point_at(reading.bearing_rad, range_m)
                told[reading.label].append((place, range_m))
    kept = defaultdict[str, list[PictureReading]](list)
    shown = {picture.id: picture for _, picture, _ in untold}
    for range_m, picture, reading in sorted(untold, key=lambda each: each[0]):
        place = picture.pose.point_at(reading.bearing_rad, range_m)
        known = told[reading.label]
        if all(
            place.distance_to(other) > SAME_M + SAME_RATIO * other_m
            or range_m < NEARER_RATIO * other_m
            for other, other_m in known
        ):
            known.append((place, range_m))
            kept[picture.id].append(reading)
    return tuple(
        replace(picture, readings=tuple(kept[picture_id]))
        for picture_id, picture in shown.items()
        if picture_id in kept
    )


def find_camera_target(
    world: WorldModel,
    views: Sequence[CameraView],
    frontiers: Sequence[Frontier],
    *,
    is_closed: Callable[[Point], bool],
) -> Target | None:
    """Find the pose to take the next picture in, or the frontier on the way there.

    First comes what can be seen by a turn in place. Then the robot takes the shortest way past the
    frontiers and the stops that show what is left, so that it need not come back. It goes out of
    its way, and on at the end, only for stops that show enough for that. Unknown floor that no
    frontier leads to counts as wall: what it hides is shown by no drive to a frontier.

    Args:
        views: The pictures so far, the latest last.
        frontiers: Where the exploration may go.
        is_closed: Whether a drive to a place has just failed.

    Returns:
        None where no stop is worth the way, whatever frontiers are.
    """
    grid = _wall_off_unknown(world.grid, frontiers)
    shown = mask_pictured(grid, views)
    half_rad = find_half_view_rad(views)
    here = world.robot.point

    def can_be(target: Target) -> bool:
        return not is_closed(target.pose.point) and not _is_taken(target.pose, views)

    walls = find_walls_by_heading(grid, np.array([[here.x, here.y]]))
    around_m = walls.measure_new(shown)[0]
    if sum_by_heading(around_m, half_rad).max() >= TURN_WORTH_M:
        target = _target(here, around_m, half_rad)
        if can_be(target):
            return target
    stops = list(_cover_walls(world, grid, shown, half_rad, can_be))
    beside = [(Target(id=each.id, pose=each.pose, frontier=each), 0.0) for each in frontiers]
    return _choose_first(world, [*stops, *beside]) if stops else None


def is_shown(
    world: WorldModel, views: Sequence[CameraView], frontiers: Sequence[Frontier], stop: Point
) -> bool:
    """Return True when pictures have shown on the way what a stop was worth the drive for."""
    if world.robot.point.distance_to(stop) <= SAME_SPOT_M:
        return False
    grid = _wall_off_unknown(world.grid, frontiers)
    near = [view for view in views if view.pose.point.distance_to(stop) <= 2 * SIGHT_M]
    walls = find_walls_by_heading(grid, np.array([[stop.x, stop.y]]))
    return bool(walls.measure_new(mask_pictured(grid, near)).sum() < DRIVE_WORTH_M)


def _wall_off_unknown(grid: OccupancyGrid, frontiers: Sequence[Frontier]) -> OccupancyGrid:
    """Return the map with wall for the unknown but at frontiers."""
    at_frontiers = np.zeros(grid.cells.shape, dtype=np.uint8)
    for frontier in frontiers:
        at_frontiers[grid.cells_at(frontier.points)] = 1
    is_left = cv2.dilate(at_frontiers, np.ones((5, 5), np.uint8)) == 0
    return replace(grid, cells=np.where(grid.unknown & is_left, OCCUPIED, grid.cells))


def _cover_walls(
    world: WorldModel,
    grid: OccupancyGrid,
    shown: Mask,
    half_rad: float,
    can_be: Callable[[Target], bool],
) -> Iterator[tuple[Target, float]]:
    """Return stops that show all the wall worth a drive, and how much each: the most first."""
    points, _ = spread_places(world)
    walls = find_walls_by_heading(grid, points)
    is_left = np.ones(len(points), dtype=np.bool_)
    while True:
        new_m = walls.measure_new(shown)
        total_m = new_m.sum(axis=1) * is_left
        if not (total_m >= DRIVE_WORTH_M).any():
            return
        index = int(total_m.argmax())
        is_left[index] = False
        target = _target(Point(*points[index].tolist()), new_m[index], half_rad)
        if can_be(target):
            yield target, float(total_m[index])
            all_around = CameraView(target.pose, half_view_rad=math.pi)
            shown = shown | mask_pictured(grid, [all_around])


def _choose_first(world: WorldModel, goals: Sequence[tuple[Target, float]]) -> Target | None:
    """Return the first of the goals near by on the way past them that is worth most.

    Args:
        goals: With the new wall that each shows, in metres; frontiers are passed in any case.
    """
    ways_m = [(world.path_m(goal.pose.point), goal, new_m) for goal, new_m in goals]
    reached = [(way_m, goal, new_m) for way_m, goal, new_m in ways_m if way_m is not None]
    near = sorted(reached, key=lambda each: each[0])[:MOST_ORDERED]
    first = find_worthiest_first(
        np.array([way_m for way_m, _, _ in near]),
        find_ways_between(world.distances, [goal.pose.point for _, goal, _ in near]),
        np.array([WAY_WORTH * new_m for _, _, new_m in near]),
        np.array([goal.frontier is not None for _, goal, _ in near]),
    )
    return None if first is None else near[first][1]


def _is_taken(pose: Pose, views: Sequence[CameraView]) -> bool:
    """Return True where a picture was taken already: it would be taken again without end."""
    return any(view.pose.is_near(pose, off_m=SAME_SPOT_M, turn_rad=SAME_WAY_RAD) for view in views)


def measure_pictured_on(world: WorldModel, views: Sequence[CameraView]) -> float:
    """Return the share that pictures show of the walls in sight of the floor in reach."""
    points, _ = spread_places(world)
    return measure_pictured(world.grid, mask_pictured(world.grid, views), points)


def _target(point: Point, by_heading_m: FloatArray, half_rad: float) -> Target:
    yaw_rad = heading_rad(int(sum_by_heading(by_heading_m, half_rad).argmax()))
    return Target(id=f"({point.x:.1f}, {point.y:.1f})", pose=Pose(point.x, point.y, yaw_rad))


class PictureContext(TripContext, Protocol):
    """A robot, its drives, its map and the pictures it took; a session is one."""

    @property
    def pictures(self) -> PictureBook:
        """The pictures taken lately."""
        ...


async def aim(site: PictureContext, goal: CheckedGoal) -> CheckedGoal:
    """Choose the heading to arrive with, if none was asked for and a picture is wanted."""
    if not goal.purpose.is_for_picture:
        return goal
    world, views = await site.fetch_world_model(), site.pictures.views
    return await site.compute(partial(aim_for_picture, world, goal, views))


def scope_of(place: str) -> ApprovalScope:
    """Return what a person agrees to at once: the drive to a place, and what ends it there."""
    what = f"drive to {place} and turn there to look"
    return ApprovalScope(what=what, n_drives=MOST_DRIVES, duration_s=SCOPE_S)


async def turn_for_picture(site: PictureContext, *, on_progress: OnProgress) -> None:
    """Turn the robot where it stands to what no picture shows.

    It stays as it is without a camera, and where it was stopped or another client drives it.
    """
    if not site.robot.description.has_camera:
        return
    world, views = await site.fetch_world_model(), site.pictures.views
    pose = await site.compute(partial(face_new_walls, world, world.robot, views))
    if pose == world.robot:
        return
    with suppress(GoalError, PolicyError):
        await turn_to(
            site, pose.yaw_rad, wait_s=TURN_S, on_progress=on_progress, what=EXPLORING_LOOK
        )


async def end_for_picture(
    site: PictureContext, report: DriveReport, *, wait_s: float, on_progress: OnProgress
) -> DriveReport:
    """End a drive that is for a picture by what the robot has mapped on the way.

    Where it proves that the robot does not fit at the goal, it is sent to the nearest place where
    it does. Where it has arrived, it is turned to what no picture shows.

    Args:
        wait_s: Robot time to wait for another drive.

    Returns:
        Of the drive that goes on, or of this one with the pose after the turn; the same report
        where nothing is to be done, or another drive has been started by now.
    """
    drive, state = report.drive, report.status.state
    latest = site.drives.latest
    is_latest = latest is not None and _is_last_drive_of(drive, latest)
    if not drive.purpose.is_for_picture or not is_latest:
        return report
    try:
        if state is GoalState.BLOCKED:
            report = await _drive_nearby(site, report, wait_s, on_progress)
        if report.status.state is GoalState.ARRIVED:
            report = await _turn_to_new_walls(site, report, on_progress)
    except (GoalError, PolicyError):
        # The robot was stopped or another client drives it: how this drive ended stays true.
        return report
    return report


def _is_last_drive_of(drive: Drive, latest: Drive) -> bool:
    """Return True when a drive is the latest, or another one that goes on with it, but no turn."""
    asked = latest.part_of or latest
    return asked.goal_id == drive.goal_id and latest.purpose.is_for_picture


def _choose_face(drive: Drive) -> Face:
    return face_room if drive.purpose is GoalPurpose.LOOK_INSIDE else face_new_walls


async def _drive_nearby(
    site: PictureContext, report: DriveReport, wait_s: float, on_progress: OnProgress
) -> DriveReport:
    """Send the robot to the place nearest to a goal at which it does not fit."""
    drive = report.drive
    world, views = await site.fetch_world_model(), site.pictures.views
    point = await site.compute(partial(find_room_near, world, drive.goal.point))
    if point is None:
        return report
    pose = Pose(point.x, point.y, drive.goal.yaw_rad)
    pose = await site.compute(partial(_choose_face(drive), world, pose, views))
    nearby = await site.drives.start(
        pose, place=drive.place, ticket=drive.ticket, purpose=drive.purpose, part_of=drive
    )
    ended = await site.drives.wait(nearby.goal_id, wait_s=wait_s, on_progress=on_progress)
    return ended.as_asked


async def _turn_to_new_walls(
    site: PictureContext, report: DriveReport, on_progress: OnProgress
) -> DriveReport:
    drive = report.drive
    world, views = await site.fetch_world_model(), site.pictures.views
    pose = await site.compute(partial(_choose_face(drive), world, report.pose, views))
    if pose == report.pose:
        return report
    turn = await site.drives.start(pose, place=name_turn(pose), ticket=drive.ticket, part_of=drive)
    turned = await site.drives.wait(turn.goal_id, wait_s=TURN_S, on_progress=on_progress)
    faced = replace(drive.goal, yaw_rad=pose.yaw_rad)
    return replace(
        turned,
        drive=replace(drive, goal=faced),
        status=report.status,
        elapsed_s=report.elapsed_s + turned.elapsed_s,
        driven_m=report.driven_m + turned.driven_m,
    )
