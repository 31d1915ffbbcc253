import pytest

from mapspeak.errors import GoalError, NextStep
from mapspeak.server.text.offered import say_error

NEAR = "The nearest pose that works is x=1.00, y=2.00"


@pytest.mark.parametrize(
    ("step", "hint", "said"),
    [
        (None, "Give x, y.", "Give x, y."),
        (
            NextStep.DRIVE_THERE,
            f"{NEAR}.",
            f"{NEAR}. Call navigate_to with it, or with as_near. look_at_map shows other places.",
        ),
        (
            NextStep.CHOOSE_ON_MAP,
            "No place near it works either.",
            "No place near it works either. Call look_at_map and choose another one.",
        ),
        (
            NextStep.SEE_PLACES,
            "Known are rooms and corridors R1.",
            "Known are rooms and corridors R1. look_at_map shows them.",
        ),
        (NextStep.READ_MORE, "Use T1.", "Use T1. find_place says more."),
        (
            NextStep.MEASURE,
            "Name another place.",
            "Name another place. look_at_map shows them.",
        ),
        (
            NextStep.LOOK_AROUND,
            "Choose another place.",
            "Choose another place. describe_place tells of W1.",
        ),
        (
            NextStep.LOOK_FROM,
            "Drive to W1 and look from there.",
            "Look from W1. navigate_to goes there.",
        ),
        (
            NextStep.CHECK_NEAR,
            "Leave this stop out.",
            "Leave this stop out. check_goal finds a pose near it that works.",
        ),
    ],
)
def test_the_next_step_is_said_with_the_tool_that_does_it(
    step: NextStep | None, hint: str, said: str
) -> None:
    error = GoalError("So it is.", hint=hint, step=step, about="W1")
    assert say_error(error) == f"So it is. {said}"
    assert str(error) == f"So it is. {hint}"
