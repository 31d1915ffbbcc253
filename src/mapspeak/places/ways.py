"""How far it is between two places, and what the way leads through."""

from dataclasses import dataclass

import numpy as np

from mapspeak.geometry import Point, Pose
from mapspeak.places.naming import Place, Spot
from mapspeak.places.standing import (
    arrival_pose,
    choose_crossing,
    choose_standing_point,
    facing_in,
    stand_again,
    stand_before,
)
from mapspeak.spatial.frontiers import Frontier
from mapspeak.spatial.paths import DistanceField, Path
from mapspeak.spatial.rooms import Door, Region
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedPlace, RememberedThing


@dataclass(frozen=True, slots=True, kw_only=True)
class Way:
    """The way a robot would take from one place to another.

    Attributes:
        end: The point it ends at: in a room and before a thing, where the robot would stand.
        straight_m: As the crow flies: to and from a thing itself, else between the same points as
            the path. None for a thing without a position.
        path_m: By path, round what is slow; None where the robot cannot get through.
        through: Ids of the regions and doors on the way, in order, both ends included.
        clearance_m: From the robot's centre to the nearest obstacle, where it is least; None
            without a path.
    """

    start: Place
    goal: Place
    end: Point
    straight_m: float | None
    path_m: float | None = None
    through: tuple[str, ...] = ()
    clearance_m: float | None = None


def measure_path(world: WorldModel, start: Place, goal: Place) -> float | None:
    """Return the metres of the shortest path: "nearest" means that; None if there is no path."""
    distances = _distances_from(world, start)
    return None if distances is None else distances.distance_to(standing_point(world, goal))


def find_way(world: WorldModel, start: Place, goal: Place) -> Way:
    """Find the way between two places; of a room it is the point to stand in that counts."""
    end = standing_point(world, goal)
    at, to = find_own_point(world, start), find_own_point(world, goal)
    straight_m = None if at is None or to is None else at.distance_to(to)
    distances = _distances_from(world, start)
    path = None if distances is None else world.map.find_path_over(distances, end)
    if distances is None or path is None:
        return Way(start=start, goal=goal, end=end, straight_m=straight_m)
    cells = _cells_along(world, path)
    through = _name_regions(world, *cells)
    # From cell to cell a door is as wide as its posts' middles are apart; none has more room than
    # half of what is told as its width.
    half_m = [door.width_m / 2 for door in world.rooms.doors if door.id in through]
    return Way(
        start=start,
        goal=goal,
        end=end,
        straight_m=straight_m,
        # The way round is not the shortest one.
        path_m=path.length_m if world.map.weights is not None else distances.distance_to(end),
        through=through,
        clearance_m=min([float(world.map.clearance_m[cells].min()), *half_m]),
    )


def _distances_from(world: WorldModel, start: Place) -> DistanceField | None:
    """Return the distances from a place; None where no way begins.

    Elsewhere than where it is, a robot cannot squeeze out of a place that is too tight for it.
    """
    if isinstance(start.thing, Spot) and start.point == world.robot.point:
        return world.distances
    begin = standing_point(world, start)
    distances = world.map.distances_from(begin)
    return None if distances.lattice.index_at(begin) is None else distances


def standing_point(world: WorldModel, place: Place) -> Point:
    """Return the point from which and to which ways to a place are measured."""
    match place.thing:
        case Region() as region:
            return choose_standing_point(world, region)
        case Door() as door:
            return choose_crossing(world, door)
        case RememberedThing() as remembered:
            return stand_before(world, remembered).point
        case RememberedPlace(waypoint=waypoint):
            return stand_again(world, waypoint.pose).point
        case _:
            return place.point


def stand_at(world: WorldModel, place: Place) -> Pose:
    """Return the pose to drive to for a place, whether or not the robot can stand there."""
    match place.thing:
        case Region() as region:
            point = choose_standing_point(world, region)
            return Pose(point.x, point.y, facing_in(world, region, point))
        case Door() as door:
            return arrival_pose(world, choose_crossing(world, door))
        case Frontier(pose=pose):
            return pose
        case RememberedPlace(waypoint=waypoint):
            return stand_again(world, waypoint.pose)
        case RememberedThing() as remembered:
            return stand_before(world, remembered)
        case Spot(point=point, yaw_rad=yaw_rad):
            straight_on = arrival_pose(world, point)
            return straight_on if yaw_rad is None else Pose(point.x, point.y, yaw_rad)


def find_own_point(world: WorldModel, place: Place) -> Point | None:
    """Return where a thing is, None where nobody noted that; of others, where ways end."""
    if isinstance(place.thing, RememberedThing):
        return place.thing.thing.position
    return standing_point(world, place)


def _cells_along(world: WorldModel, path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return rows and columns of the cells that a path passes, a step for each cell's length."""
    points = path.sampled(world.grid.resolution_m)
    rows, cols = world.grid.cells_at(np.array([[point.x, point.y] for point in points]))
    return rows.clip(0, world.grid.n_rows - 1), cols.clip(0, world.grid.n_cols - 1)


def _name_regions(world: WorldModel, rows: np.ndarray, cols: np.ndarray) -> tuple[str, ...]:
    """Return the regions that some cells lie in, with the door between each and the next."""
    by_index = {region.index: region.id for region in world.rooms.regions}
    names: list[str] = []
    for row, col in zip(rows.tolist(), cols.tolist(), strict=True):
        name = by_index.get(int(world.rooms.labels[row, col]))
        if name is None or (names and names[-1] == name):
            continue
        if names:
            names += _door_between(world, names[-1], name, row, col)
        names.append(name)
    return tuple(names)


def _door_between(world: WorldModel, first: str, second: str, row: int, col: int) -> list[str]:
    doors = world.rooms.doors_between(first, second)
    x, y = world.grid.points_at(np.array([row]), np.array([col]))[0].tolist()
    nearest = min(doors, key=lambda door: door.place.distance_to(Point(x, y)), default=None)
    return [] if nearest is None else [nearest.id]
