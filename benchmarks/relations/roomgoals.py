"""Goals in and around rooms: corners, walls, the middle, outside."""

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from benchmarks.relations.goal import COMPASS, Goal
from benchmarks.relations.sites import TrueRoom
from benchmarks.relations.truth import Fit, Fitting, Places, Truth, angle_off, away, bearing
from mapspeak.geometry import Point

__all__ = ["build_room_goals"]

DIAGONAL = {
    "north-east": (1, 1),
    "north-west": (-1, 1),
    "south-west": (-1, -1),
    "south-east": (1, -1),
}


def build_room_goals(truth: Truth, rooms: dict[str, TrueRoom]) -> Iterator[Goal]:
    """Return the goals of up to four rooms, by the ids they go by."""
    for room_id, room in itertools.islice(rooms.items(), 4):
        yield from _corners(truth, room_id, room)
        yield from _walls(truth, room_id, room)
        yield Goal(words=f"the middle of {room_id}", fits=_middle(truth, room))
        for name, heading_rad in itertools.islice(COMPASS.items(), 2):
            yield Goal(words=f"{name} of {room_id}", fits=_beyond(room, heading_rad))
        yield Goal(words=f"next to {room_id}", fits=_outside(truth, room))


def _corners(truth: Truth, room_id: str, room: TrueRoom) -> Iterator[Goal]:
    xs, ys = [p.x for p in room.corners], [p.y for p in room.corners]
    half = ((max(xs) - min(xs)) / 2, (max(ys) - min(ys)) / 2)
    middle = Point((max(xs) + min(xs)) / 2, (max(ys) + min(ys)) / 2)
    is_upright = all(
        abs(abs(p.x - middle.x) - half[0]) < 0.05 and abs(abs(p.y - middle.y) - half[1]) < 0.05
        for p in room.corners
    )
    yield Goal(words=f"corner of {room_id}", fits=_any_of(truth, room.corners, room))
    for name, (x, y) in itertools.islice(DIAGONAL.items(), 3 if is_upright else 0):
        corner = Point(middle.x + x * half[0], middle.y + y * half[1])
        yield Goal(
            words=f"{name} corner of {room_id}",
            fits=_any_of(truth, (corner,), room),
            looks_at=corner,
        )


def _any_of(truth: Truth, corners: Sequence[Point], room: TrueRoom) -> Fit:
    def fits(points: Places, *, strict: bool) -> Fitting:
        near_m = np.min([away(corner, points) for corner in corners], axis=0)
        is_near = near_m <= (0.7 if strict else 1.8)
        return np.asarray(is_near & truth.in_room(room, points))

    return fits


def _walls(truth: Truth, room_id: str, room: TrueRoom) -> Iterator[Goal]:
    for name, heading_rad in itertools.islice(COMPASS.items(), 3):
        for one, other in zip(room.corners, room.corners[1:] + room.corners[:1], strict=True):
            outward_rad = one.bearing_to(other) - math.pi / 2
            if float(angle_off(outward_rad, heading_rad)) < math.radians(35):
                fits = _at_wall(truth, room, one, other)
                yield Goal(words=f"along the {name} wall of {room_id}", fits=fits)


def _at_wall(truth: Truth, room: TrueRoom, one: Point, other: Point) -> Fit:
    def fits(points: Places, *, strict: bool) -> Fitting:
        turn = bearing(one, points) - one.bearing_to(other)
        along_m, off_m = away(one, points) * np.cos(turn), away(one, points) * np.sin(turn)
        high_m = truth.site.radius_m + (0.4 if strict else 1.0)
        is_beside = (along_m >= 0.3) & (along_m <= one.distance_to(other) - 0.3)
        return is_beside & (off_m <= high_m) & truth.in_room(room, points)

    return fits


def _middle(truth: Truth, room: TrueRoom) -> Fit:
    middle = room.middle
    size_m = room.corners[0].distance_to(room.corners[2])
    here = truth.places[truth.in_room(room, truth.places)]
    best_m = float(away(middle, here).min(initial=math.inf))

    def fits(points: Places, *, strict: bool) -> Fitting:
        slack_m = 0.0 if strict else max(0.5, 0.05 * size_m)
        return (
            (away(middle, points) <= best_m + slack_m)
            & truth.in_room(room, points)
            & (best_m < (1.8 if strict else 2.2))
        )

    return fits


def _beyond(room: TrueRoom, heading_rad: float) -> Fit:
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    ahead = [corner.x * cos + corner.y * sin for corner in room.corners]
    across = [-corner.x * sin + corner.y * cos for corner in room.corners]

    def fits(points: Places, *, strict: bool) -> Fitting:
        forward_m = points[:, 0] * cos + points[:, 1] * sin - max(ahead)
        aside_m = -points[:, 0] * sin + points[:, 1] * cos
        slack_m = -0.2 if strict else 0.9 * np.maximum(forward_m, 0) + 0.1
        is_beside = (aside_m >= min(across) - slack_m) & (aside_m <= max(across) + slack_m)
        low, high = (0.6, 1.4) if strict else (0.0, 2.8)
        return is_beside & (forward_m >= low) & (forward_m <= high)

    return fits


def _outside(truth: Truth, room: TrueRoom) -> Fit:
    def fits(points: Places, *, strict: bool) -> Fitting:
        edge_m = np.full(len(points), math.inf)
        for one, other in zip(room.corners, room.corners[1:] + room.corners[:1], strict=True):
            gap_m = one.distance_to(other)
            turn = bearing(one, points) - one.bearing_to(other)
            along_m = np.clip(away(one, points) * np.cos(turn), 0, gap_m)
            x = one.x + along_m * (other.x - one.x) / gap_m
            y = one.y + along_m * (other.y - one.y) / gap_m
            edge_m = np.minimum(edge_m, np.hypot(points[:, 0] - x, points[:, 1] - y))
        is_near = edge_m <= (1.2 if strict else 1.8)
        return is_near & ~(truth.in_room(room, points) & (edge_m > 0.15))

    return fits
