from causes import CRATE
from mapspeak.driving.exploration.blocked import TripEnd
from mapspeak.robot import GoalState
from mapspeak.server.text.world.drives import say_trip_end


def test_the_end_of_a_trip_is_told_as_the_robot_tells_it() -> None:
    end = TripEnd(goal_id="G1", goal_state=GoalState.BLOCKED, cause=CRATE)
    assert say_trip_end(end) == "A crate stands in the way."


def test_the_end_of_a_trip_is_told_by_its_state_where_the_robot_says_nothing() -> None:
    failed = TripEnd(goal_id="G1", goal_state=GoalState.BLOCKED)
    cancelled = TripEnd(goal_id="G1", goal_state=GoalState.CANCELLED)
    assert say_trip_end(failed) == "The drive ended as blocked."
    assert say_trip_end(cancelled) == "G1 was cancelled."
