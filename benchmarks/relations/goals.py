"""The goals of the benchmark: words, and which poses they may mean."""

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from benchmarks.relations.goal import COMPASS, Expected, Goal
from benchmarks.relations.roomgoals import build_room_goals
from benchmarks.relations.sites import TrueDoor, TrueRoom
from benchmarks.relations.truth import Fit, Fitting, Places, Truth, angle_off, away, bearing
from mapspeak.geometry import Point, Pose
from mapspeak.worldmodel.model import WorldModel

__all__ = ["build_goals"]


SAME_RATIO = 0.97
SIDES = {"left of": math.pi / 2, "right of": -math.pi / 2, "in front of": 0.0, "behind": math.pi}
SIDEWAYS = ("left of", "right of")


def build_goals(truth: Truth, world: WorldModel) -> Iterator[Goal]:
    """Return the goals of a site, under the ids that the world model gives its rooms and doors."""
    rooms = dict(_name_rooms(truth, world))
    doors = dict(_name_doors(truth, world))
    places = [(each.id, each.waypoint.pose) for each in world.places]
    yield from _sides(truth, places)
    yield from _rings(truth, places)
    yield from _pairs(truth, places)
    yield from _views(truth, places)
    yield from _doors(truth, doors)
    yield from build_room_goals(truth, rooms)
    yield from _nearest(truth, doors, places, n_doors_found=len(world.rooms.doors))
    yield from _chains(truth, rooms, places)
    yield from _questions(rooms, places)


def _name_rooms(truth: Truth, world: WorldModel) -> Iterator[tuple[str, TrueRoom]]:
    """Return the rooms that the division of the map found as they are: ids name its rooms."""
    rows, cols = np.nonzero(world.rooms.labels)
    points = truth.site.grid.points_at(rows, cols)
    labels = world.rooms.labels[rows, cols]
    for room in truth.site.rooms:
        inside = truth.in_room(room, points)
        for region in world.rooms.regions:
            both = float((inside & (labels == region.index)).sum())
            if both > SAME_RATIO * max(float(inside.sum()), float((labels == region.index).sum())):
                yield region.id, room


def _name_doors(truth: Truth, world: WorldModel) -> Iterator[tuple[str, TrueDoor]]:
    for door in truth.site.doors:
        near = [each for each in world.rooms.doors if each.place.distance_to(door.place) < 0.4]
        if len(near) == 1 and abs(near[0].width_m - door.width_m) < 0.3:
            yield near[0].id, door


def _sides(truth: Truth, places: Sequence[tuple[str, Pose]]) -> Iterator[Goal]:
    spellings = ("{side} {id}", "to the {side} {id}", "{under}_{id}", "the {side} {id}")
    for (place_id, pose), (number, (side, turn_rad)) in itertools.product(
        places, enumerate(SIDES.items())
    ):
        is_sideways = side in SIDEWAYS
        form = spellings[number] if is_sideways else spellings[0]
        words = form.format(side=side, id=place_id, under=side.replace(" ", "_"))
        fits = truth.towards(pose.point, pose.yaw_rad + turn_rad)
        yield Goal(words=words, fits=fits, looks_at=pose.point)
    for (place_id, pose), (name, heading_rad) in zip(
        places, itertools.cycle(COMPASS.items()), strict=False
    ):
        fits = truth.towards(pose.point, heading_rad)
        yield Goal(words=f"{name}_of {place_id.lower()}", fits=fits, looks_at=pose.point)
        fits = truth.towards(pose.point, heading_rad, 1.2)
        yield Goal(words=f"1.2 m {name} of {place_id}", fits=fits, looks_at=pose.point)
    for place_id, pose in places[:2]:
        fits = truth.towards(pose.point, math.pi / 4, 0.8)
        yield Goal(words=f"80 cm north-east of {place_id}", fits=fits, looks_at=pose.point)


def _rings(truth: Truth, places: Sequence[tuple[str, Pose]]) -> Iterator[Goal]:
    for (place_id, pose), away_m in zip(
        places, itertools.cycle((2.5, 1.0, 0.5, 9.0)), strict=False
    ):
        yield Goal(
            words=f"{away_m} metres from {place_id}",
            fits=_both(truth.at_distance(pose.point, away_m), _near(truth, pose.point)),
            looks_at=pose.point,
        )
        yield Goal(
            words=f"next to {place_id}",
            fits=_both(_within(pose.point, truth.site.radius_m, 1.6), _near(truth, pose.point)),
            looks_at=pose.point,
        )
        yield Goal(
            words=f"facing the {place_id}",
            fits=_both(_within(pose.point, truth.site.radius_m, 3.1), _near(truth, pose.point)),
            looks_at=pose.point,
        )


def _near(truth: Truth, thing: Point) -> Fit:
    room = truth.room_at(thing)

    def fits(points: Places, *, strict: bool) -> Fitting:
        del strict
        return truth.near(thing, room, points)

    return fits


def _inside(truth: Truth, room: TrueRoom) -> Fit:
    def fits(points: Places, *, strict: bool) -> Fitting:
        del strict
        return truth.in_room(room, points)

    return fits


def _within(thing: Point, low_m: float, high_m: float) -> Fit:
    def fits(points: Places, *, strict: bool) -> Fitting:
        margin_m = 0.2 if strict else 0.0
        found_m = away(thing, points)
        return (found_m >= low_m + margin_m) & (found_m <= high_m - margin_m)

    return fits


def _both(one: Fit, other: Fit) -> Fit:
    def fits(points: Places, *, strict: bool) -> Fitting:
        return one(points, strict=strict) & other(points, strict=strict)

    return fits


def _pairs(truth: Truth, places: Sequence[tuple[str, Pose]]) -> Iterator[Goal]:
    forms = ("between {} and {}", "between {}, {}", "between({}, {})", "in between {} and the {}")
    pairs = list(itertools.combinations(places, 2))[:8]
    for (one, other), form in zip(pairs, itertools.cycle(forms), strict=False):
        yield Goal(
            words=form.format(one[0], other[0]),
            fits=_between(truth, one[1].point, other[1].point),
        )


def _between(truth: Truth, one: Point, other: Point) -> Fit:
    """Return what is half way: on the line where it is free, else on the shortest way."""
    gap_m = one.distance_to(other)
    is_free = truth.sees(np.array([[one.x, one.y]]), other)[0]

    def fits_line(points: Places, *, strict: bool) -> Fitting:
        turn = bearing(one, points) - one.bearing_to(other)
        share = away(one, points) * np.cos(turn) / gap_m
        aside = np.abs(away(one, points) * np.sin(turn)) / gap_m
        slack = 0.1 if strict else 0.22
        return (np.abs(share - 0.5) <= slack) & (aside <= (0.1 if strict else 0.27))

    def fits_way(points: Places, *, strict: bool) -> Fitting:
        from_one, from_other = truth.paths_m(one), truth.paths_m(other)
        whole_m = float(from_one[int(np.argmin(away(other, truth.places)))])
        at = [int(np.argmin(np.hypot(*(truth.places - each).T))) for each in points]
        first_m, second_m = from_one[at], from_other[at]
        slack = 0.05 if strict else 0.25
        is_half = np.abs(first_m - second_m) <= slack * whole_m + 0.2
        return is_half & (first_m + second_m <= (1 + slack) * whole_m + 0.3)

    return fits_line if is_free else fits_way


def _views(truth: Truth, places: Sequence[tuple[str, Pose]]) -> Iterator[Goal]:
    """Return sides of bare points, which have no front of their own."""
    robot = truth.site.robot
    for (_, pose), (side, turn_rad) in zip(places, itertools.cycle(SIDES.items()), strict=False):
        spot = Point(round(pose.x, 1), round(pose.y, 1))
        if robot.point.distance_to(spot) < 0.5:
            continue
        look_rad = robot.point.bearing_to(spot)
        heading_rad = look_rad + (turn_rad if side in SIDEWAYS else turn_rad + math.pi)
        yield Goal(
            words=f"{side} {spot.x}, {spot.y}",
            fits=truth.towards(spot, heading_rad),
            looks_at=spot,
        )
    for (one_id, one), (other_id, other) in itertools.islice(itertools.permutations(places, 2), 4):
        look_rad = other.point.bearing_to(one.point)
        yield Goal(
            words=f"left of {one_id} as seen from {other_id}",
            fits=truth.towards(one.point, look_rad + math.pi / 2),
            looks_at=one.point,
        )
    yield Goal(
        words="1.5 m in front of the robot",
        fits=truth.towards(robot.point, robot.yaw_rad, 1.5),
    )


def _doors(truth: Truth, doors: dict[str, TrueDoor]) -> Iterator[Goal]:
    for door_id, door in itertools.islice(doors.items(), 5):
        viewer = _near_side(truth, door)
        for side in SIDES:
            yield Goal(
                words=f"{side} {door_id}",
                fits=truth.beside_door(door, side, viewer),
                looks_at=door.place,
            )
        yield Goal(
            words=f"next to the {door_id}",
            fits=truth.out_of_the_way(door, viewer),
            looks_at=door.place,
        )
        yield Goal(
            words=f"2m from {door_id}",
            fits=truth.before_door(door, viewer, 2.0),
            looks_at=door.place,
        )
    for one, other in itertools.islice(itertools.combinations(doors, 2), 4):
        fits = _between(truth, doors[one].place, doors[other].place)
        yield Goal(words=f"between {one} and {other}", fits=fits)


def _near_side(truth: Truth, door: TrueDoor) -> Point:
    sides = [
        Point(
            door.place.x + sign * 0.6 * math.cos(door.normal_rad),
            door.place.y + sign * 0.6 * math.sin(door.normal_rad),
        )
        for sign in (1, -1)
    ]
    return min(sides, key=lambda side: truth.way_m(truth.from_robot_m, side))


def _nearest(
    truth: Truth,
    doors: dict[str, TrueDoor],
    places: Sequence[tuple[str, Pose]],
    *,
    n_doors_found: int,
) -> Iterator[Goal]:
    if len(doors) == len(truth.site.doors) == n_doors_found > 0:
        ways_m = {name: truth.way_m(truth.from_robot_m, door.place) for name, door in doors.items()}
        best_m = min(ways_m.values())
        best = tuple(name for name, way_m in ways_m.items() if way_m <= best_m + 0.3)
        yield Goal(words="the nearest door", expected=Expected.THING, says=best)
    reached = [(name, pose) for name, pose in places if truth.is_standable(pose.point)]
    ways = {name: truth.way_m(truth.from_robot_m, pose.point) for name, pose in reached}
    best = tuple(name for name, way_m in ways.items() if way_m <= min(ways.values()) + 0.3)
    yield Goal(words="nearest remembered place", expected=Expected.THING, says=best)


def _chains(
    truth: Truth, rooms: dict[str, TrueRoom], places: Sequence[tuple[str, Pose]]
) -> Iterator[Goal]:
    robot = truth.site.robot.point
    for room_id, room in itertools.islice(rooms.items(), 3):
        middle = room.middle
        if truth.room_at(robot) is room and room.corners[0].distance_to(room.corners[2]) > 9:
            continue
        for side, turn_rad in (("left of", math.pi / 2), ("right of", -math.pi / 2)):
            heading_rad = robot.bearing_to(middle) + turn_rad
            yield Goal(
                words=f"{side} the middle of {room_id}",
                fits=_both(
                    _inside(truth, room),
                    _loosely_towards(truth, middle, heading_rad),
                ),
            )
    place_id, pose = places[0]
    yield Goal(
        words=f"2 m north of {place_id} facing {places[1][0]}",
        fits=truth.towards(pose.point, math.pi / 2, 2.0),
        looks_at=places[1][1].point,
    )


def _loosely_towards(truth: Truth, thing: Point, heading_rad: float) -> Fit:
    """Return a direction from what is known to a quarter of a metre only."""

    def fits(points: Places, *, strict: bool) -> Fitting:
        off = angle_off(bearing(thing, points), heading_rad)
        found_m = away(thing, points)
        low, high = (0.7, 1.3) if strict else (0.2, 2.8)
        is_seen = truth.sees(points, thing)
        for step_m in (-0.1, 0.1):
            is_seen |= truth.sees(points, Point(thing.x, thing.y + step_m))
        is_there = (found_m >= low) & (found_m <= high) & is_seen
        return is_there & (off <= math.radians(25 if strict else 60))

    return fits


def _questions(rooms: dict[str, TrueRoom], places: Sequence[tuple[str, Pose]]) -> Iterator[Goal]:
    """Return what has to be refused or asked back."""
    first = places[0][0]
    yield Goal(words="left of W99", expected=Expected.REFUSED, says=("W99",))
    yield Goal(words=f"between {first} and {first}", expected=Expected.REFUSED, says=("next to",))
    yield Goal(words=f"-1 m from {first}", expected=Expected.REFUSED, says=("above zero",))
    yield Goal(words=f"corner of {first}", expected=Expected.REFUSED, says=("next to",))
    yield Goal(
        words=f"left of the left of the left of the left of the left of {first}",
        expected=Expected.REFUSED,
        says=("more than 4",),
    )
    yield Goal(words="north of twin", expected=Expected.ASKED, says=_twins(places))
    for room_id in itertools.islice(rooms, 1):
        yield Goal(words=f"40 m north of {room_id}", expected=Expected.REFUSED)


def _twins(places: Sequence[tuple[str, Pose]]) -> tuple[str, ...]:
    return tuple(place_id for place_id, _ in places[-2:])
