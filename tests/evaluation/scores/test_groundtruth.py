import numpy as np
import pytest

from mapspeak.evaluation.scores.groundtruth import GroundTruth
from mapspeak.geometry import Point, Pose
from mapspeak.simulator import TrueRoom, World, WorldWall
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


def test_a_place_is_seen_from_its_own_room_and_not_through_a_wall() -> None:
    site = two_rooms(gap_m=0.6)
    for y in (-1.0, 1.0):
        seen = site.seen_near(Point(3.0, y), 2.0)
        rows, cols = np.nonzero(seen)
        places = site.grid.points_at(rows, cols)
        assert len(places) > 20
        assert (np.hypot(places[:, 0] - 3.0, places[:, 1] - y) <= 2.0).all()
        assert (places[:, 0] < 4.0).all()


def test_what_hangs_on_a_wall_is_seen_from_before_it_though_the_wall_is_solid() -> None:
    site = two_rooms(gap_m=0.6)
    rows, cols = np.nonzero(site.seen_near(Point(3.98, 1.2), 2.0))
    places = site.grid.points_at(rows, cols)
    assert (places[:, 0] < 4.0).sum() > 20


def test_ways_are_as_long_as_the_floor_makes_them() -> None:
    site = two_rooms(gap_m=0.7)
    goal = site.near(Point(7.0, 0.0), 0.1)
    assert site.shortest_to_any_m(Point(1.0, 0.0), goal) == pytest.approx(6.0, abs=0.2)
    assert site.shortest_to_any_m(Point(1.0, 0.0), np.zeros_like(goal)) == np.inf
