"""Frontiers that the robot has been to, or could not get to."""

from drawing import grid_from_text
from mapspeak.driving.drivereport import Drive
from mapspeak.driving.exploration.blocked import FrontierTries
from mapspeak.geometry import Point, Pose
from mapspeak.robot import GoalState, GoalStatus
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.frontiers import NOTHING_TRIED
from mapspeak.worldmodel.revision import MapRevision

CELL_M = 0.1
RADIUS_M = 0.25
ROBOT = Point(1.05, 0.85)
AHEAD = Point(1.75, 1.65)
BEHIND_THE_GAP = Point(4.05, 0.85)
GAP = Point(2.55, 0.85)
TWO_ROOMS = "\n".join(["#" * 50, *["#" + "." * 48 + "#"] * 17, "#" * 50])


def grid(*, gap_cells: int) -> OccupancyGrid:
    """Return two rooms with a gap of so many cells between them."""
    cells = grid_from_text(TWO_ROOMS, resolution_m=CELL_M).cells.copy()
    first = 10 - gap_cells // 2
    cells[1:-1, 24:26] = 0
    cells[:first, 24:26] = 100
    cells[first + gap_cells :, 24:26] = 100
    return OccupancyGrid(cells=cells, resolution_m=CELL_M)


def revision(*, gap_cells: int) -> MapRevision:
    return MapRevision(grid(gap_cells=gap_cells), radius_m=RADIUS_M)


def drive(goal_id: str, point: Point, state: GoalState, place: str = "F1") -> Drive:
    return Drive(
        goal_id=goal_id,
        goal=Pose(point.x, point.y),
        place=place,
        robot_goal_id="1",
        started_s=0.0,
        ended_at=ROBOT,
        final=GoalStatus(state=state),
    )


def test_a_frontier_that_was_reached_stays_tried() -> None:
    tries, narrow = FrontierTries(), revision(gap_cells=6)
    tries.learn([drive("G1", AHEAD, GoalState.ARRIVED)], narrow, Pose(ROBOT.x, ROBOT.y))
    tries.learn([drive("G2", ROBOT, GoalState.ARRIVED)], narrow, Pose(ROBOT.x, ROBOT.y))
    assert tries.find_tried(narrow).looked_from == (AHEAD, ROBOT)


def test_a_frontier_at_which_a_drive_failed_is_not_offered_until_the_map_there_changes() -> None:
    tries, narrow = FrontierTries(), revision(gap_cells=6)
    tries.learn([drive("G1", AHEAD, GoalState.BLOCKED)], narrow, Pose(ROBOT.x, ROBOT.y))
    arrivals = [drive(f"G{number}", ROBOT, GoalState.ARRIVED) for number in range(2, 60)]
    tries.learn(arrivals, narrow, Pose(ROBOT.x, ROBOT.y))
    assert tries.find_tried(narrow).failed_at == (AHEAD,)
    cells = narrow.grid.cells.copy()
    cells[10:18, 8:24] = -1
    changed = MapRevision(OccupancyGrid(cells=cells, resolution_m=CELL_M), radius_m=RADIUS_M)
    assert tries.find_tried(changed).failed_at == ()


def test_a_drive_that_found_no_way_through_a_gap_proves_it_too_narrow() -> None:
    tries, narrow = FrontierTries(), revision(gap_cells=6)
    tries.learn([drive("G1", BEHIND_THE_GAP, GoalState.BLOCKED)], narrow, Pose(ROBOT.x, ROBOT.y))
    (gap,) = tries.find_tried(narrow).gaps
    assert gap.point.distance_to(GAP) < 0.4
    tries.learn([drive("G2", Point(4.55, 1.35), GoalState.BLOCKED)], narrow, Pose(ROBOT.x, ROBOT.y))
    assert len(tries.find_tried(narrow).gaps) == 1


def test_a_drive_that_is_blocked_on_a_roomy_way_proves_no_gap() -> None:
    tries, wide = FrontierTries(), revision(gap_cells=11)
    tries.learn([drive("G1", BEHIND_THE_GAP, GoalState.BLOCKED)], wide, Pose(ROBOT.x, ROBOT.y))
    assert not tries.find_tried(wide).gaps


def test_a_cancelled_drive_shows_nothing() -> None:
    tries, narrow = FrontierTries(), revision(gap_cells=6)
    tries.learn([drive("G1", BEHIND_THE_GAP, GoalState.CANCELLED)], narrow, Pose(ROBOT.x, ROBOT.y))
    tried = tries.find_tried(narrow)
    assert tried == NOTHING_TRIED
