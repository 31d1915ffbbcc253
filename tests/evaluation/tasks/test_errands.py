"""Composed errands: how they are set, and what counts as done."""

import pytest

from mapspeak.evaluation.scores.groundtruth import GroundTruth
from mapspeak.evaluation.scores.judging import Evidence
from mapspeak.evaluation.tasks.catalogue import FAMILIES, find_task
from mapspeak.evaluation.tasks.errands import judge_errand
from mapspeak.evaluation.tasks.task import Truth
from mapspeak.evaluation.trials import Failure
from mapspeak.geometry import Point, Pose
from mapspeak.simulator import StateRecord, WorldObject, load_world, world_names
from sites import LARGE_ROOM, MEMORY_TEXT, SMALL_ROOM, make_flat

SAID = "speak: All is well."
SAID_THERE = {"deed": SAID, "room": "small room"}
IN_SMALL_ROOM: Truth = {"steps": [SAID_THERE]}
CHARGE_FIRST: Truth = {"steps": [{"deed": "dock: ", "battery_ratio": 0.35}, SAID_THERE]}


@pytest.fixture(scope="module")
def flat(tmp_path_factory: pytest.TempPathFactory) -> GroundTruth:
    return GroundTruth(make_flat(tmp_path_factory.mktemp("flat")))


def went(*stops: tuple[Point, str], battery_ratio: float = 1.0, n_collisions: int = 0) -> Evidence:
    """Gives what is left of a trial in which something was done at some places."""
    states = [
        StateRecord(
            time_s=float(number),
            x=place.x,
            y=place.y,
            yaw_rad=0.0,
            slam_error_m=0.0,
            driven_m=float(number),
            n_collisions=n_collisions,
            battery_ratio=battery_ratio,
            deeds=tuple(deed for _, deed in stops[: number + 1]),
        )
        for number, (place, _) in enumerate(stops)
    ]
    return Evidence(states=tuple(states))


def failure(flat: GroundTruth, evidence: Evidence, truth: Truth) -> Failure | None:
    return judge_errand(flat, truth, evidence).failure


def test_what_is_said_counts_in_the_room_it_was_asked_for(flat: GroundTruth) -> None:
    assert failure(flat, went((SMALL_ROOM, SAID)), IN_SMALL_ROOM) is None
    assert failure(flat, went((LARGE_ROOM, SAID)), IN_SMALL_ROOM) is Failure.INCOMPLETE
    for words in ("Hello.", "All is well. Or nearly so."):
        said = went((SMALL_ROOM, f"speak: {words}"))
        assert failure(flat, said, IN_SMALL_ROOM) is Failure.INCOMPLETE
    assert failure(flat, went(), IN_SMALL_ROOM) is Failure.INCOMPLETE


def test_the_nearest_thing_is_that_with_the_shortest_way_to_drive(flat: GroundTruth) -> None:
    # In the map frame, whose (0, 0) is at (1, 1) of the file's.
    printers = (
        WorldObject(name="far", kind="printer", pose=Pose(10.4, 5.4, -1.57)),
        WorldObject(name="near", kind="printer", pose=Pose(4.4, 2.4, -1.57)),
    )
    site = flat.with_more(printers)
    said: Truth = {"steps": [{"deed": SAID, "kind": "printer"}]}
    begun = (Point(5.0, 0.5), "open_door: none")
    beside, other, beyond_a_wall = Point(3.4, 0.5), Point(0.5, 3.5), Point(3.4, 2.6)
    assert failure(site, went(begun, (beside, SAID)), said) is None
    assert failure(site, went(begun, (other, SAID)), said) is Failure.INCOMPLETE
    assert failure(site, went(begun, (beyond_a_wall, SAID)), said) is Failure.INCOMPLETE


def test_opened_doors_and_faults_are_no_deeds_of_an_errand(flat: GroundTruth) -> None:
    done = went(
        (LARGE_ROOM, "open_door: small room door"),
        (SMALL_ROOM, "speak fault: 1 left"),
        (SMALL_ROOM, SAID),
    )
    assert failure(flat, done, IN_SMALL_ROOM) is None


def test_more_than_was_asked_is_wrong(flat: GroundTruth) -> None:
    twice = went((SMALL_ROOM, SAID), (SMALL_ROOM, SAID))
    assert failure(flat, twice, IN_SMALL_ROOM) is Failure.WRONG_ANSWER


def test_charging_comes_first_and_to_the_end(flat: GroundTruth) -> None:
    docked = ((LARGE_ROOM, "dock: dock"), (SMALL_ROOM, SAID))
    assert failure(flat, went(*docked, battery_ratio=0.34), CHARGE_FIRST) is None
    assert failure(flat, went(*docked, battery_ratio=0.2), CHARGE_FIRST) is Failure.INCOMPLETE
    assert failure(flat, went(*reversed(docked)), CHARGE_FIRST) is Failure.INCOMPLETE


def test_whoever_bumps_into_something_has_not_done_it(flat: GroundTruth) -> None:
    bumped = went((SMALL_ROOM, SAID), n_collisions=1)
    assert failure(flat, bumped, IN_SMALL_ROOM) is Failure.COLLIDED


@pytest.mark.parametrize("world", world_names())
def test_errands_are_offered_in_every_world(world: str) -> None:
    site = GroundTruth(load_world(world))
    offered = [name for name in FAMILIES["errands"] if find_task(name).is_offered(site)]
    assert offered == list(FAMILIES["errands"])


def test_a_low_battery_and_a_full_one_take_turns() -> None:
    site = GroundTruth(load_world("flat_1"))
    low, full = (
        find_task("errand-low-battery").make_setting(site, seed=seed, memory=MEMORY_TEXT)
        for seed in (0, 1)
    )
    assert (low.battery_ratio or 1.0) < 0.3 < (full.battery_ratio or 0.0)
    assert low.truth["steps"][0]["deed"] == "dock: "
    assert "dock: " not in [step["deed"] for step in full.truth["steps"]]


def test_a_shut_door_is_the_only_one_of_its_room() -> None:
    site = GroundTruth(load_world("office"))
    setting = find_task("errand-shut-door").make_setting(site, seed=1, memory=MEMORY_TEXT)
    (room,) = [step["room"] for step in setting.truth["steps"]]
    assert sum(room in passage.spaces for passage in site.passages) == 1
    assert {*setting.shut} < {door.name for door in site.world.doors}
