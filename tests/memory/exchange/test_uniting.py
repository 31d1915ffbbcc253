from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.memory import Landmark, SemanticMap, SemanticMapStore, Waypoint, name_key
from mapspeak.memory.events import Effect, Event
from mapspeak.memory.exchange.uniting import merge_files, merge_into, unite
from waypoints import waypoints

MONDAY = datetime(2026, 11, 16, 9, 0, tzinfo=UTC)
TUESDAY = MONDAY + timedelta(days=1)
TAP, RACK, SIGN = (Landmark(label=label) for label in ("tap", "rack", "exit sign"))


def dock(x: float = 0.0, *, at: datetime | None = None, **said: object) -> Waypoint:
    return Waypoint(name="dock", pose=Pose(x, 0.0), recorded_at=at, **said)  # type: ignore[arg-type]


def memory(*places: Waypoint, map_id: str | None = "hall") -> SemanticMap:
    return SemanticMap(map_id=map_id, waypoints=places)


def names(places: SemanticMap) -> list[str]:
    return [place.name for place in places.waypoints]


def test_a_place_that_one_memory_has_is_in_the_whole() -> None:
    yard = Waypoint(name="yard", pose=Pose(9.0, 9.0))
    union = unite(memory(dock()), memory(yard))
    assert names(union.places) == ["dock", "yard"]
    assert union.findings == ()
    assert [place.name for place in union.changed] == ["yard"]


def test_of_two_looks_at_one_place_the_newer_decides_and_nothing_seen_is_lost() -> None:
    new = dock(0.3, at=TUESDAY, description="By the new gate.", functional_landmarks=(TAP,))
    old = dock(
        at=MONDAY,
        description="By the gate.",
        functional_landmarks=(RACK,),
        safety_landmarks=(SIGN,),
        geometric_features=("corner",),
    )
    for first, second in ((new, old), (old, new)):
        union = unite(memory(first), memory(second))
        (place,) = union.places.waypoints
        assert place.description == "By the new gate."
        assert place.pose.x == 0.3
        assert [landmark.label for landmark in place.landmarks] == ["exit sign", "tap", "rack"]
        assert place.functional_landmarks[1].recorded_at == MONDAY
        assert place.geometric_features == ("corner",)
        assert union.findings == (
            "'dock' is in both; joined, the record of 2026-11-17T09:00:00+00:00 decides.",
        )


def test_two_places_of_one_name_both_stay() -> None:
    union = unite(memory(dock(at=MONDAY)), memory(dock(3.0, at=TUESDAY)))
    assert names(union.places) == ["dock", "dock (2)"]
    assert union.findings == (
        "'dock' is in both; they lie 3.00 m apart: both stay, the second one as 'dock (2)'.",
    )


def test_without_times_what_differs_stays_twice_and_what_completes_is_joined() -> None:
    one, other = dock(description="By the gate."), dock(description="By the yard.")
    assert names(unite(memory(one), memory(other)).places) == ["dock", "dock (2)"]
    (place,) = unite(memory(one), memory(dock(functional_landmarks=(TAP,)))).places.waypoints
    assert (place.description, place.landmarks) == ("By the gate.", (TAP,))


def test_a_landmark_of_the_older_record_keeps_its_bearing_and_the_pose_it_was_seen_from() -> None:
    ahead = Landmark(label="tap", bearing_rad=0.0)
    old = dock(at=MONDAY, functional_landmarks=(ahead,))
    for new in (dock(0.8, at=TUESDAY), dock(0.1, at=TUESDAY)):
        (place,) = unite(memory(new), memory(old)).places.waypoints
        (tap,) = place.landmarks
        assert (place.name, place.pose) == ("dock", new.pose)
        assert (tap.bearing_rad, place.pose_of(tap)) == (0.0, old.pose)


def test_memories_of_different_maps_are_refused() -> None:
    with pytest.raises(SemanticMapError, match=r"'hall'.*'yard'"):
        unite(memory(dock()), memory(dock(), map_id="yard"))
    assert unite(memory(dock()), memory(dock(), map_id=None)).places.map_id == "hall"


SIMILAR = st.builds(
    dock,
    st.sampled_from([0.0, 0.2, 0.7, 5.0]),
    at=st.sampled_from([None, MONDAY, TUESDAY]),
    description=st.sampled_from(["", "By the gate.", "By the yard."]),
    functional_landmarks=st.lists(
        st.builds(
            Landmark,
            label=st.sampled_from(["tap", "rack"]),
            bearing_rad=st.none() | st.sampled_from([0.0, 1.0]),
        ),
        max_size=3,
    ).map(tuple),
)
PLACES = st.lists(
    SIMILAR | waypoints(has_poses=True), max_size=4, unique_by=lambda place: name_key(place.name)
)
MEMORIES = PLACES.map(lambda places: memory(*places))


@given(MEMORIES)
def test_a_memory_joined_with_itself_stays_what_it_is(places: SemanticMap) -> None:
    union = unite(places, places)
    assert (names(union.places), union.changed, union.findings) == (names(places), (), ())


@given(MEMORIES, MEMORIES)
def test_every_name_and_every_landmark_is_in_the_whole(
    first: SemanticMap, second: SemanticMap
) -> None:
    union = unite(first, second)
    keys = [name_key(name) for name in names(union.places)]
    assert len(keys) == len(set(keys))
    assert {name_key(name) for name in (*names(first), *names(second))} <= set(keys)
    for places in (first, second):
        labels = {name_key(x.label) for place in places.waypoints for x in place.landmarks}
        assert labels <= {
            name_key(x.label) for place in union.places.waypoints for x in place.landmarks
        }


@given(MEMORIES, MEMORIES)
def test_joining_the_same_again_adds_no_name(first: SemanticMap, second: SemanticMap) -> None:
    once = unite(first, second).places
    assert names(unite(once, second).places) == names(once)


def test_a_look_that_is_joined_again_misses_nothing_twice() -> None:
    rack, tap = (Landmark(label=label, bearing_rad=0.0) for label in ("rack", "tap"))
    first = memory(dock(at=MONDAY, functional_landmarks=(rack,)))
    second = memory(dock(at=TUESDAY, functional_landmarks=(tap, tap)))
    once = unite(first, second).places
    assert [each.n_missed for each in once.waypoints[0].landmarks] == [0, 0, 1]
    assert unite(once, second).places.waypoints == once.waypoints


def test_a_look_that_was_joined_with_an_earlier_one_is_joined_again_under_its_name() -> None:
    tap = Landmark(label="tap", bearing_rad=0.0)
    first = memory(dock(at=MONDAY, functional_landmarks=(tap,)))
    second = memory(dock(0.7, at=TUESDAY, functional_landmarks=(TAP, tap)))
    once = unite(first, second).places

    assert names(unite(once, second).places) == ["dock"]


def test_two_files_become_one_with_the_comments_of_the_first(tmp_path: Path) -> None:
    first, second, out = (tmp_path / name for name in ("a.yaml", "b.yaml", "c.yaml"))
    first.write_text(
        "# ours\nmap: m1\nwaypoints:\n  - name: hall  # big\n    pose: {x: 1, y: 2, yaw_deg: 0}\n"
    )
    SemanticMapStore(second).write(Waypoint(name="yard", pose=Pose(3.0, 4.0), map_id="m1"))
    before = first.read_bytes(), second.read_bytes()
    merge_files(first, second, out=out)
    assert out.read_text().startswith("# ours\n")
    assert "hall  # big" in out.read_text()
    assert SemanticMapStore(out).read().map_id == "m1"
    assert names(SemanticMapStore(out).read()) == ["hall", "yard"]
    assert (first.read_bytes(), second.read_bytes()) == before
    with pytest.raises(SemanticMapError, match="there already"):
        merge_files(first, second, out=out)
    with pytest.raises(SemanticMapError, match="no file"):
        merge_files(first, tmp_path / "none.yaml", out=tmp_path / "d.yaml")


def test_an_import_is_all_of_it_or_nothing(tmp_path: Path) -> None:
    store = SemanticMapStore(tmp_path / "a.yaml")
    store.write(dock(at=MONDAY))
    union = merge_into(store, memory(dock(at=TUESDAY, description="New."), map_id=None))
    assert len(union.changed) == 1
    assert store.read().waypoints[0].description == "New."
    (tmp_path / "a.yaml").write_text("waypoints: 3\n")
    with pytest.raises(SemanticMapError, match="line 1"):
        merge_into(store, memory(dock()))
    assert (tmp_path / "a.yaml").read_text() == "waypoints: 3\n"


def test_events_of_both_files_are_there_once_each_under_an_id_of_its_own(tmp_path: Path) -> None:
    first, second, out = (tmp_path / f"{name}.yaml" for name in "abc")
    wet = Event(text="the floor is wet", place="C1", effect=Effect.SLOW)
    for path, more in ((first, "painters"), (second, "the lift is out of order")):
        store = SemanticMapStore(path, map_id="m1")
        store.write_event(Event(text=more))
        store.write_event(wet)

    merge_files(first, second, out=out)

    assert [(each.id, each.text) for each in SemanticMapStore(out).read_events()] == [
        ("E1", "painters"),
        ("E2", "the floor is wet"),
        ("E3", "the lift is out of order"),
    ]
