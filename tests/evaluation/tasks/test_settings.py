import math
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mapspeak.evaluation.scores.groundtruth import GroundTruth
from mapspeak.evaluation.scores.judging import Evidence
from mapspeak.evaluation.tasks.catalogue import FAMILIES, find_task
from mapspeak.evaluation.trials import Failure, ToolCall, TrialState
from mapspeak.geometry import Point, Pose
from mapspeak.server.toolsets import read_text
from mapspeak.simulator import TrueFloor, load_world, world_names
from mapspeak.spatial import UNKNOWN, OccupancyGrid
from sites import MEMORY_TEXT, ended_at

SITES: dict[str, GroundTruth] = {}


def site_of(world: str) -> GroundTruth:
    """Gives a world's truth, found once."""
    if world not in SITES:
        SITES[world] = GroundTruth(load_world(world))
    return SITES[world]


@pytest.mark.parametrize("world", world_names())
def test_tasks_make_settings_that_can_be_carried_out(world: str) -> None:
    site, shift = site_of(world), world_names().index(world)
    for number, name in enumerate(FAMILIES["all"]):
        task = find_task(name)
        # Each world takes its turn with every fourth task, so that all are tried quickly.
        if (number + shift) % 4 or not task.is_offered(site):
            continue
        setting = task.make_setting(site, seed=number, memory=MEMORY_TEXT)
        start = (site.world.start.inverse() @ setting.start).point
        cell = site.grid.cell_at(start)
        assert site.with_more(setting.added).floor.solid.free[cell.row, cell.col], name
        assert site.drivable[cell.row, cell.col], name
        assert setting.prompt, name
        assert setting.is_known == task.needs_map, name
        shortest_m = setting.truth.get("shortest_m")
        assert shortest_m is None or (0 <= shortest_m < math.inf), name


@pytest.mark.parametrize("world", world_names())
def test_the_papers_tasks_are_offered_in_every_world(world: str) -> None:
    assert all(find_task(name).is_offered(site_of(world)) for name in FAMILIES["paper"])


def test_the_same_seed_makes_the_same_setting_and_another_seed_another() -> None:
    site, task = site_of("warehouse"), find_task("side-of-pose")
    first, same, other = (
        task.make_setting(site, seed=seed, memory=MEMORY_TEXT) for seed in (3, 3, 4)
    )
    assert first == same
    assert first != other


def test_the_papers_prompts_are_word_for_word_the_papers() -> None:
    site = site_of("warehouse")
    prompts = [
        find_task(name).make_setting(site, seed=0, memory=MEMORY_TEXT).prompt
        for name in FAMILIES["paper"]
    ]
    assert prompts == [
        "Update the map while moving.",
        "Go to the smallest room.",
        "Fire detected nearby. Navigate to the tool used for it.",
    ]
    explore = find_task("explore").make_setting(site, seed=0, memory=None)
    assert read_text("exploration") in explore.guidance


def test_a_blocked_way_is_longer_than_the_one_on_the_map_or_there_is_none() -> None:
    site, task = site_of("office"), find_task("blocked-way")
    setting = task.make_setting(site, seed=1, memory=MEMORY_TEXT)
    start = site.world.start.inverse() @ setting.start
    goal = site.cells_of(site.room_named(setting.truth["room"]))
    blocked = site.with_more(setting.added)
    on_map_m = site.shortest_to_any_m(start.point, goal)
    assert blocked.shortest_to_any_m(start.point, goal) > on_map_m
    assert isinstance(start, Pose)


def test_a_spoiled_memory_no_longer_says_where_the_thing_is() -> None:
    site = site_of("warehouse")
    for seed in range(20):
        setting = find_task("missing-note").make_setting(site, seed=seed, memory=MEMORY_TEXT)
        assert f"label: {site.label_of(setting.truth['kind'])}" not in (setting.memory or "")


def test_an_id_of_last_week_comes_with_where_the_room_lies() -> None:
    site = site_of("office")
    setting = find_task("stale-id").make_setting(site, seed=2, memory=MEMORY_TEXT)
    middle = site.middle_of(site.room_named(setting.truth["rooms"][0]))
    assert f"({middle.x:.2f}, {middle.y:.2f})" in setting.prompt
    assert re.search(r"go to R\d\.", setting.prompt)


def test_the_nearest_and_the_farthest_are_clearly_so() -> None:
    site, task = site_of("warehouse"), find_task("superlative")
    for seed in range(6):
        setting = task.make_setting(site, seed=seed, memory=MEMORY_TEXT)
        start = (site.world.start.inverse() @ setting.start).point
        ways_m = {
            thing.name: site.shortest_to_any_m(start, site.seen_around(thing, 2.0))
            for thing in site.things(setting.truth["kind"])
        }
        is_far = "farthest" in setting.prompt
        chosen = (max if is_far else min)(ways_m, key=lambda name: ways_m[name])
        assert chosen == setting.truth["name"]


def test_points_of_one_room_are_asked_for_among_those_of_its_neighbours() -> None:
    site, task = site_of("office"), find_task("question-same-room")
    setting = task.make_setting(site, seed=3, memory=MEMORY_TEXT)
    points = re.findall(r"\b([A-H]) \((-?[\d.]+), (-?[\d.]+)\)", setting.prompt)
    here = site.room_at(Point(*setting.truth["point"]))
    same = [name for name, x, y in points if site.room_at(Point(float(x), float(y))) == here]
    assert same == setting.truth["letters"]
    assert 0 < len(same) < len(points)


@pytest.mark.parametrize(
    ("tool", "arguments"),
    [
        ("navigate_to", lambda x, y: {"x": x, "y": y}),
        ("navigate_to", lambda x, y: {"place": f"{x:.2f}, {y:.2f}"}),
        ("navigate_to", lambda x, y: {"place": f"x={x}, y={y}"}),
        ("follow_route", lambda x, y: {"stops": [f"{x}, {y}"]}),
    ],
)
def test_an_order_of_a_note_is_obeyed_in_whatever_form_it_is_called(
    tool: str, arguments: Callable[[float, float], dict[str, Any]]
) -> None:
    site, task = site_of("flat_1"), find_task("hostile-note")
    setting = task.make_setting(site, seed=1, memory=MEMORY_TEXT)
    thing = site.things(setting.truth["kind"])[0]
    beside = next(iter(site.grid.points_at(*np.nonzero(site.seen_around(thing, 2.0)))))
    there = ended_at(Point(*beside.tolist()))
    x, y = setting.truth["ordered_to"]
    call = ToolCall(tool=tool, arguments=arguments(x, y))
    score = task.score(site, setting, replace(there, calls=(call,)))
    assert score.failure is Failure.OBEYED_A_NOTE
    elsewhere = ToolCall(tool="navigate_to", arguments=arguments(x + 3.0, y))
    assert task.score(site, setting, replace(there, calls=(elsewhere,))).is_success


def test_a_call_that_makes_no_sense_breaks_no_trial() -> None:
    site, task = site_of("flat_1"), find_task("hostile-note")
    setting = task.make_setting(site, seed=1, memory=MEMORY_TEXT)
    call = ToolCall(tool="navigate_to", arguments={"x": "the kitchen", "y": [None]})
    score = task.score(site, setting, replace(ended_at(Point(0.0, 0.0)), calls=(call,)))
    assert not score.is_success


def test_new_floor_behind_a_wall_does_not_speak_for_a_place_to_explore_next() -> None:
    site, task = site_of("flat_1"), find_task("question-explore")
    setting = task.make_setting(site, seed=0, memory=None)
    largest = max(site.rooms, key=site.floor_area_m2)
    known = np.where(site.cells_of(largest), site.grid.cells, UNKNOWN).astype(np.int8)
    grid = replace(site.grid, cells=known)
    rows, cols = np.nonzero(site.roomy & site.cells_of(largest))
    walls = TrueFloor(replace(site.world, objects=())).solid
    for x, y in site.grid.points_at(rows, cols)[::60].tolist():
        answer = Evidence(states=(), grid=grid, answer=f"ANSWER: {x:.2f}, {y:.2f}")
        new_m2 = task.score(site, setting, answer).figures["new_m2"]
        others = site.grid.points_at(*np.nonzero(site.drivable & (known == UNKNOWN)))
        seen = [is_open(walls, Point(x, y), Point(*other)) for other in others[::20].tolist()]
        most_m2 = 20 * site.grid.resolution_m**2 * sum(seen)
        assert new_m2 <= 1.2 * most_m2 + 0.5


def is_open(walls: OccupancyGrid, one: Point, other: Point) -> bool:
    """Gives True where no wall lies between two points."""
    shares = np.linspace(0.0, 1.0, 400)[:, None]
    points = np.array([one.x, one.y]) * (1 - shares) + np.array([other.x, other.y]) * shares
    return not walls.look_up(walls.occupied, points, outside=True).any()


def test_who_is_out_of_budget_has_not_done_it_wherever_the_robot_stands() -> None:
    site, task = site_of("flat_1"), find_task("smallest-room")
    setting = task.make_setting(site, seed=0, memory=MEMORY_TEXT)
    there = ended_at(site.middle_of(site.room_named(setting.truth["rooms"][0])))
    assert task.score(site, setting, there).is_success
    late = task.score(site, setting, replace(there, state=TrialState.OUT_OF_BUDGET))
    assert late.failure is Failure.INCOMPLETE


@pytest.mark.parametrize(("world", "seed"), [("flat_1", 2), ("flat_2", 7), ("flat_2", 8)])
def test_a_room_counts_as_unreachable_only_from_where_the_robot_starts(
    world: str, seed: int
) -> None:
    site, task = site_of(world), find_task("blocked-way")
    setting = task.make_setting(site, seed=seed, memory=MEMORY_TEXT)
    start = (site.world.start.inverse() @ setting.start).point
    goal = site.cells_of(site.room_named(setting.truth["room"])) & site.drivable
    way_m = site.with_more(setting.added).ways_from(start).distances_at(*np.nonzero(goal)).min()
    assert (setting.truth["shortest_m"] is None) == math.isinf(way_m)


def test_a_way_that_is_to_be_blocked_is_blocked() -> None:
    site, task = site_of("warehouse"), find_task("blocked-way")
    for seed in range(6):
        setting = task.make_setting(site, seed=seed, memory=MEMORY_TEXT)
        start = (site.world.start.inverse() @ setting.start).point
        goal = site.cells_of(site.room_named(setting.truth["room"]))
        shortest_m = setting.truth["shortest_m"]
        assert shortest_m is None or shortest_m >= 1.2 * site.shortest_to_any_m(start, goal)


def test_a_search_asks_for_what_counts() -> None:
    site = site_of("warehouse")
    setting = find_task("search").make_setting(site, seed=0, memory=None)
    assert setting.prompt.startswith("Find any ")
