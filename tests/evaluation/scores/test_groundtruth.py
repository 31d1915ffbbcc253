import numpy as np
import pytest

from mapspeak.evaluation.scores.groundtruth import GroundTruth
from mapspeak.geometry import Point, Pose
from mapspeak.simulator import TrueRoom, World, WorldObject, WorldWall, load_world
from mapspeak.spatial import Cell
from mapspeak.spatial.grid import FloatArray
from mapspeak.spatial.rooms import RoomClass

BEHIND = Point(6.0, 0.0)
"""In the middle of the room that the gap leads to."""


def two_rooms(*, gap_m: float) -> GroundTruth:
    """Gives two rooms of 4 x 4 m side by side, a gap in the wall between them, the robot in one."""
    corners = [Point(-2.0, -2.0), Point(8.0, -2.0), Point(8.0, 2.0), Point(-2.0, 2.0)]
    sides = list(zip(corners, (*corners[1:], corners[0]), strict=True))
    sides += [(Point(4.0, y), Point(4.0, y / 4 * gap_m)) for y in (2.0, -2.0)]
    walls = tuple(WorldWall(start=a, end=b, thickness_m=0.1, height_m=2.5) for a, b in sides)
    outline = (Point(4.0, -2.0), Point(8.0, -2.0), Point(8.0, 2.0), Point(4.0, 2.0))
    behind = TrueRoom(name="behind", room_class=RoomClass.ROOM, outline=outline)
    return GroundTruth(
        World(
            name="two rooms",
            title="Two rooms.",
            walls=walls,
            objects=(),
            rooms=(behind,),
            start=Pose(0.0, 0.0),
        )
    )


def test_floor_behind_a_gap_that_the_robot_does_not_drive_through_is_out_of_its_reach() -> None:
    # The body is 0.56 m wide, and keeps 0.03 m off everything on either side.
    narrow, wide = two_rooms(gap_m=0.6), two_rooms(gap_m=0.7)
    cell = narrow.grid.cell_at(BEHIND)
    assert narrow.floor.standable[cell.row, cell.col]
    assert not narrow.reachable[cell.row, cell.col]
    assert not narrow.rooms
    assert wide.reachable[cell.row, cell.col]
    assert [room.room.name for room in wide.rooms] == ["behind"]


def test_nothing_starts_where_the_robot_could_not_have_driven_in() -> None:
    site, random = two_rooms(gap_m=0.6), np.random.default_rng(1)
    assert all(site.draw_pose(random).x < 4.0 for _ in range(50))


def test_corners_into_which_the_robot_only_just_fits_stay_in_its_reach() -> None:
    site = two_rooms(gap_m=0.6)
    before_the_gap = site.floor.standable.copy()
    before_the_gap[:, site.grid.cell_at(Point(4.0, 0.0)).col :] = False
    assert (site.drivable | ~before_the_gap).all()


@pytest.mark.parametrize("gap_m", [0.6, 0.7])
def test_where_the_robot_drives_it_can_stand(gap_m: float) -> None:
    site = two_rooms(gap_m=gap_m)
    assert not (site.drivable & ~site.floor.standable).any()


def test_robots_begin_in_many_places_with_all_headings() -> None:
    site, random = two_rooms(gap_m=0.7), np.random.default_rng(1)
    poses = [site.draw_pose(random) for _ in range(60)]
    quarters = {int(pose.yaw_rad // (np.pi / 2)) for pose in poses}
    assert quarters == {-2, -1, 0, 1}
    assert len({(pose.x, pose.y) for pose in poses}) > 40


def seen_around(site: GroundTruth, kind: str, pose: Pose, radius_m: float) -> FloatArray:
    """Gives the places near a thing from which it is in sight, shape (n, 2)."""
    thing = WorldObject(name="it", kind=kind, pose=pose)
    rows, cols = np.nonzero(site.seen_around(thing, radius_m))
    return site.grid.points_at(rows, cols)


def test_a_thing_is_seen_from_its_own_room_and_not_through_a_wall() -> None:
    site = two_rooms(gap_m=0.7)
    for x in (3.0, 3.7):
        for y in (-1.6, 1.6):
            places = seen_around(site, "cabinet", Pose(x, y), 1.2)
            assert len(places) > 20
            assert (np.hypot(places[:, 0] - x, places[:, 1] - y) <= 1.2).all()
            assert (places[:, 0] < 4.0).all()


def test_what_hangs_on_a_wall_is_seen_from_before_it_though_the_wall_is_solid() -> None:
    site = two_rooms(gap_m=0.7)
    places = seen_around(site, "fire_extinguisher", Pose(3.95, 1.2, np.pi), 2.0)
    assert len(places) > 20
    assert (places[:, 0] < 3.95).all()


def test_a_task_begins_and_is_judged_by_one_and_the_same_sight() -> None:
    site = GroundTruth(load_world("office_1"))
    for thing in site.world.objects[::7]:
        seen = site.seen_around(thing, 3.0)
        rows, cols = np.nonzero(site.near(site.place_of(thing), 3.0) & site.drivable)
        every = [
            (row, col) for row, col in zip(rows, cols, strict=True) if not (row % 4 or col % 4)
        ]
        for row, col in every:
            place = site.grid.point_at(Cell(int(row), int(col)))
            assert site.is_in_sight(place, thing) == seen[row, col], thing.name


def test_ways_are_as_long_as_the_floor_makes_them() -> None:
    site = two_rooms(gap_m=0.7)
    goal = site.near(Point(7.0, 0.0), 0.1)
    assert site.shortest_to_any_m(Point(1.0, 0.0), goal) == pytest.approx(6.0, abs=0.2)
    assert site.shortest_to_any_m(Point(1.0, 0.0), np.zeros_like(goal)) == np.inf
