"""A scripted observer: it writes down what it sees, and errs as people and models do."""

import math
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from benchmarks.memory.lasers import Laser
from benchmarks.memory.sites import Site, TrueThing
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.memory import Landmark, LaserRing, SemanticMap, Waypoint

__all__ = ["DETECTOR", "NOISY", "Eye", "Memory", "observe", "observe_from"]

NEVER_RATIO = 1 / 3
N_VIEWS = 3
NEAREST_M, FARTHEST_M = 1.0, 5.0
HALF_VIEW_RAD = math.radians(45)
MOST_TRIES = 60


@dataclass(frozen=True, slots=True, kw_only=True)
class Eye:
    """How an observer errs: as people and models do, where nothing else is said."""

    bearing_noise_rad: float = math.radians(10)
    range_noise_ratio: float = 0.15
    wrong_ratio: float = 0.2
    bearing_from: str | None = None


NOISY = Eye()
DETECTOR = Eye(
    bearing_noise_rad=math.radians(1),
    range_noise_ratio=0.03,
    wrong_ratio=0.0,
    bearing_from="detector",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Memory:
    """What was written down, and, for judging alone, of what.

    Attributes:
        places: The records.
        truth: The thing that each landmark was seen of, by the name of the waypoint and landmark.
        wrong: Landmarks with another label or direction.
        annotated: Things that were written down at all.
    """

    places: SemanticMap
    truth: dict[tuple[str, Landmark], TrueThing]
    wrong: frozenset[tuple[str, Landmark]]
    annotated: tuple[TrueThing, ...]


@dataclass(slots=True)
class _Notebook:
    site: Site
    random: np.random.Generator
    has_ranges: bool
    laser: Laser | None
    eye: Eye
    n_views: dict[TrueThing, int]
    most_views: int = N_VIEWS
    truth: dict[tuple[str, Landmark], TrueThing] = field(default_factory=dict)
    wrong: set[tuple[str, Landmark]] = field(default_factory=set)
    waypoints: list[Waypoint] = field(default_factory=list)

    def look(self, pose: Pose) -> None:
        """Write down a place: everything in view that has too few views as yet."""
        name = f"view {len(self.waypoints)}"
        seen = [thing for thing, n in self.n_views.items() if n < self.most_views]
        seen = [thing for thing in seen if _is_in_view(self.site, pose, thing)]
        landmarks: dict[bool, list[Landmark]] = {True: [], False: []}
        ring = self.laser.turn(pose) if self.laser is not None and seen else None
        for thing in seen:
            landmark, is_wrong = self._write_down(pose, thing, ring)
            if (name, landmark) in self.truth:
                continue
            self.n_views[thing] += 1
            landmarks[thing.is_safety].append(landmark)
            self.truth[name, landmark] = thing
            if is_wrong:
                self.wrong.add((name, landmark))
        self.waypoints.append(
            Waypoint(
                name=name,
                pose=pose,
                safety_landmarks=tuple(landmarks[True]),
                functional_landmarks=tuple(landmarks[False]),
            )
        )

    def close(self) -> Memory:
        """Return all that was written down."""
        return Memory(
            places=SemanticMap(waypoints=tuple(self.waypoints)),
            truth=self.truth,
            wrong=frozenset(self.wrong),
            annotated=tuple(self.n_views),
        )

    def _write_down(
        self, pose: Pose, thing: TrueThing, ring: LaserRing | None
    ) -> tuple[Landmark, bool]:
        label = thing.label
        off_rad = wrap_angle(pose.point.bearing_to(thing.point) - pose.yaw_rad)
        bearing_rad = off_rad + self.eye.bearing_noise_rad * self.random.normal()
        range_m = pose.point.distance_to(thing.point)
        range_m *= max(1 + self.eye.range_noise_ratio * self.random.normal(), 0.1)
        is_wrong = bool(self.random.random() < self.eye.wrong_ratio)
        if is_wrong and self.random.random() < 0.5:
            others = sorted({other.label for other in self.site.things} - {label})
            label = others[int(self.random.integers(len(others)))]
        elif is_wrong:
            bearing_rad = self.random.uniform(-HALF_VIEW_RAD, HALF_VIEW_RAD)
            range_m = self.random.uniform(NEAREST_M, FARTHEST_M)
        landmark = Landmark(
            label=label,
            bearing_rad=float(bearing_rad),
            bearing_from=self.eye.bearing_from,
            range_m=float(range_m) if self.has_ranges else None,
            laser=None if ring is None else ring.find_fan(pose, float(bearing_rad)),
        )
        return landmark, is_wrong


def observe(
    site: Site, *, seed: int, has_ranges: bool, laser: Laser | None = None, eye: Eye = NOISY
) -> Memory:
    """Write down two things in three, each from three places.

    What is seen, and how wrongly, is the same with a laser and without.
    """
    random = np.random.default_rng(seed)
    order = [site.things[i] for i in random.permutation(len(site.things)).tolist()]
    annotated = order[: round(len(order) * (1 - NEVER_RATIO))]
    book = _Notebook(site, random, has_ranges, laser, eye, dict.fromkeys(annotated, 0))
    for thing in annotated:
        for pose in _lookouts(site, thing, random):
            if book.n_views[thing] >= N_VIEWS:
                break
            book.look(pose)
    return book.close()


def observe_from(site: Site, poses: Iterable[Pose], *, seed: int) -> Memory:
    """Write down from each place all that is in view there, with ranges."""
    random = np.random.default_rng(seed)
    book = _Notebook(
        site,
        random,
        has_ranges=True,
        laser=None,
        eye=NOISY,
        n_views=dict.fromkeys(site.things, 0),
        most_views=sys.maxsize,
    )
    for pose in poses:
        book.look(pose)
    return book.close()


def _lookouts(site: Site, thing: TrueThing, random: np.random.Generator) -> Iterator[Pose]:
    """Return places from which a thing is in view, roughly ahead."""
    off_m = np.hypot(*(site.places - (thing.point.x, thing.point.y)).T)
    near = np.flatnonzero((off_m >= NEAREST_M) & (off_m <= FARTHEST_M))
    for i in random.permutation(near)[:MOST_TRIES].tolist():
        place = Point(*site.places[i].tolist())
        ahead = place.bearing_to(thing.point) + random.uniform(-0.5, 0.5)
        pose = Pose(place.x, place.y, wrap_angle(float(ahead)))
        if _is_in_view(site, pose, thing):
            yield pose


def _is_in_view(site: Site, pose: Pose, thing: TrueThing) -> bool:
    far_m = pose.point.distance_to(thing.point)
    off_rad = wrap_angle(pose.point.bearing_to(thing.point) - pose.yaw_rad)
    is_ahead = NEAREST_M <= far_m <= FARTHEST_M and abs(off_rad) <= HALF_VIEW_RAD
    return is_ahead and site.sees(pose.point, thing)


def views_of(memory: Memory, thing: TrueThing) -> Sequence[tuple[Waypoint, Landmark]]:
    """Return the records that were made of a thing, wrong ones as well."""
    return [
        (waypoint, landmark)
        for waypoint in memory.places.waypoints
        for landmark in waypoint.landmarks
        if memory.truth[waypoint.name, landmark] is thing
    ]
