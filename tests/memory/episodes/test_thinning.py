import math
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory.episodes.observation import EpisodeQuery, Observation, ObservationKind
from mapspeak.memory.episodes.pictures import StoredPicture, ThinningRule, choose_dropped
from mapspeak.memory.episodes.store import EpisodeStore

NOW = datetime(2026, 11, 20, 12, 30, tzinfo=UTC)
RULE = ThinningRule()


def taken(name: str, *, ago: timedelta, x: float = 0.5, yaw_deg: float = 0.0) -> StoredPicture:
    return StoredPicture(name, NOW - ago, Pose(x, 0.5, math.radians(yaw_deg)), 1000)


def dropped(*pictures: StoredPicture, named: tuple[str, ...] = ()) -> frozenset[str]:
    return choose_dropped(pictures, now=NOW, named=named, rule=RULE)


def minutes(n: float) -> timedelta:
    return timedelta(minutes=n)


def test_all_of_the_last_day_stay() -> None:
    assert dropped(*(taken(f"{n}", ago=minutes(n)) for n in range(0, 1440, 10))) == frozenset()


def test_of_the_last_week_the_newest_of_each_place_and_hour_stays() -> None:
    two_days = timedelta(days=2)
    pictures = [taken(f"{n}", ago=two_days + minutes(n)) for n in (0, 10, 20, 40, 50)]
    # The hour begins half an hour before now.
    assert dropped(*pictures) == {"10", "20", "50"}


def test_older_ones_stay_once_for_each_place_and_day() -> None:
    pictures = [taken(f"{n}", ago=timedelta(days=9, hours=n)) for n in (0, 3, 6, 13)]
    assert dropped(*pictures) == {"3", "6"}


def test_another_square_or_another_direction_is_another_place() -> None:
    ago = timedelta(days=3)
    here = taken("here", ago=ago)
    assert dropped(here, taken("one metre on", ago=ago, x=1.5)) == frozenset()
    assert dropped(here, taken("turned", ago=ago, yaw_deg=45)) == frozenset()
    assert dropped(here, taken("a little turned", ago=ago + minutes(1), yaw_deg=-20)) == {
        "a little turned"
    }


def test_what_a_record_names_stays_even_above_the_limit() -> None:
    pictures = [taken(f"{n}", ago=timedelta(days=9, minutes=n)) for n in range(5)]
    assert dropped(*pictures, named=("3",)) == {"1", "2", "4"}
    nothing = ThinningRule(limit_mb=0.0)
    assert choose_dropped(pictures, now=NOW, named=("3",), rule=nothing) == {"0", "1", "2", "4"}


def test_above_the_limit_the_oldest_go_first() -> None:
    pictures = [taken(f"{n}", ago=minutes(n)) for n in range(5)]
    rule = ThinningRule(limit_mb=0.003)
    assert choose_dropped(pictures, now=NOW, named=(), rule=rule) == {"3", "4"}


@given(
    st.lists(
        st.builds(
            StoredPicture,
            st.integers(0, 30).map(str),
            st.datetimes(datetime(2026, 11, 1), datetime(2026, 11, 20), timezones=st.just(UTC)),  # noqa: DTZ001 - bounds take no zone
            st.builds(Pose, st.floats(-5, 5), st.floats(-5, 5), st.floats(-7, 7)),
            st.just(1000),
        ),
        unique_by=lambda picture: picture.name,
    ),
    st.sets(st.integers(0, 30).map(str)),
    st.floats(0, 0.03),
)
def test_thinning_again_drops_nothing_more(
    pictures: list[StoredPicture], named: set[str], limit_mb: float
) -> None:
    rule = ThinningRule(limit_mb=limit_mb)
    gone = choose_dropped(pictures, now=NOW, named=named, rule=rule)
    left = [picture for picture in pictures if picture.name not in gone]
    assert not gone & named
    assert choose_dropped(left, now=NOW, named=named, rule=rule) == frozenset()
    free = [picture for picture in left if picture.name not in named]
    assert not free or sum(picture.n_bytes for picture in left) <= limit_mb * 1e6


def look(n: int, at: datetime) -> tuple[Observation, bytes]:
    observation = Observation(
        recorded_at=at, pose=Pose(0.5, 0.5), kind=ObservationKind.PICTURE, text=f"look {n}"
    )
    return observation, b"\xff\xd8\xff" + str(n).encode() * 100


def files_in(folder: Path) -> set[str]:
    return {path.name for path in (folder / "pictures").iterdir()}


def test_a_write_thins_what_has_become_old_and_keeps_the_observations(tmp_path: Path) -> None:
    named: set[str] = set()
    store = EpisodeStore(tmp_path, named_pictures=lambda: named)
    long_ago = NOW - timedelta(days=3)
    kept = [
        store.write(look(n, long_ago + minutes(n))[0], picture=look(n, long_ago)[1])
        for n in range(4)
    ]
    named.add(f"pictures/{kept[0].picture}")
    observation, content = look(9, NOW)
    newest = store.write(observation, picture=content)
    assert files_in(tmp_path) == {kept[0].picture, kept[3].picture, newest.picture}
    found = [match.observation for match in store.find(EpisodeQuery()).matches]
    assert [each.picture for each in found] == [
        newest.picture,
        kept[3].picture,
        None,
        None,
        kept[0].picture,
    ]
    assert [each.id for each in found[1:]] == [each.id for each in reversed(kept)]


def test_pictures_beyond_the_limit_go_down_to_nine_tenths_of_it(tmp_path: Path) -> None:
    store = EpisodeStore(tmp_path, rule=ThinningRule(limit_mb=0.00205))
    for n in range(21):
        observation, _ = look(n, NOW + timedelta(seconds=n))
        store.write(observation, picture=b"\xff\xd8\xff" + bytes([n]) * 97)
    assert 14 <= len(files_in(tmp_path)) <= 20
    assert store.find(EpisodeQuery()).n_matches == 21


def test_files_that_a_crash_left_behind_go_and_strangers_stay(tmp_path: Path) -> None:
    store = EpisodeStore(tmp_path)
    (tmp_path / "pictures").mkdir()
    (tmp_path / "pictures" / "20261101T000000Z-0123456789ab.jpg").touch()
    (tmp_path / "pictures" / "20261101T000000Z-0123456789ab.jpg.tmp").touch()
    (tmp_path / "pictures" / "holiday.jpg").touch()
    observation, content = look(1, NOW)
    kept = store.write(observation, picture=content)
    assert files_in(tmp_path) == {"holiday.jpg", kept.picture}


def test_nothing_is_dropped_while_nobody_knows_what_records_name(tmp_path: Path) -> None:
    def unknown() -> tuple[str, ...]:
        raise SemanticMapError("The file has a fault.", hint="Mend it.")

    store = EpisodeStore(tmp_path, named_pictures=unknown)
    for n in range(3):
        observation, content = look(n, NOW - timedelta(days=3) + minutes(n))
        store.write(observation, picture=content)
    assert len(files_in(tmp_path)) == 3
    with pytest.raises(SemanticMapError, match="fault"):
        store.thin(now=NOW)
