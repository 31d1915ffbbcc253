"""Places by relation to a pose or a thing, and routes past several things."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mapspeak.evaluation.scores import (
    BESIDE_M,
    Evidence,
    GroundTruth,
    judge_near,
    judge_pose,
    judge_route,
)
from mapspeak.evaluation.tasks.objects import findable_kinds
from mapspeak.evaluation.tasks.task import dice, draw_start, drive_setting, point_text
from mapspeak.evaluation.trials import Limits, Score, Setting
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.simulator import WorldObject

SIDES = {"left": 90.0, "right": -90.0, "front": 0.0, "back": 180.0}
SIDE_WORDS = {
    "left": "to the left of",
    "right": "to the right of",
    "front": "in front of",
    "back": "behind",
}
COMPASS = {"east": 0.0, "north": 90.0, "west": 180.0, "south": -90.0}
DISTANCES_M = (1.0, 1.5, 2.0)
POSE_TOLERANCE_M = 0.4
"""For places that numbers name: the robot's own body is as wide."""
THING_TOLERANCE_M = 0.8
"""For places beside things, which are remembered by bearing and range."""
FACING_WITHIN_M = 3.5
FACING_RAD = math.radians(30.0)
MOST_TRIES = 200
NORTH_IS_UP = "On the map +y is north."


@dataclass(frozen=True, slots=True)
class RelationGoal:
    """A place as it is asked for.

    Attributes:
        prompt: The words.
        goal: Where it is, in the map frame.
    """

    prompt: str
    goal: Point


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaceTask:
    """The robot goes to a place that is told by what it lies beside.

    Attributes:
        name: Of the task.
        draw: Draws the place.
        is_offered_in: True for worlds that have such places.
        within_m: How far from it the robot may stand.
        needs_map: It does.
    """

    name: str
    draw: Callable[[GroundTruth, np.random.Generator], RelationGoal]
    is_offered_in: Callable[[GroundTruth], bool]
    within_m: float
    needs_map: bool = True

    def is_offered(self, site: GroundTruth) -> bool:
        """Return True where the world has such places."""
        return self.is_offered_in(site)

    def make_setting(self, site: GroundTruth, *, seed: int, memory: str | None) -> Setting:
        """Draw the place, and start away from it."""
        random = dice(self.name, site, seed)
        aim = self.draw(site, random)
        start = draw_start(site, random, without=site.near(aim.goal, 3 * THING_TOLERANCE_M))
        return drive_setting(
            site,
            prompt=aim.prompt,
            start=start,
            right=site.near(aim.goal, POSE_TOLERANCE_M),
            memory=memory,
            goal=[round(aim.goal.x, 3), round(aim.goal.y, 3)],
        )

    def score(self, site: GroundTruth, setting: Setting, evidence: Evidence) -> Score:
        """Score how far the robot stands from there."""
        goal = Point(*setting.truth["goal"])
        return judge_near(site, evidence, goal, within_m=self.within_m)


def _aim_beside_pose(site: GroundTruth, random: np.random.Generator) -> RelationGoal:
    """Draw a pose that is given by numbers, a side of it and a distance."""
    aim = RelationGoal("", Point(0.0, 0.0))
    for _ in range(MOST_TRIES):
        pose = site.draw_pose(random)
        yaw_deg = float(random.integers(-17, 19) * 10)
        side = str(random.choice(list(SIDES)))
        away_m = float(random.choice(DISTANCES_M))
        goal = _step(pose.point, math.radians(yaw_deg + SIDES[side]), away_m)
        prompt = (
            f"Think of somebody who stands at {point_text(pose.point)} and looks along a yaw "
            f"of {yaw_deg:.0f} deg. Go to the place {away_m:g} m {SIDE_WORDS[side]} them."
        )
        aim = RelationGoal(prompt, goal)
        if _is_roomy(site, goal) and _is_open(site, pose.point, goal):
            break
    return aim


def _aim_beside_thing(site: GroundTruth, random: np.random.Generator) -> RelationGoal:
    """Draw the only thing of its kind, a direction of the map and a distance."""
    places = _places_beside(site)
    thing, direction, away_m, goal = places[int(random.integers(len(places)))]
    label = site.label_of(thing.kind)
    return RelationGoal(
        f"Go to the place {away_m:g} m {direction} of the {label}. {NORTH_IS_UP}", goal
    )


@dataclass(frozen=True, slots=True)
class FacingTask:
    """The robot stands in front of the only thing of its kind and looks at it."""

    name: str = "facing-thing"
    needs_map: bool = True

    def is_offered(self, site: GroundTruth) -> bool:
        """Return True where the world has a single thing that can be looked at."""
        return bool(_single_things(site))

    def make_setting(self, site: GroundTruth, *, seed: int, memory: str | None) -> Setting:
        """Draw the thing."""
        random = dice(self.name, site, seed)
        things = _single_things(site)
        thing = things[int(random.integers(len(things)))]
        near = site.seen_around(thing, FACING_WITHIN_M)
        start = draw_start(site, random, without=near)
        return drive_setting(
            site,
            prompt=f"Go to the {site.label_of(thing.kind)}, stop at most {FACING_WITHIN_M:g} m "
            "from it and look straight at it.",
            start=start,
            right=near,
            memory=memory,
            kind=thing.kind,
        )

    def score(self, site: GroundTruth, setting: Setting, evidence: Evidence) -> Score:
        """Score distance, heading and sight."""
        (thing,) = site.things(setting.truth["kind"])
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
                goal = _step(at, math.radians(heading_deg), away_m)
                if _is_roomy(site, goal) and site.is_in_sight(goal, thing):
                    places.append((thing, direction, away_m, goal))
    return places


def _step(point: Point, heading_rad: float, away_m: float) -> Point:
    return Pose(point.x, point.y, wrap_angle(heading_rad)).transform(Point(away_m, 0.0))


def _is_roomy(site: GroundTruth, point: Point) -> bool:
    cell = site.grid.cell_at(point)
    return site.grid.contains(cell) and bool(site.roomy[cell.row, cell.col])


def _is_open(site: GroundTruth, one: Point, other: Point) -> bool:
    """Return True where the robot could drive straight from one point to the other."""
    shares = np.linspace(0.0, 1.0, 50)[:, None]
    way = np.array([one.x, one.y]) + shares * np.array([other.x - one.x, other.y - one.y])
    return bool(site.drivable[site.grid.cells_at(way)].all())


def _always(site: GroundTruth) -> bool:
    return bool(site.roomy.any())


def _has_places_beside(site: GroundTruth) -> bool:
    return bool(_places_beside(site))


RELATION_TASKS = (
    PlaceTask(
        name="side-of-pose",
        draw=_aim_beside_pose,
        is_offered_in=_always,
        within_m=POSE_TOLERANCE_M,
    ),
    PlaceTask(
        name="side-of-thing",
        draw=_aim_beside_thing,
        is_offered_in=_has_places_beside,
        within_m=THING_TOLERANCE_M,
    ),
    FacingTask(),
)


MOST_STOPS = 4
LEAST_STOPS = 2
LIMITS = Limits(n_calls=80, robot_time_s=1800.0, wall_s=900.0)


@dataclass(frozen=True, slots=True)
class RouteTask:
    """The robot goes to several things in the order that is given; any thing of a kind will do."""

    name: str = "route"
    needs_map: bool = True

    def is_offered(self, site: GroundTruth) -> bool:
        """Return True where the world has things of two kinds to go to."""
        return len(findable_kinds(site)) >= LEAST_STOPS

    def make_setting(self, site: GroundTruth, *, seed: int, memory: str | None) -> Setting:
        """Draw the kinds and their order."""
        random = dice(self.name, site, seed)
        kinds = findable_kinds(site)
        most = min(MOST_STOPS, len(kinds))
        n_stops = int(random.integers(LEAST_STOPS, most + 1))
        chosen = [str(kind) for kind in random.choice(kinds, size=n_stops, replace=False)]
        start = draw_start(site, random, without=site.beside(chosen[0]))
        first, *others = (f"any {site.label_of(kind)}" for kind in chosen)
        steps = ", then ".join((f"first to {first}", *(f"to {other}" for other in others)))
        return Setting(
            prompt=f"Go {steps}. Keep to this order and stop at each, at most {BESIDE_M:g} m from "
            "it with a free view of it. Stay at the last one.",
            start=site.in_world(start),
            is_known=True,
            memory=memory,
            tools=("follow_route",),
            limits=LIMITS,
            truth={"kinds": chosen},
        )

    def score(self, site: GroundTruth, setting: Setting, evidence: Evidence) -> Score:
        """Score the way that was driven."""
        return judge_route(site, evidence, [site.things(kind) for kind in setting.truth["kinds"]])
