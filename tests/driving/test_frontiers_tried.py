"""Frontiers that the robot has been to, or could not get to."""

from mapspeak.driving.drivereport import Drive, find_tried_frontiers
from mapspeak.geometry import Point, Pose
from mapspeak.robot import GoalState, GoalStatus

BEHIND_A_GAP = Point(2.0, 1.0)


def drive(point: Point, state: GoalState, place: str = "F1") -> Drive:
    return Drive(
        goal_id="G1",
        goal=Pose(point.x, point.y),
        place=place,
        robot_goal_id="1",
        started_s=0.0,
        final=GoalStatus(state=state),
    )


def arrivals(n: int) -> list[Drive]:
    return [drive(Point(20.0 + number, 0.0), GoalState.ARRIVED) for number in range(n)]


def is_tried(point: Point, drives: list[Drive]) -> bool:
    return point in find_tried_frontiers(drives)


def test_a_frontier_that_was_reached_stays_tried() -> None:
    reached = drive(BEHIND_A_GAP, GoalState.ARRIVED)
    assert is_tried(BEHIND_A_GAP, [reached, *arrivals(100)])


def test_a_blocked_frontier_is_offered_again_after_some_drives_to_others() -> None:
    blocked = drive(BEHIND_A_GAP, GoalState.BLOCKED)
    assert is_tried(BEHIND_A_GAP, [blocked, *arrivals(3)])
    assert not is_tried(BEHIND_A_GAP, [blocked, *arrivals(4)])


def test_a_turn_or_a_drive_to_a_room_does_not_bring_a_blocked_frontier_back() -> None:
    blocked = drive(BEHIND_A_GAP, GoalState.BLOCKED)
    turns = [drive(Point(0.0, 0.0), GoalState.ARRIVED, "a turn to 90 deg")] * 20
    assert is_tried(BEHIND_A_GAP, [blocked, *turns])


def test_the_more_often_the_robot_was_blocked_around_there_the_later_it_is_offered_again() -> None:
    nearby = drive(Point(3.0, 2.0), GoalState.BLOCKED)
    again = drive(BEHIND_A_GAP, GoalState.BLOCKED)
    assert is_tried(BEHIND_A_GAP, [nearby, again, *arrivals(15)])
    assert not is_tried(BEHIND_A_GAP, [nearby, again, *arrivals(16)])
    assert is_tried(BEHIND_A_GAP, [nearby, again, again, *arrivals(40)])
