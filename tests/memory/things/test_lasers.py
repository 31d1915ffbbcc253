"""What a laser adds to lines of sight: where the map lacks something, and where it does not."""

import math
from dataclasses import replace

import numpy as np
import pytest

from drawing import grid_from_text
from fakes import scan_of
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, SemanticMap, Waypoint, build_ring
from mapspeak.memory.things.finding import find_things
from mapspeak.memory.things.likelihood import ViewLikelihood, build_outlook, weigh_view
from mapspeak.memory.things.sight import SightMap, build_sight_map, find_log_priors, look_around
from mapspeak.memory.things.thing import NOISE, Stance, Thing
from mapspeak.spatial import OccupancyGrid

CELL_M = 0.1
BARE = "#" * 60 + "\n" + ("#" + "." * 58 + "#\n") * 48 + "#" * 60
CUPBOARD = Point(3.0, 3.0)
STAND = Pose(3.0, 0.8, math.pi / 2)


def bare() -> OccupancyGrid:
    return grid_from_text(BARE, resolution_m=CELL_M)


def furnished() -> OccupancyGrid:
    """The same room with a cupboard of 0.8 m by 0.4 m in the middle of its floor."""
    rows = [list(line) for line in BARE.split("\n")]
    for y in np.arange(2.85, 3.2, CELL_M):
        for x in np.arange(2.65, 3.4, CELL_M):
            rows[len(rows) - 1 - int(y / CELL_M)][int(x / CELL_M)] = "#"
    return grid_from_text("\n".join(map("".join, rows)), resolution_m=CELL_M)


def look(
    pose: Pose, at: Point = CUPBOARD, *, truly: OccupancyGrid | None, off_deg: float = 0.0
) -> Waypoint:
    """A view of a thing, with what a laser met in the room as it truly is; None without a laser."""
    bearing_rad = pose.point.bearing_to(at) - pose.yaw_rad + math.radians(off_deg)
    fan = None
    if truly is not None:
        scan = scan_of(truly, pose)
        ring = build_ring(
            pose, angles_rad=scan.angles_rad, ranges_m=scan.ranges_m, reach_m=scan.reach_m
        )
        fan = ring.find_fan(pose, bearing_rad)
        assert fan is not None
    mark = Landmark(label="cupboard", bearing_rad=bearing_rad, laser=fan)
    return Waypoint(name=f"from {pose}", pose=pose, functional_landmarks=(mark,))


def the_thing(*looks: Waypoint, grid: OccupancyGrid) -> Thing:
    (thing,) = find_things(SemanticMap(waypoints=looks), grid).things
    return thing


def off_m(thing: Thing, point: Point = CUPBOARD) -> float:
    assert thing.position is not None
    return thing.position.distance_to(point)


def weighed(
    grid: OccupancyGrid, truly: OccupancyGrid | None
) -> tuple[SightMap, ViewLikelihood, dict[float, float]]:
    """The view straight ahead, and by metres ahead how likely the thing is there."""
    sight, place = build_sight_map(grid), look(STAND, truly=truly)
    (near,), (far,) = look_around(sight, [STAND])
    outlook = build_outlook(sight, STAND, near, far)
    view = weigh_view(sight, outlook, STAND, place.landmarks[0])
    assert view is not None
    weights = view.ratios * np.exp(
        find_log_priors(sight, view.cells, [view.update], Stance.ANYWHERE)
    )
    rows, cols = sight.rows.ravel()[view.cells], sight.cols.ravel()[view.cells]
    ahead_m, aside_m = rows * CELL_M - STAND.y, np.abs(cols * CELL_M - STAND.x)
    is_ahead = aside_m < 0.15
    by_range = {
        round(float(at), 1): float(weights[is_ahead & (np.abs(ahead_m - at) < 0.01)].max())
        for at in ahead_m[is_ahead]
    }
    return sight, view, by_range


def near_to(weights: dict[float, float], range_m: float) -> float:
    return weights[min(weights, key=lambda each: abs(each - range_m))]


def test_on_a_map_of_bare_walls_what_the_laser_met_is_where_the_thing_is() -> None:
    stands = [STAND, Pose(1.2, 1.5, 0.6), Pose(5.0, 1.6, 2.4)]
    before = the_thing(*(look(each, truly=None, off_deg=6) for each in stands), grid=bare())
    after = the_thing(*(look(each, truly=furnished(), off_deg=6) for each in stands), grid=bare())
    assert off_m(after) < 0.35
    assert off_m(after) < off_m(before)
    assert after.uncertainty_m is not None
    assert off_m(after) <= after.uncertainty_m


def test_one_look_alone_places_a_thing_at_what_the_laser_met() -> None:
    (before, after) = (
        the_thing(look(STAND, truly=truly), grid=bare()) for truly in (None, furnished())
    )
    assert off_m(before) > 1.0
    assert off_m(after) < 0.4


def test_cells_on_the_surface_are_likelier_and_those_behind_less_likely_than_without() -> None:
    _, _, without = weighed(bare(), None)
    _, _, with_laser = weighed(bare(), furnished())
    assert near_to(with_laser, 2.1) > 10 * near_to(without, 2.1)
    assert near_to(with_laser, 4.1) == pytest.approx(
        NOISE.seen_over_ratio * near_to(without, 4.1), rel=0.01
    )


def test_what_the_map_has_where_the_beams_passed_is_less_likely_but_not_ruled_out() -> None:
    _, _, without = weighed(furnished(), None)
    _, _, with_laser = weighed(furnished(), bare())
    share = near_to(with_laser, 2.1) / near_to(without, 2.1)
    assert share == pytest.approx(NOISE.laser_through_ratio, rel=0.01)


def test_what_hangs_on_the_wall_above_what_the_laser_met_is_still_found_there() -> None:
    at = Point(3.0, 4.8)
    stands = [STAND, Pose(1.2, 1.5, 1.0), Pose(5.0, 1.6, 2.2), Pose(2.2, 1.0, 1.5)]
    sign = the_thing(*(look(each, at, truly=furnished()) for each in stands), grid=bare())
    assert off_m(sign, at) < 0.4


@pytest.mark.parametrize("room", [bare, furnished])
def test_on_a_fresh_map_a_laser_changes_nothing(room: object) -> None:
    assert callable(room)
    stands = [STAND, Pose(1.2, 1.5, 0.6), Pose(5.0, 1.6, 2.4)]
    before, after = (
        the_thing(*(look(each, truly=truly, off_deg=8) for each in stands), grid=room())
        for truly in (None, room())
    )
    assert after.position == before.position
    assert after.uncertainty_m == before.uncertainty_m


def test_one_beam_that_slips_past_a_corner_says_nothing() -> None:
    place, past = (look(STAND, truly=truly) for truly in (furnished(), bare()))
    (mark,), (other,) = place.landmarks, past.landmarks
    assert mark.laser is not None
    assert other.laser is not None
    middle = len(mark.laser.ranges_m) // 2
    beams = list(mark.laser.ranges_m)
    beams[middle] = other.laser.ranges_m[middle]
    told = replace(mark, laser=replace(mark.laser, ranges_m=tuple(beams)))
    slipped = the_thing(replace(place, functional_landmarks=(told,)), grid=furnished())
    plain = the_thing(look(STAND, truly=None), grid=furnished())
    assert slipped.position == plain.position
    assert slipped.uncertainty_m == plain.uncertainty_m


def test_beams_that_met_nothing_and_beams_of_which_nothing_is_known_make_no_surface() -> None:
    place = look(STAND, truly=furnished())
    (mark,) = place.landmarks
    assert mark.laser is not None
    n = len(mark.laser.ranges_m)
    unknown = replace(mark.laser, ranges_m=(None,) * n)
    opened = replace(mark.laser, ranges_m=(math.inf,) * n, reach_m=2.0)
    plain = the_thing(look(STAND, truly=None), grid=bare())
    for fan in (unknown, opened):
        told = replace(place, functional_landmarks=(replace(mark, laser=fan),))
        assert the_thing(told, grid=bare()).position == plain.position


def test_the_same_surface_met_from_many_places_counts_once() -> None:
    sight, view, _ = weighed(bare(), furnished())
    once = find_log_priors(sight, view.cells, [view.update], Stance.ANYWHERE)
    often = find_log_priors(sight, view.cells, [view.update] * 20, Stance.ANYWHERE)
    assert np.array_equal(once, often)


def test_a_map_that_is_turned_and_shifted_gives_the_same_answer() -> None:
    motion = Pose(-7.0, 3.0, 0.7)
    stands = [STAND, Pose(1.2, 1.5, 0.6), Pose(5.0, 1.6, 2.4)]
    looks = [look(each, truly=furnished(), off_deg=6) for each in stands]
    here = the_thing(*looks, grid=bare())
    grid = replace(bare(), origin=motion @ bare().origin)
    there = the_thing(*(each.moved(motion) for each in looks), grid=grid)
    assert here.position is not None
    assert off_m(there, motion.transform(here.position)) < 0.02


def test_a_beam_that_ends_off_the_map_says_nothing() -> None:
    place = look(STAND, truly=bare())
    (mark,) = place.landmarks
    assert mark.laser is not None
    far = replace(mark.laser, ranges_m=(900.0,) * len(mark.laser.ranges_m))
    told = replace(place, functional_landmarks=(replace(mark, laser=far),))
    assert the_thing(told, grid=bare()).position is not None
