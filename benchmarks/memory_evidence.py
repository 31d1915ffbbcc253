"""What was taken away is doubted, and what stands is not, by an eye that misses one thing in five.

Drawn buildings that nothing was chosen on (MAPSPEAK_SEED). Each thing is seen from three places;
a week later it is looked at three times from where it should show, by looks that name what is in
view but for one thing in five: once as if it had been taken away, once as it stands there. The
three looks are from three places, or under one name from one, as a robot writes that comes back.
As the baseline the same memories are judged as if no look had a time.

Moved: after such looks a thing of the same name is seen from two places where another stood; where
the first was taken away it is that one, and where the first stands it is a second one.
"""

import math
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np

from benchmarks.figure import Figure
from benchmarks.memory.observer import Memory, observe
from benchmarks.memory.sites import RADIUS_M, Site, TrueThing
from mapspeak.geometry import Point, Pose
from mapspeak.memory import Landmark, SemanticMap, Waypoint
from mapspeak.memory.merging import merge_waypoint
from mapspeak.simulator.worlds.worldfiles import parse_world
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.recollection import Recollector
from mapspeak.worldmodel.remembered import RememberedThing
from tools.worldgen import draw_plan, style_names

__all__ = ["measure"]

SEED = int(os.environ.get("MAPSPEAK_SEED", "71209"))
MISSED_RATIO = 0.2
BEARING_NOISE_RAD = math.radians(6)
N_LOOKS = 3
NEAREST_M, FARTHEST_M = 1.0, 3.5
AHEAD_RAD = math.radians(15)
HALF_VIEW_RAD = math.radians(30)
DOUBTED, TRUSTED = 0.3, 0.8
MONDAY = datetime(2026, 11, 23, 9, 0, tzinfo=UTC)
WEEK = timedelta(days=7)
NOW = MONDAY + WEEK + timedelta(hours=4)
MOST_TRIES = 80
NEW_M = 1.5
RECOLLECTOR = Recollector(lambda: None)
"""Keeps the part of a memory that does not change from case to case."""


def measure() -> Iterable[Figure]:
    """Return how many of the taken things are doubted, and of the standing ones trusted."""
    cases = [case for style in style_names() for case in _play(style)]
    for what in ("three places", "one place"):
        for is_taken in (True, False):
            ours = [ratio for name, taken, ratio in cases if (name, taken) == (what, is_taken)]
            is_right = [each < DOUBTED if is_taken else each > TRUSTED for each in ours]
            state = f"taken away, below {DOUBTED}" if is_taken else f"standing, above {TRUSTED}"
            name = f"looks from {what}: {state}, of {len(ours)} (target: 95)"
            yield Figure(name=name, value=100 * sum(is_right) / len(ours), unit="%")
    for is_taken in (True, False):
        ours = [ratio for name, taken, ratio in cases if (name, taken) == ("no times", is_taken)]
        is_right = [each < DOUBTED if is_taken else each > TRUSTED for each in ours]
        state = f"taken away, below {DOUBTED}" if is_taken else f"standing, above {TRUSTED}"
        name = f"three places, no times: {state}, of {len(ours)}"
        yield Figure(name=name, value=100 * sum(is_right) / len(ours), unit="%")
    yield from _sum_up_moves([case for style in style_names() for case in _play_moves(style)])


def _sum_up_moves(cases: Sequence[tuple[bool, bool, bool, bool]]) -> Iterator[Figure]:
    for is_only in (True, False):
        for is_taken in (True, False):
            ours = [case for case in cases if case[:2] == (is_only, is_taken)]
            kind = "one of its name" if is_only else "one of several of its name"
            state = "moved" if is_taken else "stands, another is new"
            for number, what in ((2, "taken for the new one"), (3, "for another one")):
                name = f"{kind}, {state}: {what}, of {len(ours)}"
                share = sum(case[number] for case in ours) / max(len(ours), 1)
                yield Figure(name=name, value=100 * share, unit="%")


def _play_moves(style: str) -> Iterator[tuple[bool, bool, bool, bool]]:
    """Return whether a thing is alone in its name, was taken, and follows to the new or another."""
    site = Site(parse_world(draw_plan(style, seed=SEED), name=style))
    memory = observe(site, seed=SEED, has_ranges=True)
    before = [replace(each, recorded_at=MONDAY) for each in memory.places.waypoints]
    random = np.random.default_rng(SEED)
    for thing in memory.annotated:
        others = [each for each in site.things if each.label != thing.label]
        there = others[int(random.integers(len(others)))]
        poses = list(_find_stands(site, thing, random))
        new_poses = list(_find_stands(site, there, random))[:2]
        if len(poses) < N_LOOKS or len(new_poses) < 2:
            continue
        instead = replace(there, label=thing.label)
        seen = [_name_one(pose, instead, random, number) for number, pose in enumerate(new_poses)]
        for is_taken in (True, False):
            looks = [
                _look(site, pose, thing, random, is_taken=is_taken, number=number)
                for number, pose in enumerate(poses)
            ]
            world, _ = _recall(site, [*before, *looks, *seen])
            found = _find(world.things, memory, thing)
            now = None if found is None else world.follow(found)
            if found is not None and now is not None:
                is_new = now.point.distance_to(there.point) <= NEW_M
                is_only = all(each is thing or each.label != thing.label for each in site.things)
                yield (
                    is_only,
                    is_taken,
                    now is not found and is_new,
                    now is not found and not is_new,
                )


def _name_one(pose: Pose, thing: TrueThing, random: np.random.Generator, number: int) -> Waypoint:
    off_rad = math.remainder(pose.point.bearing_to(thing.point) - pose.yaw_rad, math.tau)
    landmark = Landmark(
        label=thing.label,
        bearing_rad=off_rad + BEARING_NOISE_RAD * random.normal(),
        range_m=pose.point.distance_to(thing.point),
    )
    return Waypoint(
        name=f"new {number}",
        pose=pose,
        functional_landmarks=(landmark,),
        recorded_at=MONDAY + WEEK + timedelta(hours=3 + number / 2),
    )


def _play(style: str) -> Iterator[tuple[str, bool, float]]:
    site = Site(parse_world(draw_plan(style, seed=SEED), name=style))
    memory = observe(site, seed=SEED, has_ranges=True)
    before = [replace(each, recorded_at=MONDAY) for each in memory.places.waypoints]
    known = {each.id: each for each in _recall(site, before)[0].things}
    random = np.random.default_rng(SEED)
    for thing in memory.annotated:
        remembered = _find(known.values(), memory, thing)
        poses = [] if remembered is None else list(_find_stands(site, thing, random))
        if remembered is None or len(poses) < N_LOOKS:
            continue
        for is_taken in (True, False):
            looks = [
                _look(site, pose, thing, random, is_taken=is_taken, number=number)
                for number, pose in enumerate(poses)
            ]
            yield "three places", is_taken, _judge(site, [*before, *looks], memory, thing)
            timeless = [replace(each, recorded_at=None) for each in (*before, *looks)]
            yield "no times", is_taken, _judge(site, timeless, memory, thing)
            yield (
                "one place",
                is_taken,
                _judge_one_place(site, before, memory, thing, poses[0], is_taken, random),
            )


def _judge_one_place(
    site: Site,
    before: Sequence[Waypoint],
    memory: Memory,
    thing: TrueThing,
    pose: Pose,
    is_taken: bool,  # noqa: FBT001 - as measured
    random: np.random.Generator,
) -> float:
    """Judge after a look that shows the thing, and three more under the same name."""
    record = _look(site, pose, thing, random, is_taken=False, number=0, is_sure=True)
    record = replace(record, recorded_at=MONDAY + timedelta(hours=1))
    for number in range(1, N_LOOKS + 1):
        now = _look(site, pose, thing, random, is_taken=is_taken, number=number)
        record = merge_waypoint(record, replace(now, name=record.name)).waypoint
    return _judge(site, [*before, record], memory, thing)


def _judge(site: Site, waypoints: Sequence[Waypoint], memory: Memory, thing: TrueThing) -> float:
    world, _ = _recall(site, waypoints)
    found = _find(world.things, memory, thing)
    return 0.0 if found is None else world.judge.judge_thing(found, now=NOW).ratio


def _recall(site: Site, waypoints: Sequence[Waypoint]) -> tuple[WorldModel, SemanticMap]:
    places = SemanticMap(waypoints=tuple(waypoints))
    world = WorldModel(
        site.grid,
        Pose(0.0, 0.0),
        places,
        radius_m=RADIUS_M,
        revision=site.revision,
        recollector=RECOLLECTOR,
    )
    return world, places


def _find(
    things: Iterable[RememberedThing], memory: Memory, thing: TrueThing
) -> RememberedThing | None:
    """Return the thing that most right views of a true one were joined to."""
    best, n_best = None, 0
    for each in things:
        n_views = sum(
            memory.truth.get((view.waypoint, view.landmark)) is thing
            and (view.waypoint, view.landmark) not in memory.wrong
            for view in each.thing.supporting
        )
        if n_views > n_best:
            best, n_best = each, n_views
    return best


def _find_stands(site: Site, thing: TrueThing, random: np.random.Generator) -> Iterator[Pose]:
    """Return poses from which the thing is in plain view, nearly ahead."""
    off_m = np.hypot(*(site.places - (thing.point.x, thing.point.y)).T)
    near = np.flatnonzero((off_m >= NEAREST_M) & (off_m <= FARTHEST_M))
    n_found = 0
    for i in random.permutation(near)[:MOST_TRIES].tolist():
        place = Point(*site.places[i].tolist())
        if n_found < N_LOOKS and site.sees(place, thing):
            n_found += 1
            turn_rad = float(random.uniform(-AHEAD_RAD, AHEAD_RAD))
            yield Pose(place.x, place.y, place.bearing_to(thing.point) + turn_rad)


def _look(
    site: Site,
    pose: Pose,
    thing: TrueThing,
    random: np.random.Generator,
    *,
    is_taken: bool,
    number: int,
    is_sure: bool = False,
) -> Waypoint:
    seen = []
    for other in site.things:
        off_rad = math.remainder(pose.point.bearing_to(other.point) - pose.yaw_rad, math.tau)
        is_in_view = (
            abs(off_rad) <= HALF_VIEW_RAD
            and pose.point.distance_to(other.point) <= FARTHEST_M
            and site.sees(pose.point, other)
        )
        is_missed = random.random() < MISSED_RATIO and not (is_sure and other is thing)
        if is_in_view and not is_missed and not (is_taken and other is thing):
            bearing_rad = off_rad + BEARING_NOISE_RAD * random.normal()
            range_m = pose.point.distance_to(other.point)
            seen.append(Landmark(label=other.label, bearing_rad=bearing_rad, range_m=range_m))
    return Waypoint(
        name=f"later {number}",
        pose=pose,
        functional_landmarks=tuple(seen),
        recorded_at=MONDAY + WEEK + timedelta(hours=number),
        picture=f"P{number}.jpg",
    )
