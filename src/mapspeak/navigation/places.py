"""Places by id, by remembered name, or by coordinates, each as a pose to drive to."""

import math
import re
from dataclasses import dataclass

from mapspeak.errors import GoalError
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.navigation.atlas import Atlas, RememberedPlace
from mapspeak.navigation.goals import GoalCheck, check_goal
from mapspeak.semantic import SemanticMap, Waypoint, find_waypoints, name_key
from mapspeak.spatial.rooms import Door, Region

__all__ = ["NamedPose", "choose_goal", "find_place", "looks_like_id"]

MOST_NAMED = 12
ID = re.compile(r"(?P<letter>[A-Za-z])(?P<number>\d+)")


@dataclass(frozen=True, slots=True)
class NamedPose:
    """A pose with what it is called.

    Attributes:
        name: Such as "R3" or "(1.20, -3.40)".
        pose: Where to stand.
    """

    name: str
    pose: Pose


def find_place(atlas: Atlas, place: str) -> NamedPose:
    """Finds the pose to go to for a place's id or remembered name.

    Raises:
        GoalError: There is no such place, or the robot cannot get to it.
    """
    wanted = place.strip()
    match = ID.fullmatch(wanted)
    pose = _find_by_id(atlas, wanted.upper()) if match else None
    if pose is None:
        pose = _find_by_name(atlas, wanted)
    if pose is None:
        raise GoalError(_what_became_of(atlas, wanted), hint=_known_places(atlas, wanted))
    return NamedPose(wanted.upper() if match else wanted, pose)


def looks_like_id(name: str) -> bool:
    """True for what is read as an id of the map: a letter and a number."""
    return ID.fullmatch(name.strip()) is not None


def _find_by_id(atlas: Atlas, place_id: str) -> Pose | None:
    region = atlas.rooms.find_region(place_id)
    if region is not None:
        return _region_pose(atlas, region)
    for door in atlas.rooms.doors:
        if door.id == place_id:
            return _door_pose(atlas, door)
    frontier = atlas.frontiers.find(place_id)
    if frontier is not None:
        return frontier.pose
    return next((each.waypoint.pose for each in atlas.places if each.id == place_id), None)


def _find_by_name(atlas: Atlas, name: str) -> Pose | None:
    wanted = name_key(name)
    named = (each for each in atlas.places if name_key(each.waypoint.name) == wanted)
    place: RememberedPlace | None = next(named, None)
    return None if place is None else place.waypoint.pose


def _region_pose(atlas: Atlas, region: Region) -> Pose:
    point = atlas.find_standing_point(region)
    if point is None:
        raise GoalError(
            f"The robot cannot get into {region.id}: no way as wide as its "
            f"{2 * atlas.radius_m:.2f} m leads there on the map so far.",
            hint="Call look_at_map and choose a place that has a path, or explore a frontier.",
        )
    return atlas.arrival_pose(point)


def _door_pose(atlas: Atlas, door: Door) -> Pose:
    return atlas.arrival_pose(_reachable_near(atlas, door))


def _reachable_near(atlas: Atlas, door: Door) -> Point:
    if atlas.distances.is_reachable(door.place):
        return door.place
    raise GoalError(
        f"{door.id} is {door.width_m:.2f} m wide; the robot, {2 * atlas.radius_m:.2f} m wide, "
        "cannot stand in it.",
        hint=f"Go to {' or '.join(door.region_ids)} instead.",
    )


def _what_became_of(atlas: Atlas, place: str) -> str:
    gone = next((each for each in atlas.rooms.vanished if each.id == place.upper()), None)
    if gone is not None and gone.became:
        return f"{gone.id} is no longer found: its floor is now {' and '.join(gone.became)}."
    if gone is not None:
        return f"{gone.id} is no longer found on the map."
    if re.fullmatch(r"[Ff]\d+", place) and int(place[1:]) <= atlas.frontiers.n_named:
        return f"Frontier {place.upper()} is gone: what lay behind it has been seen or refused."
    return f"There is no place called {place[:80]!r}."


def _known_places(atlas: Atlas, wanted: str) -> str:
    mentioned = [
        f"{place.id} ({place.waypoint.name})"
        for match in find_waypoints(SemanticMap(waypoints=_waypoints(atlas)), wanted)
        for place in atlas.places
        if place.waypoint is match.waypoint
    ]
    if mentioned:
        return f"Remembered places that speak of it: {', '.join(mentioned)}. Go to one of them."
    groups = {
        "rooms": [region.id for region in atlas.rooms.regions],
        "doors": [door.id for door in atlas.rooms.doors],
        "frontiers": [frontier.id for frontier in atlas.frontiers.frontiers],
        "remembered": [place.id for place in atlas.places],
    }
    known = [f"{name} {_some_of(ids)}" for name, ids in groups.items() if ids]
    return f"Known are {'; '.join(known) or 'no places yet'}. Call look_at_map to see them."


def _some_of(ids: list[str]) -> str:
    shown = " ".join(ids[:MOST_NAMED])
    return shown if len(ids) <= MOST_NAMED else f"{shown} and {len(ids) - MOST_NAMED} more"


def _waypoints(atlas: Atlas) -> tuple[Waypoint, ...]:
    return tuple(place.waypoint for place in atlas.places)


def choose_goal(
    atlas: Atlas, *, place: str | None, x: float | None, y: float | None, yaw_deg: float | None
) -> NamedPose:
    """Gives the pose to drive to for a place or for coordinates, checked against the map.

    Raises:
        GoalError: Neither or both were given, there is no such place, or the robot cannot drive
            there; the hint names the nearest pose that would work.
    """
    goal = _read_goal(atlas, place, x, y)
    if yaw_deg is not None:
        yaw_rad = wrap_angle(math.radians(yaw_deg))
        goal = NamedPose(goal.name, Pose(goal.pose.x, goal.pose.y, yaw_rad))
    check = check_goal(atlas.grid, atlas.distances, goal.pose)
    if not check.is_ok:
        raise GoalError(f"{goal.name}: {check.sentence}", hint=_what_instead(check))
    return goal


def _read_goal(atlas: Atlas, place: str | None, x: float | None, y: float | None) -> NamedPose:
    if place is not None and x is None and y is None:
        return find_place(atlas, place)
    if place is None and x is not None and y is not None:
        pose = atlas.arrival_pose(Point(x, y))
        return NamedPose(f"({x:.2f}, {y:.2f})", pose)
    raise GoalError(
        "A goal is either a place or both x and y.",
        hint="Give place (an id such as R3, or a remembered name), or x and y in metres.",
    )


def _what_instead(check: GoalCheck) -> str:
    if check.nearest is None:
        return "No place near it works either; call look_at_map and choose another one."
    near = check.nearest
    return (
        f"The nearest pose that works is x={near.x:.2f}, y={near.y:.2f}, "
        f"yaw_deg={near.yaw_deg:.0f}; call navigate_to with it, or call look_at_map."
    )
