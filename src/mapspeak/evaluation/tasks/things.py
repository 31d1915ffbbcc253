"""Things to go to: by name, by what they are for, beside them, in front of them, and in routes."""

import math
from functools import cache
from importlib import resources

import numpy as np
from ruamel.yaml import YAML

from mapspeak.evaluation.scores.groundtruth import BESIDE_M, GroundTruth
from mapspeak.evaluation.scores.judging import (
    Evidence,
    judge_near,
    judge_pose,
    judge_route,
    judge_thing,
    judge_view,
)
from mapspeak.evaluation.tasks.task import Draw, Task, Truth, point_text
from mapspeak.evaluation.trials import Limits, Score, Setting
from mapspeak.geometry import Point
from mapspeak.places.standing import point_ahead
from mapspeak.simulator import WorldObject
from mapspeak.spatial.paths import DistanceField
from mapspeak.spatial.visibility import mean_on_line

# --- things by name, or by what they are for -----------------------------------------------------

FIRE = "fire_extinguisher"
FIRE_WISH = "Fire detected nearby. Navigate to the tool used for it."
"""The paper's Task 3, word for word."""

SEARCH_TOOLS = ("search_for", "look_around")
SEARCH_LIMITS = Limits(n_calls=200, robot_time_s=2400.0, wall_s=900.0)
OUT_OF_THE_WAY_M = 1.0
NEAR_M = 2.0
MOST_TRIES = 200


@cache
def _wishes() -> dict[str, list[str]]:
    """Return what people say when they want a thing, by its kind."""
    text = resources.files(__package__).joinpath("wishes.yaml").read_text(encoding="utf-8")
    return dict(YAML(typ="safe", pure=True).load(text))


def findable_kinds(site: GroundTruth) -> tuple[str, ...]:
    """Return the kinds one can wish for of which the robot can get to all things of the world."""
    kinds = sorted({thing.kind for thing in site.world.objects} & set(_wishes()))
    return tuple(kind for kind in kinds if site.beside(kind).any())


def has_findable_kinds(site: GroundTruth) -> bool:
    """Return True where the world has things to go to."""
    return bool(findable_kinds(site))


def draw_wish(draw: Draw) -> tuple[str, str]:
    """Draw a kind that the world has; return words for it, and the kind."""
    kind = str(draw.random.choice(findable_kinds(draw.site)))
    return draw.one_of(_wishes()[kind]), kind


def thing_setting(
    draw: Draw,
    prompt: str,
    kind: str,
    *,
    is_known: bool = True,
    tools: tuple[str, ...] = (),
    limits: Limits | None = None,
) -> Setting:
    """Return the setting of a drive to a thing of a kind, from anywhere but beside one."""
    site = draw.site
    around = np.logical_or.reduce(
        [site.near(site.place_of(t), BESIDE_M + OUT_OF_THE_WAY_M) for t in site.things(kind)]
    )
    start = draw.start(without=around)
    truth = {"kind": kind, "shortest_m": draw.shortest_m(start, site.beside(kind))}
    return draw.setting(prompt, start, truth, is_known=is_known, tools=tools, limits=limits)


def judge_kind(site: GroundTruth, truth: Truth, evidence: Evidence) -> Score:
    """Score what the robot stands beside."""
    return judge_thing(site, evidence, site.things(truth["kind"]))


def _draw_search(draw: Draw) -> Setting:
    """Name a thing in a building that the robot has never seen, without map and memory."""
    kind = str(draw.random.choice(findable_kinds(draw.site)))
    prompt = f"Find any {draw.site.label_of(kind)} and stop beside it."
    tools = (*SEARCH_TOOLS, "explore")
    return thing_setting(draw, prompt, kind, is_known=False, tools=tools, limits=SEARCH_LIMITS)


def _draw_view(draw: Draw) -> Setting:
    """Ask for a picture of a thing that the memory may know."""
    kind = str(draw.random.choice(findable_kinds(draw.site)))
    prompt = f"Take a picture of any {draw.site.label_of(kind)} and stay where it was taken."
    return thing_setting(draw, prompt, kind, tools=SEARCH_TOOLS, limits=SEARCH_LIMITS)


NEAREST, FARTHEST = "nearest", "farthest"
CLEARLY_FARTHER = 1.3
"""By this much the ways to two things have to differ where the nearest or farthest is asked for."""


def _draw_by_way(draw: Draw) -> Setting:
    """Ask for the nearest or the farthest of several things, where it is clear which that is."""
    site = draw.site
    for _ in range(MOST_TRIES):
        kind, order = draw.one_of(_several_kinds(site)), draw.one_of((NEAREST, FARTHEST))
        things, start = site.things(kind), draw.start()
        ways = site.ways_from(start.point)
        ways_m = [way_to(site, ways, thing) for thing in things]
        ordered = sorted(range(len(things)), key=lambda at: ways_m[at], reverse=order == FARTHEST)
        near_m, far_m = sorted(ways_m[at] for at in ordered[:2])
        if near_m > OUT_OF_THE_WAY_M and CLEARLY_FARTHER * near_m <= far_m < math.inf:
            break
    chosen = things[ordered[0]]
    label = site.label_of(kind)
    prompt = f"Go to the {order} {label}, by the way that you have to drive, and stop before it."
    truth = {"kind": kind, "name": chosen.name, "shortest_m": round(ways_m[ordered[0]], 3)}
    return draw.setting(prompt, start, truth)


def way_to(site: GroundTruth, ways: DistanceField, thing: WorldObject) -> float:
    """Return the way to the nearest place from which a thing is seen from near."""
    rows, cols = np.nonzero(site.seen_around(thing, NEAR_M))
    return float(ways.distances_at(rows, cols).min(initial=math.inf))


def _several_kinds(site: GroundTruth) -> list[str]:
    return [kind for kind in findable_kinds(site) if len(site.things(kind)) > 1]


def _judge_by_way(site: GroundTruth, truth: Truth, evidence: Evidence) -> Score:
    chosen = [thing for thing in site.things(truth["kind"]) if thing.name == truth["name"]]
    return judge_thing(site, evidence, chosen)


OBJECT_TASKS = (
    Task(
        name="view",
        draw=_draw_view,
        judge=lambda site, truth, evidence: judge_view(site, evidence, site.things(truth["kind"])),
        is_offered=has_findable_kinds,
    ),
    Task(
        name="superlative",
        draw=_draw_by_way,
        judge=_judge_by_way,
        is_offered=lambda site: bool(_several_kinds(site)),
    ),
    Task(
        name="fire-tool",
        draw=lambda draw: thing_setting(draw, FIRE_WISH, FIRE),
        judge=judge_kind,
        is_offered=lambda site: bool(site.beside(FIRE).any()),
    ),
    Task(
        name="object",
        draw=lambda draw: thing_setting(draw, *draw_wish(draw)),
        judge=judge_kind,
        is_offered=has_findable_kinds,
    ),
    Task(
        name="search",
        draw=_draw_search,
        judge=judge_kind,
        is_offered=has_findable_kinds,
        needs_map=False,
    ),
)


# --- places beside a pose or a thing -------------------------------------------------------------

SIDES = {"to the left of": 90.0, "to the right of": -90.0, "in front of": 0.0, "behind": 180.0}
"""Sides of a pose, and their headings from its own, in degrees."""
COMPASS = {"east": 0.0, "north": 90.0, "west": 180.0, "south": -90.0}
DISTANCES_M = (1.0, 1.5, 2.0)
POSE_TOLERANCE_M = 0.4
"""For places that numbers name: the robot's own body is as wide."""
THING_TOLERANCE_M = 0.8
"""For places beside things, which are remembered by bearing and range."""
FACING_WITHIN_M = 3.5
FACING_RAD = math.radians(30.0)
LEAST_STOPS, MOST_STOPS = 2, 4
ROUTE_LIMITS = Limits(n_calls=80, robot_time_s=1800.0, wall_s=900.0)


def _place_setting(draw: Draw, prompt: str, goal: Point) -> Setting:
    """Start away from a place that the prompt tells."""
    start = draw.start(without=draw.site.near(goal, 3 * THING_TOLERANCE_M))
    shortest_m = draw.shortest_m(start, draw.site.near(goal, POSE_TOLERANCE_M))
    truth = {"goal": [round(goal.x, 3), round(goal.y, 3)], "shortest_m": shortest_m}
    return draw.setting(prompt, start, truth)


def _draw_beside_pose(draw: Draw) -> Setting:
    """Draw a pose that is given by numbers, a side of it and a distance."""
    site, random = draw.site, draw.random
    for _ in range(MOST_TRIES):
        pose = site.draw_pose(random)
        yaw_deg = float(random.integers(-17, 19) * 10)
        words, side_deg = list(SIDES.items())[random.choice(len(SIDES))]
        away_m = float(random.choice(DISTANCES_M))
        goal = point_ahead(pose.point, math.radians(yaw_deg + side_deg), away_m)
        if _is_roomy(site, goal) and _is_open(site, pose.point, goal):
            break
    prompt = (
        f"Think of somebody who stands at {point_text(pose.point)} and looks along a yaw "
        f"of {yaw_deg:.0f} deg. Go to the place {away_m:g} m {words} them."
    )
    return _place_setting(draw, prompt, goal)


def _draw_beside_thing(draw: Draw) -> Setting:
    """Draw the only thing of its kind, a direction of the map and a distance."""
    thing, direction, away_m, goal = draw.one_of(_places_beside(draw.site))
    label = draw.site.label_of(thing.kind)
    prompt = f"Go to the place {away_m:g} m {direction} of the {label}. On the map +y is north."
    return _place_setting(draw, prompt, goal)


def _draw_facing(draw: Draw) -> Setting:
    """Draw the only thing of its kind, in front of which the robot shall stand and look at it."""
    thing = draw.one_of(_single_things(draw.site))
    near = draw.site.seen_around(thing, FACING_WITHIN_M)
    start = draw.start(without=near)
    prompt = (
        f"Go to the {draw.site.label_of(thing.kind)}, stop at most {FACING_WITHIN_M:g} m "
        "from it and look straight at it."
    )
    truth = {"kind": thing.kind, "shortest_m": draw.shortest_m(start, near)}
    return draw.setting(prompt, start, truth)


def _judge_facing(site: GroundTruth, truth: Truth, evidence: Evidence) -> Score:
    (thing,) = site.things(truth["kind"])
    return judge_pose(site, evidence, thing, within_m=FACING_WITHIN_M, facing_rad=FACING_RAD)


def _single_things(site: GroundTruth) -> list[WorldObject]:
    return [site.things(kind)[0] for kind in findable_kinds(site) if len(site.things(kind)) == 1]


def _places_beside(site: GroundTruth) -> list[tuple[WorldObject, str, float, Point]]:
    """Return things, directions and distances of which the place is roomy and open to the thing."""
    places = []
    for thing in _single_things(site):
        at = site.place_of(thing)
        for direction, heading_deg in COMPASS.items():
            for away_m in DISTANCES_M:
                goal = point_ahead(at, math.radians(heading_deg), away_m)
                if _is_roomy(site, goal) and site.is_in_sight(goal, thing):
                    places.append((thing, direction, away_m, goal))
    return places


def _is_roomy(site: GroundTruth, point: Point) -> bool:
    cell = site.grid.cell_at(point)
    return site.grid.contains(cell) and bool(site.roomy[cell.row, cell.col])


def _is_open(site: GroundTruth, one: Point, other: Point) -> bool:
    """Return True where the robot could drive straight from one point to the other."""
    ends = site.grid.fractional_cells_at(np.array([[one.x, one.y], [other.x, other.y]]))
    cost = np.where(site.drivable, 0.0, np.inf)
    return math.isfinite(mean_on_line(cost, ends[0], ends[1]))


RELATION_TASKS = (
    Task(
        name="side-of-pose",
        draw=_draw_beside_pose,
        judge=lambda _site, truth, evidence: judge_near(
            evidence, Point(*truth["goal"]), within_m=POSE_TOLERANCE_M
        ),
        is_offered=lambda site: bool(site.roomy.any()),
    ),
    Task(
        name="side-of-thing",
        draw=_draw_beside_thing,
        judge=lambda _site, truth, evidence: judge_near(
            evidence, Point(*truth["goal"]), within_m=THING_TOLERANCE_M
        ),
        is_offered=lambda site: bool(_places_beside(site)),
    ),
    Task(
        name="facing-thing",
        draw=_draw_facing,
        judge=_judge_facing,
        is_offered=lambda site: bool(_single_things(site)),
    ),
)


# --- routes --------------------------------------------------------------------------------------


def _draw_route(draw: Draw) -> Setting:
    """Draw kinds and their order; any thing of a kind will do."""
    site, random, kinds = draw.site, draw.random, findable_kinds(draw.site)
    n_stops = int(random.integers(LEAST_STOPS, min(MOST_STOPS, len(kinds)) + 1))
    chosen = [str(kind) for kind in random.choice(kinds, size=n_stops, replace=False)]
    start = draw.start(without=site.beside(chosen[0]))
    first, *others = (f"any {site.label_of(kind)}" for kind in chosen)
    steps = ", then ".join((f"first to {first}", *(f"to {other}" for other in others)))
    prompt = (
        f"Go {steps}. Keep to this order and stop at each, at most {BESIDE_M:g} m from "
        "it with a free view of it. Stay at the last one."
    )
    return draw.setting(
        prompt, start, {"kinds": chosen}, tools=("follow_route",), limits=ROUTE_LIMITS
    )


ROUTE_TASK = Task(
    name="route",
    draw=_draw_route,
    judge=lambda site, truth, evidence: judge_route(
        site, evidence, [site.things(kind) for kind in truth["kinds"]]
    ),
    is_offered=lambda site: len(findable_kinds(site)) >= LEAST_STOPS,
)
