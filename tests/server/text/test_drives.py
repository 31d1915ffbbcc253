import pytest

from mapspeak.robot import Cause, CauseCode
from mapspeak.server.text.world.drives import say_cause


@pytest.mark.parametrize("code", CauseCode)
def test_every_cause_has_words_with_all_its_details(code: CauseCode) -> None:
    previous = Cause(code=CauseCode.CANCELLED)
    said = say_cause(
        Cause(
            code=code,
            after_s=7.0,
            distance_m=0.25,
            name="pit {braces}",
            quote="No {map}.",
            previous=previous,
        )
    )
    assert said
    assert "None" not in said


def test_a_drive_that_waited_says_how_the_one_before_it_ended() -> None:
    previous = Cause(code=CauseCode.CLIENT_SILENT, after_s=30.0)
    cause = Cause(code=CauseCode.PREVIOUS_ENDED, previous=previous)
    assert say_cause(cause) == ("The drive before it has ended: No client was heard for 30 s.")
