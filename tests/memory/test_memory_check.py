"""What speaks against one thing or place is worked out alone, and kept over writes."""

import math
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np

from drawing import grid_from_text
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, SemanticMap, Waypoint
from mapspeak.memory.consistency.checking import MemoryCheck, check_memory
from mapspeak.memory.consistency.findings import FindingKind, MemoryFinding
from mapspeak.memory.consistency.unseen import UnseenThings
from mapspeak.memory.things.finding import Things, find_things
from mapspeak.memory.things.thing import Thing
from mapspeak.spatial.paths import distances_from
from mapspeak.spatial.rooms import find_rooms

GRID = grid_from_text(
    """
    #########################????????
    #...........#...........#????????
    #...........#...........#????????
    #...........#...........#????????
    #...........#...........#????????
    #.......................#????????
    #.......................#????????
    #...........#...........#????????
    #########################????????
    """,
    resolution_m=0.5,
)
ROOMS = find_rooms(GRID)
DISTANCES = distances_from(GRID, Point(1.0, 1.0), radius_m=0.2)
LABELS = ("bin", "trash bin", "red chair", "chair", "gate 3", "gate 4", "sink", "ladder")
MONDAY = datetime(2026, 11, 23, 9, 0, tzinfo=UTC)
N_WRITES = 80


def _draw_place(random: np.random.Generator, day: int, number: int) -> Waypoint:
    rooms = [region.id for region in ROOMS.regions]
    landmarks = tuple(
        Landmark(
            label=str(random.choice(LABELS)),
            bearing_rad=None if random.random() < 0.1 else float(random.uniform(-0.6, 0.6)),
            range_m=None if random.random() < 0.4 else float(random.uniform(0.5, 3.0)),
            n_missed=int(random.random() < 0.1),
        )
        for _ in range(random.integers(4))
    )
    return Waypoint(
        name=f"place {number}",
        pose=Pose(
            float(random.uniform(0.6, 13.0)),
            float(random.uniform(0.6, 3.9)),
            float(random.uniform(-math.pi, math.pi)),
        ),
        functional_landmarks=landmarks,
        recorded_at=None if random.random() < 0.1 else MONDAY + timedelta(days=day),
        picture=f"{day}.jpg" if random.random() < 0.5 else None,
        room_id=str(random.choice(rooms)) if random.random() < 0.3 else None,
    )


def _write(random: np.random.Generator, memory: SemanticMap, day: int) -> SemanticMap:
    """Add, replace or forget a place."""
    numbers = {each.name: i for i, each in enumerate(memory.waypoints)}
    places = list(memory.waypoints)
    drawn = _draw_place(random, day, int(random.integers(40)))
    if drawn.name not in numbers:
        places.append(drawn)
    elif random.random() < 0.3:
        del places[numbers[drawn.name]]
    else:
        places[numbers[drawn.name]] = drawn
    return replace(memory, waypoints=tuple(places))


def _of_thing(whole: tuple[MemoryFinding, ...], thing: Thing) -> tuple[MemoryFinding, ...]:
    """Return what concerns a thing; twins change no trust."""
    return tuple(
        each
        for each in whole
        if any(other is thing for other in each.things)
        or (
            not each.things
            and each.kind is not FindingKind.DUPLICATE
            and set(each.waypoints) & set(thing.waypoints)
        )
    )


def test_what_is_asked_of_one_thing_is_what_all_findings_say_of_it_after_any_writes() -> None:
    random = np.random.default_rng(3)
    memory, found, unseen = SemanticMap(waypoints=()), None, None
    kinds: set[FindingKind] = set()
    n_kept = 0
    for day in range(N_WRITES):
        memory = _write(random, memory, day)
        found = find_things(memory, GRID, earlier=found)
        unseen = UnseenThings(memory, found, earlier=unseen)
        n_kept += len(unseen.known)
        check = MemoryCheck(memory, unseen, distances=DISTANCES, rooms=ROOMS)
        whole = check_memory(memory, found, distances=DISTANCES, rooms=ROOMS)
        kinds |= {each.kind for each in whole}
        for thing in found.things:
            if random.random() < 0.7:
                assert check.find_of_thing(thing) == _of_thing(whole, thing)
        for place in memory.waypoints:
            of_place = tuple(
                each for each in whole if each.waypoints == (place.name,) and not each.things
            )
            assert check.find_of_place(place) == of_place
        if random.random() < 0.3:
            assert check.findings == whole
            for thing in found.things:
                assert check.find_of_thing(thing) == _of_thing(whole, thing)
    assert n_kept > N_WRITES
    assert kinds >= {
        FindingKind.NOT_SEEN,
        FindingKind.MOVED,
        FindingKind.TWO_LABELS,
        FindingKind.POINTS_PAST,
        FindingKind.WRONG_ROOM,
        FindingKind.BEHIND_WALL,
    }


def _see(name: str, x: float, y: float, yaw_deg: float, range_m: float | None) -> Waypoint:
    """A look with a picture at a bin so far ahead, or at nothing."""
    ahead = Landmark(label="bin", bearing_rad=0.0, range_m=range_m)
    return Waypoint(
        name=name,
        pose=Pose(x, y, math.radians(yaw_deg)),
        functional_landmarks=() if range_m is None else (ahead,),
        picture=f"{name}.jpg",
    )


def test_a_look_that_names_nothing_says_so_of_a_thing_that_was_asked_for_before() -> None:
    beside, empty = _see("beside", 3.5, 3.5, -90.0, 2.0), _see("empty", 1.0, 1.5, 0.0, None)
    found, unseen, said = None, None, []
    for places in ((beside,), (beside, empty), (beside,)):
        memory = SemanticMap(waypoints=places)
        found = find_things(memory, GRID, earlier=found)
        unseen = UnseenThings(memory, found, earlier=unseen)
        (thing,) = found.things
        said.append((thing, len(tuple(unseen.find(thing)))))
    assert said == [(thing, 0), (thing, 1), (thing, 0)]


def test_a_place_after_one_off_the_map_is_checked_all_the_same() -> None:
    def check(*places: Waypoint) -> tuple[FindingKind, ...]:
        memory = SemanticMap(waypoints=places)
        found: Things = find_things(memory, GRID)
        return tuple(each.kind for each in check_memory(memory, found))

    sink = Landmark(label="sink", bearing_rad=0.0, range_m=9.0)
    off = Waypoint(name="off", pose=Pose(90.0, 90.0, 0.0))
    wrong = Waypoint(name="wrong", pose=Pose(1.0, 1.0, math.pi), functional_landmarks=(sink,))
    assert FindingKind.BEHIND_WALL in check(wrong)
    assert FindingKind.BEHIND_WALL in check(off, wrong)
