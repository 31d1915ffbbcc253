"""Places by relation: beside a pose, in a direction of a thing, in front of it and facing it."""

import math
from dataclasses import dataclass

import numpy as np

from mapspeak.evaluation.scores import Evidence, Site, judge_near, judge_pose
from mapspeak.evaluation.tasks.objects import findable_kinds
from mapspeak.evaluation.tasks.task import dice, draw_start, point_text
from mapspeak.evaluation.trials import Score, Setting
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.simulator import WorldObject

__all__ = ["RELATION_TASKS"]

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
class SideTask:
    """The robot goes to one side of a pose that is given by numbers."""

    name: str = "side-of-pose"
    needs_map: bool = True

    def is_offered(self, site: Site) -> bool:
        """Every world has poses with room beside them."""
        del site
        return True

    def make_setting(self, site: Site, *, seed: int, memory: str | None) -> Setting:
        """Draws the pose, the side and the distance."""
        random = dice(self.name, site, seed)
        goal, prompt = Point(0.0, 0.0), ""
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
            if _is_roomy(site, goal) and _is_open(site, pose.point, goal):
                break
        return _setting(site, random, prompt, goal, memory)

    def score(self, site: Site, setting: Setting, evidence: Evidence) -> Score:
        """Scores how far the robot stands from there."""
        goal = Point(*setting.truth["goal"])
        return judge_near(site, evidence, goal, within_m=POSE_TOLERANCE_M)


@dataclass(frozen=True, slots=True)
class DirectionTask:
    """The robot goes so far in a direction of the map from the only thing of its kind."""

    name: str = "side-of-thing"
    needs_map: bool = True

    def is_offered(self, site: Site) -> bool:
        """True where the world has a single thing with room beside it."""
        return bool(_places_beside(site))

    def make_setting(self, site: Site, *, seed: int, memory: str | None) -> Setting:
        """Draws the thing, the direction and the distance."""
        random = dice(self.name, site, seed)
        places = _places_beside(site)
        thing, direction, away_m, goal = places[int(random.integers(len(places)))]
        label = site.label_of(thing.kind)
        prompt = f"Go to the place {away_m:g} m {direction} of the {label}. {NORTH_IS_UP}"
        return _setting(site, random, prompt, goal, memory)

    def score(self, site: Site, setting: Setting, evidence: Evidence) -> Score:
        """Scores how far the robot stands from there."""
        goal = Point(*setting.truth["goal"])
        return judge_near(site, evidence, goal, within_m=THING_TOLERANCE_M)


@dataclass(frozen=True, slots=True)
class FacingTask:
    """The robot stands in front of the only thing of its kind and looks at it."""

    name: str = "facing-thing"
    needs_map: bool = True

    def is_offered(self, site: Site) -> bool:
        """True where the world has a single thing that can be looked at."""
        return bool(_single_things(site))

    def make_setting(self, site: Site, *, seed: int, memory: str | None) -> Setting:
        """Draws the thing."""
        random = dice(self.name, site, seed)
        things = _single_things(site)
        thing = things[int(random.integers(len(things)))]
        near = site.seen_around(thing, FACING_WITHIN_M)
        start = draw_start(site, random, without=near)
        return Setting(
            prompt=f"Go to the {site.label_of(thing.kind)}, stop at most {FACING_WITHIN_M:g} m "
            "from it and look straight at it.",
            start=site.in_world(start),
            is_known=True,
            memory=memory,
            truth={
                "kind": thing.kind,
                "shortest_m": round(site.shortest_to_any_m(start.point, near), 3),
            },
        )

    def score(self, site: Site, setting: Setting, evidence: Evidence) -> Score:
        """Scores distance, heading and sight."""
        (thing,) = site.things(setting.truth["kind"])
        return judge_pose(site, evidence, thing, within_m=FACING_WITHIN_M, facing_rad=FACING_RAD)


def _setting(
    site: Site, random: np.random.Generator, prompt: str, goal: Point, memory: str | None
) -> Setting:
    near = site.near(goal, POSE_TOLERANCE_M)
    start = draw_start(site, random, without=site.near(goal, 3 * THING_TOLERANCE_M))
    return Setting(
        prompt=prompt,
        start=site.in_world(start),
        is_known=True,
        memory=memory,
        truth={
            "goal": [round(goal.x, 3), round(goal.y, 3)],
            "shortest_m": round(site.shortest_to_any_m(start.point, near), 3),
        },
    )


def _single_things(site: Site) -> list[WorldObject]:
    return [site.things(kind)[0] for kind in findable_kinds(site) if len(site.things(kind)) == 1]


def _places_beside(site: Site) -> list[tuple[WorldObject, str, float, Point]]:
    """Gives things, directions and distances of which the place is roomy and open to the thing."""
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


def _is_roomy(site: Site, point: Point) -> bool:
    cell = site.grid.cell_at(point)
    return site.grid.contains(cell) and bool(site.roomy[cell.row, cell.col])


def _is_open(site: Site, one: Point, other: Point) -> bool:
    """True where the robot could drive straight from one point to the other."""
    shares = np.linspace(0.0, 1.0, 50)[:, None]
    way = np.array([one.x, one.y]) + shares * np.array([other.x - one.x, other.y - one.y])
    return bool(site.floor.standable[site.grid.cells_at(way)].all())


RELATION_TASKS = (SideTask(), DirectionTask(), FacingTask())
