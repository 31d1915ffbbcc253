from hypothesis import given
from hypothesis import strategies as st

from mapspeak.server.text.world.told import SAME, SAME_RATIO, Told

AREAS = st.lists(st.floats(0, 100).map(lambda value: round(value, 1)), min_size=1, max_size=20)


def say(area_m2: float) -> str:
    return f"R1 | room | {area_m2:.1f} | D3>R7"


@given(AREAS)
def test_what_was_told_last_is_never_far_from_what_is(areas_m2: list[float]) -> None:
    told, before = areas_m2[0], None
    for area_m2 in areas_m2:
        reading = Told(before)
        if reading.is_new("R1", say(area_m2)):
            told = area_m2
        before = reading.keep({"R1"})
        assert abs(told - area_m2) <= max(SAME, SAME_RATIO * told) + 1e-9


def test_another_id_or_word_is_new_however_near_its_number() -> None:
    before = Told()
    before.is_new("R1", say(12.0))
    again = Told(before.keep({"R1"}))
    assert not again.is_new("R1", say(12.1))
    assert again.is_new("R1", say(12.0).replace("R7", "R8"))
    assert again.is_new("R1", say(12.0).replace("room", "open space"))


def test_what_is_no_more_is_gone_and_told_anew_if_it_comes_back() -> None:
    before = Told()
    before.is_new("R1", say(12.0))
    before.is_new("along C1", "from R1")
    after = Told(before.keep({"R1", "C1"}))
    assert after.find_gone({"C1", "D1"}) == ["R1"]
    assert Told(after.keep({"C1"})).is_new("R1", say(12.0))
    assert not Told(after.keep({"C1"})).is_new("along C1", "from R1")
