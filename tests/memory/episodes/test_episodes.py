import shutil
import sqlite3
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, Waypoint
from mapspeak.memory.episodes.observation import (
    EpisodeFilter,
    EpisodeOrder,
    EpisodeQuery,
    MapPlacing,
    Observation,
    ObservationKind,
    observation_of,
)
from mapspeak.memory.episodes.store import EpisodeStore, memory_folder
from mapspeak.memory.episodes.textindex import VectorRank
from mapspeak.memory.search.answer import MINILM_THRESHOLDS

NINE = datetime(2026, 11, 20, 9, 0, tzinfo=UTC)


def seen(
    text: str, *, x: float = 0.0, y: float = 0.0, minutes: int = 0, labels: tuple[str, ...] = ()
) -> Observation:
    return Observation(
        recorded_at=NINE + timedelta(minutes=minutes),
        pose=Pose(x, y),
        kind=ObservationKind.NOTE,
        text=text,
        labels=labels,
        room_id="R1" if x < 5 else "R2",
        map_id="hall",
    )


@pytest.fixture
def store(tmp_path: Path) -> EpisodeStore:
    store = EpisodeStore(memory_folder(tmp_path / "places.yaml"))
    store.write(seen("A ladder leans on the rack.", x=1.0, minutes=0, labels=("Ladder",)))
    store.write(seen("A fridge and a sink.", x=2.0, minutes=5, labels=("fridge", "sink")))
    store.write(seen("The ladder again, now by the door.", x=9.0, minutes=60, labels=("ladder",)))
    store.write(seen("Two pallets by the door.", x=8.0, minutes=65, labels=("pallet",)))
    return store


def texts(store: EpisodeStore, query: EpisodeQuery) -> list[str]:
    return [match.observation.text for match in store.find(query).matches]


def test_what_was_written_is_there_after_a_restart(tmp_path: Path) -> None:
    zone = timezone(timedelta(hours=9))
    observation = Observation(
        recorded_at=datetime(2026, 11, 20, 18, 0, 0, 123456, tzinfo=zone),
        pose=Pose(1.25, -2.5, 0.7),
        kind=ObservationKind.PICTURE,
        text="A door.\nIt is open.",
        labels=("door", "소화기"),
        stamp_s=12.5,
        map_id="hall",
        room_id="R3",
    )
    kept = EpisodeStore(tmp_path / "m").write(observation, picture=b"\xff\xd8\xff and more")
    again = EpisodeStore(tmp_path / "m")
    found = again.find(EpisodeQuery()).matches[0].observation
    assert found == kept == again.get(kept.id)
    assert found.recorded_at.utcoffset() == timedelta(hours=9)
    path = again.picture_path(found)
    assert path is not None
    assert path.read_bytes() == b"\xff\xd8\xff and more"
    assert path.name.startswith("20261120T090000Z-")


def test_a_memory_without_episodes_is_empty_and_stays_without(tmp_path: Path) -> None:
    store = EpisodeStore(tmp_path / "m")
    assert store.find(EpisodeQuery(words="ladder")).n_matches == 0
    assert store.get("o1") is None
    assert not (tmp_path / "m").exists()


def test_writing_the_same_observation_twice_keeps_one(store: EpisodeStore) -> None:
    store.write(seen("Two pallets by the door.", x=8.0, minutes=65, labels=("pallet",)))
    assert store.find(EpisodeQuery()).n_matches == 4


def test_without_a_filter_the_newest_come_first(store: EpisodeStore) -> None:
    assert texts(store, EpisodeQuery())[0] == "Two pallets by the door."
    assert texts(store, EpisodeQuery(order=EpisodeOrder.OLDEST))[0] == "A ladder leans on the rack."


def test_each_filter_says_why_an_observation_is_there(store: EpisodeStore) -> None:
    query = EpisodeQuery(
        words="the ladders",
        near=Point(9.0, 1.0),
        radius_m=2.0,
        room_id="R2",
        since=NINE,
        until=NINE + timedelta(hours=2),
        labels=("LADDER",),
        kind=ObservationKind.NOTE,
        map_id="hall",
    )
    (match,) = store.find(query).matches
    assert match.observation.text == "The ladder again, now by the door."
    assert match.distance_m == pytest.approx(1.0)
    assert set(match.filters) == set(EpisodeFilter) - {EpisodeFilter.MEANING}
    assert match.fitting == ("ladder",)
    assert match.label == "ladder"
    assert match.near == Point(9.0, 1.0)


@pytest.mark.parametrize(
    ("query", "n_matches"),
    [
        (EpisodeQuery(words="unicorn"), 0),
        (EpisodeQuery(words="laddre"), 2),
        (EpisodeQuery(words="pallet"), 1),
        (EpisodeQuery(near=Point(1.5, 0.0), radius_m=0.6), 2),
        (EpisodeQuery(near=Point(1.5, 0.0), radius_m=0.4), 0),
        (EpisodeQuery(room_id="R1"), 2),
        (EpisodeQuery(since=NINE + timedelta(minutes=5), until=NINE + timedelta(minutes=65)), 2),
        (EpisodeQuery(labels=("sink",)), 1),
        (EpisodeQuery(kind=ObservationKind.PICTURE), 0),
        (EpisodeQuery(map_id="yard"), 0),
    ],
)
def test_a_filter_lets_through_what_it_says(
    store: EpisodeStore, query: EpisodeQuery, n_matches: int
) -> None:
    assert store.find(query).n_matches == n_matches


def test_what_was_nearest_to_where_the_ladder_was_seen_this_morning(store: EpisodeStore) -> None:
    ladder = EpisodeQuery(
        words="ladder", until=NINE + timedelta(minutes=30), order=EpisodeOrder.NEWEST
    )
    page = store.find(EpisodeQuery(near=ladder))
    assert page.anchor is not None
    assert page.anchor.observation.pose.x == 1.0
    assert [match.observation.text for match in page.matches] == [
        "A fridge and a sink.",
        "Two pallets by the door.",
    ]
    assert page.matches[0].distance_m == pytest.approx(1.0)
    onward = store.find(EpisodeQuery(near=EpisodeQuery(near=ladder, limit=1), labels=("pallet",)))
    assert onward.anchor is not None
    assert onward.anchor.observation.text == "A fridge and a sink."
    assert onward.n_matches == 1


def test_near_to_something_never_seen_is_nothing(store: EpisodeStore) -> None:
    page = store.find(EpisodeQuery(near=EpisodeQuery(words="unicorn")))
    assert (page.n_matches, page.anchor) == (0, None)


def test_pages_do_not_shift_while_others_write(store: EpisodeStore) -> None:
    first = store.find(EpisodeQuery(limit=3))
    store.write(seen("Something new.", minutes=90))
    assert first.next_page is not None
    rest = store.find(first.next_page)
    assert [match.observation.text for match in rest.matches] == ["A ladder leans on the rack."]
    assert rest.next_page is None
    assert store.find(EpisodeQuery()).n_matches == 5


def test_pages_around_what_was_found_do_not_shift_while_it_is_seen_again_elsewhere(
    store: EpisodeStore,
) -> None:
    page = store.find(EpisodeQuery(near=EpisodeQuery(labels=("fridge",)), limit=2))
    store.write(seen("The fridge again.", x=9.0, minutes=90, labels=("fridge",)))
    assert page.next_page is not None

    behind = store.find(page.next_page)

    shown = [match.observation.id for match in (*page.matches, *behind.matches)]
    assert len(set(shown)) == page.n_matches == 3


def test_what_lies_on_a_map_of_unknown_placing_is_near_to_nothing_and_in_no_room(
    store: EpisodeStore,
) -> None:
    store.write(replace(seen("A yard.", x=1.0), map_id="yard", id=""))
    of_hall = EpisodeQuery(near=Point(1.0, 0.0), placings=(MapPlacing("hall", Pose(0.0, 0.0)),))

    *nearest, last = store.find(of_hall).matches

    assert [match.distance_m for match in nearest] == [0.0, 1.0, 7.0, 8.0]
    assert (last.observation.text, last.is_elsewhere, last.distance_m) == ("A yard.", True, None)
    assert EpisodeFilter.PLACE not in last.filters
    assert "A yard." not in texts(store, replace(of_hall, near=None, room_id="R1"))


def test_while_the_placing_of_no_map_is_known_all_is_told_as_elsewhere(store: EpisodeStore) -> None:
    matches = store.find(EpisodeQuery(near=Point(1.0, 0.0), placings=())).matches

    assert [match.is_elsewhere for match in matches] == [True] * 4


def test_a_folder_that_was_taken_away_meanwhile_is_begun_anew(store: EpisodeStore) -> None:
    shutil.rmtree(store.folder)

    store.write(seen("A bin."))

    assert texts(store, EpisodeQuery()) == ["A bin."]


def test_a_rank_that_is_given_decides_what_fits(store: EpisodeStore) -> None:
    def rank(query: str, texts: Sequence[str]) -> list[float]:
        assert query == "cold drinks"
        return [0.8 if "fridge" in text else 0.0 for text in texts]

    (match,) = store.find(EpisodeQuery(words="cold drinks"), rank=rank).matches
    assert match.observation.text == "A fridge and a sink."
    assert match.score_ratio == pytest.approx(0.8)
    assert match.filters == (EpisodeFilter.MEANING,)
    assert match.fitting == ("cold drinks",)
    in_r2 = store.find(EpisodeQuery(words="cold drinks", room_id="R2"), rank=rank)
    assert in_r2.n_matches == 0


class LetterEmbedder:
    """Counts letters, and what it was asked to embed."""

    name = "letters"
    thresholds = replace(MINILM_THRESHOLDS, least_ratio=0.1, same_ratio=0.01)

    def __init__(self) -> None:
        self.embedded: list[str] = []

    def embed(self, texts: Sequence[str]) -> NDArray[np.float32]:
        self.embedded += texts
        letters = "abcdefghijklmnopqrstuvwxyz"
        counts = [[text.casefold().count(letter) for letter in letters] for text in texts]
        vectors = np.array(counts, np.float32) + 1e-3
        vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
        return vectors


def test_the_vectors_of_texts_are_made_once_whoever_asks(store: EpisodeStore) -> None:
    first, second = LetterEmbedder(), LetterEmbedder()
    query = EpisodeQuery(words="pallets door")
    found = store.find(query, rank=VectorRank(store.database, first))
    assert found.matches[0].observation.text == "Two pallets by the door."
    assert len(first.embedded) == 5
    rank = VectorRank(store.database, second)
    assert store.find(query, rank=rank) == found
    store.write(seen("Pallets at the door.", minutes=70))
    assert store.find(query, rank=rank).n_matches == found.n_matches + 1
    assert [text for text in second.embedded if text != "pallets door"] == ["Pallets at the door."]


def test_vectors_made_ahead_are_not_made_by_a_question(store: EpisodeStore) -> None:
    ahead, asked = LetterEmbedder(), LetterEmbedder()
    rank = VectorRank(store.database, ahead)
    while rank.learn_ahead():
        pass
    assert len(ahead.embedded) == 4
    store.write(seen("Pallets at the door.", minutes=70))
    assert rank.learn_ahead()
    assert ahead.embedded[4:] == ["Pallets at the door."]
    assert store.find(
        EpisodeQuery(words="pallets door"), rank=VectorRank(store.database, asked)
    ).matches
    assert asked.embedded == ["pallets door"]


def test_a_database_that_a_crash_left_half_made_is_made_anew(tmp_path: Path) -> None:
    (tmp_path / "episodes.new").write_bytes(b"SQLite form")
    (tmp_path / "episodes.new-wal").write_bytes(b"half")
    store = EpisodeStore(tmp_path)
    assert store.find(EpisodeQuery()).n_matches == 0
    store.write(seen("A ladder."))
    assert store.find(EpisodeQuery()).n_matches == 1
    assert not list(tmp_path.glob("episodes.new*"))


def test_a_damaged_database_is_said_with_a_way_out(tmp_path: Path) -> None:
    (tmp_path / "episodes.sqlite").write_bytes(b"no database at all" * 100)
    with pytest.raises(SemanticMapError, match=r"not a database.*move it away"):
        EpisodeStore(tmp_path).find(EpisodeQuery())


def test_a_database_of_a_newer_version_is_refused(store: EpisodeStore) -> None:
    with sqlite3.connect(store.database.path) as connection:
        connection.execute("PRAGMA user_version = 9")
    connection.close()
    with pytest.raises(SemanticMapError, match="version 9"):
        store.find(EpisodeQuery())


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"radius_m": 2.0}, "near"),
        ({"near": Point(0.0, 0.0), "radius_m": -1.0}, "radius_m"),
        ({"order": EpisodeOrder.NEAREST}, "order"),
        ({"order": EpisodeOrder.BEST}, "order"),
    ],
)
def test_a_question_that_cannot_be_is_refused(wrong: dict[str, object], said: str) -> None:
    with pytest.raises(SemanticMapError, match=said):
        EpisodeQuery(**wrong)  # type: ignore[arg-type]


def test_a_picture_that_is_none_is_refused_and_nothing_is_kept(store: EpisodeStore) -> None:
    with pytest.raises(SemanticMapError, match="JPEG"):
        store.write(seen("A text file."), picture=b"hello")
    assert store.find(EpisodeQuery()).n_matches == 4


def test_a_record_is_an_observation_of_all_that_it_names() -> None:
    waypoint = Waypoint(
        name="dock",
        description="By the gate.",
        pose=Pose(1.0, 2.0),
        safety_landmarks=(Landmark(label="exit sign"),),
        recorded_at=NINE,
        map_id="hall",
    )
    observation = observation_of(waypoint)
    assert observation is not None
    assert observation.text == "dock\nBy the gate."
    assert observation.labels == ("exit sign",)
    assert observation.kind is ObservationKind.RECORD
    assert observation_of(Waypoint(name="undated", pose=Pose(0.0, 0.0))) is None


@settings(max_examples=25)
@given(query=st.text(max_size=40), words=st.lists(st.text(max_size=12), max_size=3))
def test_any_words_at_all_can_be_written_and_asked(
    tmp_path_factory: pytest.TempPathFactory, query: str, words: list[str]
) -> None:
    store = EpisodeStore(tmp_path_factory.mktemp("m"))
    store.write(seen(" ".join(words), labels=tuple(words)))
    page = store.find(EpisodeQuery(words=query))
    assert all(0 < (match.score_ratio or 0) <= 1 for match in page.matches)
