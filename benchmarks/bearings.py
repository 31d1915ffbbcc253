"""How well a thing is placed by bearings read off pictures, and faced by the drive to it.

Drawn buildings that nothing was chosen on (MAPSPEAK_SEED). Every thing is seen from one place in
plain sight, up to 15 m away, or from two, the second nearer, or from three. Columns are read to
3 degrees (standard deviation), the heading is known to 1, and one view in twenty points anywhere.
While the radius is above 1.5 m the robot looks again on arrival, twice at most and if the thing is
in its picture, and drives once more.
"""

import math
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.figure import Figure
from benchmarks.memory.judging import HALF_WIDTH_M
from benchmarks.memory.sites import RADIUS_M, Site, TrueThing
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.memory import Landmark, SemanticMap, Waypoint
from mapspeak.places.goalcheck import judge_goal
from mapspeak.places.naming import Place
from mapspeak.places.ways import stand_at
from mapspeak.simulator.worlds.worldfiles import parse_world
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.recollection import Recollector
from mapspeak.worldmodel.remembered import RememberedThing
from tools.worldgen import draw_plan, style_names

__all__ = ["measure"]

SEED = int(os.environ.get("MAPSPEAK_SEED", "90417"))
COLUMN_RAD, HEADING_RAD = math.radians(3), math.radians(1)
WRONG_RATIO = 0.05
NEAREST_M, FARTHEST_M = 1.0, 15.0
HALF_VIEW_RAD = math.radians(35)
MOST_TRIES = 200
N_VIEWS = (1, 2, 3)
MOST_THINGS = 40
LOOK_AGAIN_M = 1.5
MOST_LOOKS = 2
FACED_M, FACED_RAD = 1.5, math.radians(30)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Case:
    """A thing that was seen so often, and where the robot takes it to be.

    Attributes:
        far_m: From the nearest place that it was seen from.
        first: The first drive ends facing it.
        later: So does the second, after the look on arrival where one is asked for.
    """

    label: str
    kind: str
    n_views: int
    far_m: float
    off_m: float
    radius_m: float
    first: bool
    later: bool


def measure() -> Iterable[Figure]:
    """Return errors, radii and drives, by how often a thing was seen."""
    cases = [case for style in style_names() for case in _play(style, seed=SEED)]
    for n_views in N_VIEWS:
        ours = [each for each in cases if each.n_views == n_views]
        yield from _sum_up(f"{n_views} views, {len(ours)} things", ours)
    yield from _sum_up(f"all {len(cases)}", cases)
    radius = {(each.label, each.n_views): each.radius_m for each in cases}
    pairs = [
        (radius_m, radius[label, 2])
        for (label, n_views), radius_m in radius.items()
        if n_views == 1 and (label, 2) in radius
    ]
    grown = [second > first + 1e-6 for first, second in pairs]
    yield _share(f"a second nearer look makes the radius larger, of {len(grown)} (0)", grown)


def _sum_up(what: str, cases: Sequence[_Case]) -> Iterator[Figure]:
    off_m = float(np.median([each.off_m for each in cases]))
    radius_m = float(np.median([each.radius_m for each in cases]))
    yield Figure(name=f"{what}: median error", value=off_m, unit="m")
    yield Figure(name=f"{what}: median radius", value=radius_m, unit="m")
    yield Figure(name=f"{what}: radius for the error (2 at most)", value=radius_m / off_m, unit="")
    held = [each.off_m <= each.radius_m for each in cases]
    yield _share(f"{what}: within the radius (90)", held)
    yield _share(f"{what}: first drive faces it", [each.first for each in cases])
    yield _share(f"{what}: faces it after the look that is asked for", [c.later for c in cases])
    fine = [each.first for each in cases if each.radius_m <= LOOK_AGAIN_M]
    yield _share(f"{what}: first drive, of {len(fine)} told to {LOOK_AGAIN_M} m (95)", fine)


def _share(name: str, answers: Sequence[bool]) -> Figure:
    return Figure(name=name, value=100 * sum(answers) / max(len(answers), 1), unit="%")


def _play(style: str, *, seed: int) -> Iterator[_Case]:
    site = Site(parse_world(draw_plan(style, seed=seed), name=style))
    random = np.random.default_rng(seed)
    chosen = [site.things[i] for i in random.permutation(len(site.things))[:MOST_THINGS].tolist()]
    looks = {thing: list(_look_from(site, thing, random)) for thing in chosen}
    for n_views in N_VIEWS:
        own = {thing: each[:n_views] for thing, each in looks.items() if len(each) >= n_views}
        names = {thing: f"{number}" for number, thing in enumerate(own)}
        waypoints = [
            replace(look, name=f"{names[thing]} / {number}")
            for thing, each in own.items()
            for number, look in enumerate(each)
        ]
        recollector = Recollector(lambda: None)
        world = _open(site, waypoints, recollector)
        found = {thing: _find(world, names[thing]) for thing in own}
        for thing, remembered in found.items():
            if remembered.thing.position is None:
                continue
            name = names[thing]
            yield _judge(site, world, thing, remembered, name, n_views, waypoints, random)


def _judge(
    site: Site,
    world: WorldModel,
    thing: TrueThing,
    remembered: RememberedThing,
    name: str,
    n_views: int,
    waypoints: Sequence[Waypoint],
    random: np.random.Generator,
) -> _Case:
    position, radius_m = remembered.thing.position, remembered.thing.uncertainty_m or math.inf
    pose = stand_at(world, Place(remembered.id, remembered))
    first = later = _faces(site, world, pose, thing)
    known, told_m = list(waypoints), radius_m
    for number in range(MOST_LOOKS):
        if told_m <= LOOK_AGAIN_M or not _shows(site, pose, thing):
            break
        known.append(replace(_look(site, pose, thing, random), name=f"{name} / again {number}"))
        after = _open(site, known, world.recollector)
        seen = _find(after, name, last=True)
        told_m = seen.thing.uncertainty_m or math.inf
        pose = stand_at(after, Place(seen.id, seen))
        later = _faces(site, after, pose, thing)
    return _Case(
        label=f"{site.name} {thing.seen.name}",
        kind=thing.label,
        n_views=n_views,
        far_m=min(view.place.distance_to(thing.point) for view in remembered.thing.supporting),
        off_m=math.inf if position is None else position.distance_to(thing.point),
        radius_m=radius_m,
        first=first,
        later=later,
    )


def _open(site: Site, waypoints: Sequence[Waypoint], recollector: Recollector) -> WorldModel:
    return WorldModel(
        site.grid,
        Pose(0.0, 0.0),
        SemanticMap(waypoints=tuple(waypoints)),
        radius_m=RADIUS_M,
        revision=site.revision,
        recollector=recollector,
    )


def _find(world: WorldModel, name: str, *, last: bool = False) -> RememberedThing:
    """Return what most views of a true thing were joined to, or the last of them."""
    wanted = f"{name} / again" if last else f"{name} / "
    bearings = {
        (each.waypoint.name, each.waypoint.landmarks[0])
        for each in world.places
        if each.waypoint.name.startswith(wanted)
    }
    return max(
        world.things,
        key=lambda each: sum((v.waypoint, v.landmark) in bearings for v in each.thing.supporting),
    )


def _look_from(site: Site, thing: TrueThing, random: np.random.Generator) -> Iterator[Waypoint]:
    """Return looks at a thing from places in plain sight of it, each nearer than the one before."""
    off_m = np.hypot(*(site.places - (thing.point.x, thing.point.y)).T)
    limit_m, tries = FARTHEST_M, random.permutation(len(off_m))[: 20 * MOST_TRIES]
    n_tried = 0
    for i in tries.tolist():
        if not NEAREST_M <= off_m[i] <= limit_m or n_tried >= MOST_TRIES:
            continue
        n_tried += 1
        place = Point(*site.places[i].tolist())
        turn_rad = float(random.uniform(-HALF_VIEW_RAD, HALF_VIEW_RAD))
        pose = Pose(place.x, place.y, wrap_angle(place.bearing_to(thing.point) + turn_rad))
        if _shows(site, pose, thing):
            limit_m = max(float(off_m[i]), NEAREST_M + 0.5)
            yield _look(site, pose, thing, random)


def _shows(site: Site, pose: Pose, thing: TrueThing) -> bool:
    far_m = pose.point.distance_to(thing.point)
    off_rad = abs(wrap_angle(pose.point.bearing_to(thing.point) - pose.yaw_rad))
    return far_m <= FARTHEST_M and off_rad <= HALF_VIEW_RAD + 0.1 and site.sees(pose.point, thing)


def _look(site: Site, pose: Pose, thing: TrueThing, random: np.random.Generator) -> Waypoint:
    """Return a record of a thing, and of others called so that the picture shows."""
    others = (each for each in site.things if each is not thing and each.label == thing.label)
    seen = [thing, *(each for each in others if _shows(site, pose, each))]
    landmarks = tuple(dict.fromkeys(_read_off(pose, each, random) for each in seen))
    return Waypoint(name="look", pose=pose, functional_landmarks=landmarks, picture="P1.jpg")


def _read_off(pose: Pose, thing: TrueThing, random: np.random.Generator) -> Landmark:
    off_rad = wrap_angle(pose.point.bearing_to(thing.point) - pose.yaw_rad)
    bearing_rad = off_rad + COLUMN_RAD * random.normal() + HEADING_RAD * random.normal()
    if random.random() < WRONG_RATIO:
        bearing_rad = float(random.uniform(-HALF_VIEW_RAD, HALF_VIEW_RAD))
    return Landmark(label=thing.label, bearing_rad=bearing_rad, bearing_from="picture")


def _faces(site: Site, world: WorldModel, pose: Pose, thing: TrueThing) -> bool:
    """Return True where a drive to a pose ends within 1.5 m of a thing, facing it in sight."""
    off_rad = abs(wrap_angle(pose.point.bearing_to(thing.point) - pose.yaw_rad))
    half_rad = math.atan2(HALF_WIDTH_M, max(pose.point.distance_to(thing.point), 1e-6))
    return (
        judge_goal(site.grid, world.distances, pose).is_ok
        and thing.distance_to(pose.point) <= FACED_M
        and off_rad <= FACED_RAD + half_rad
        and site.sees(pose.point, thing)
    )
