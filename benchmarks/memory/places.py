"""How far off remembered places are: ours, and by rules that are told what belongs together."""

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.memory.observer import Memory, views_of
from benchmarks.memory.sites import Site, TrueThing
from mapspeak.geometry import Point
from mapspeak.memory import Landmark, Waypoint
from mapspeak.memory.things.finding import Things
from mapspeak.memory.things.sight import SightMap
from mapspeak.memory.things.thing import Thing

__all__ = ["PlaceError", "measure_places", "truth_of"]

Views = Sequence[tuple[Waypoint, Landmark]]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaceError:
    """How far off a thing that was seen three times is.

    Attributes:
        site: In which building.
        label: Of the thing.
        n_wrong: How many of its views are wrong.
        ours_m: As remembered; infinite where no thing was made of the views.
        is_held: Whether it lies within the radius that holds 90 %.
        radius_m: That radius; infinite where no thing was made of the views.
        own_pose_m: Where the observer stood, mean of the three.
        intersection_m: The point nearest to the three lines of sight.
        first_wall_m: The first obstacle along one direction, mean of the three.
    """

    site: str
    label: str
    n_wrong: int
    ours_m: float
    is_held: bool
    radius_m: float
    own_pose_m: float
    intersection_m: float
    first_wall_m: float


def truth_of(memory: Memory, thing: Thing) -> TrueThing | None:
    """Return what most views of a remembered thing were truly of, wrong ones not counted."""
    counts: Counter[TrueThing] = Counter()
    for view in thing.supporting:
        key = view.waypoint, view.landmark
        if key not in memory.wrong:
            counts[memory.truth[key]] += 1
    return counts.most_common(1)[0][0] if counts else None


def measure_places(site: Site, memory: Memory, found: Things) -> Iterator[PlaceError]:
    """Return the errors of all things that were written down three times."""
    remembered: dict[TrueThing, Thing] = {}
    for thing in found.things:
        truth = truth_of(memory, thing)
        if truth is not None and thing.position is not None:
            remembered.setdefault(truth, thing)
    for truth in memory.annotated:
        views = views_of(memory, truth)
        if len(views) != 3:
            continue
        ours = remembered.get(truth)
        at = ours.position if ours else None
        ours_m = math.inf if at is None else at.distance_to(truth.point)
        walls = [_first_wall(found.sight, waypoint, landmark) for waypoint, landmark in views]
        crossing = _intersection(views)
        yield PlaceError(
            site=site.name,
            label=truth.label,
            n_wrong=sum((waypoint.name, mark) in memory.wrong for waypoint, mark in views),
            ours_m=ours_m,
            is_held=ours is not None and ours_m <= (ours.uncertainty_m or 0.0),
            radius_m=math.inf if ours is None else ours.uncertainty_m or math.inf,
            own_pose_m=_mean_off(truth, [waypoint.pose.point for waypoint, _ in views]),
            intersection_m=crossing.distance_to(truth.point),
            first_wall_m=_mean_off(truth, walls),
        )


def _mean_off(truth: TrueThing, points: Sequence[Point]) -> float:
    return float(np.mean([point.distance_to(truth.point) for point in points]))


def _first_wall(sight: SightMap, waypoint: Waypoint, landmark: Landmark) -> Point:
    way = waypoint.pose.yaw_rad + (landmark.bearing_rad or 0.0)
    start = np.array([[waypoint.pose.x, waypoint.pose.y]])
    far_m = sight.cast(
        sight.obstacle_off,
        sight.grid.fractional_cells_at(start),
        np.array([way - sight.grid.origin.yaw_rad]),
    )[0]
    return Point(waypoint.pose.x + far_m * math.cos(way), waypoint.pose.y + far_m * math.sin(way))


def _intersection(views: Views) -> Point:
    """Return the point with the least squared distance to all lines of sight."""
    left, right = np.zeros((2, 2)), np.zeros(2)
    for waypoint, landmark in views:
        way = waypoint.pose.yaw_rad + (landmark.bearing_rad or 0.0)
        across = np.array([-math.sin(way), math.cos(way)])
        left += np.outer(across, across)
        right += across * (across @ (waypoint.pose.x, waypoint.pose.y))
    x, y = np.linalg.lstsq(left, right, rcond=None)[0].tolist()
    return Point(x, y)
