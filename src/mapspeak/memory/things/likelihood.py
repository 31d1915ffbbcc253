"""What views say of where their thing is: a likelihood over the cells in sight."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mapspeak.geometry import Pose
from mapspeak.memory.things.labels import find_stance
from mapspeak.memory.things.sight import (
    BODY_M,
    LaserUpdate,
    SightMap,
    bearing_index,
    correct_by_laser,
    find_far_with_another,
    find_farthest_beside,
    find_log_priors,
    look_around,
)
from mapspeak.memory.things.thing import NOISE, Category, Stance
from mapspeak.memory.waypoint import Landmark, Waypoint
from mapspeak.spatial.grid import FloatArray, IntArray

NEAR_M = 2.0
"""Things whose middles are no farther apart may be one."""
LEAST_RATIO = 1.0
"""A view speaks of no place that it does not make likelier than it was."""
HANGING_PER_CELL, STANDING_PER_CELL = 0.015, 0.004
"""Things of one name for each lattice cell where such may be: what hangs on walls about once on
thirteen metres of wall. Chosen in shipped worlds and two drawn ones, by how many views were joined
to another thing, and how many things were found twice."""


_FARTHEST_SIGMAS = 3.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outlook:
    """The lattice cells in sight of a place; arrays of one length but for the one by ray.

    Attributes:
        cells: Flat indices into the lattice, rising.
        angles: Where they are, in the frame of the grid.
        sight: How likely one sees that far: 1, or less behind what one may see over.
        near_m: To the first obstacle, by ray.
    """

    cells: IntArray
    angles: FloatArray
    ranges_m: FloatArray
    sight: FloatArray
    near_m: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ViewLikelihood:
    """The cells that a view speaks of, and how much more likely each is than without it.

    Attributes:
        cells: Flat indices into the lattice, rising.
        update: What the laser knew better than the map, wherever the thing is; None for nothing.
    """

    cells: IntArray
    ratios: FloatArray
    update: LaserUpdate | None = None


def build_outlook(sight: SightMap, pose: Pose, near_m: FloatArray, far_m: FloatArray) -> Outlook:
    """Find the lattice cells in sight of a place.

    Args:
        near_m: How far one sees to the first obstacle, by ray.
    """
    res_m, factor = sight.grid.resolution_m, sight.factor
    row, col = sight.grid.fractional_cells_at(np.array([[pose.x, pose.y]]))[0].tolist()
    reach = (float(far_m.max()) + BODY_M) / res_m
    sizes, places = sight.rows.shape, (row, col)
    low, high = (
        [
            int(np.clip(round_to((at + side) / factor), 0, size))
            for at, size in zip(places, sizes, strict=True)
        ]
        for round_to, side in ((np.floor, -reach), (np.ceil, reach))
    )
    window = (slice(low[0], high[0]), slice(low[1], high[1]))
    down, right = sight.rows[window] - row, sight.cols[window] - col
    ranges_m, angles = np.hypot(down, right) * res_m, np.arctan2(down, right)
    rays = bearing_index(angles)
    # A thing is wider than a slit that one ray alone slips through.
    over_m = np.maximum(find_far_with_another(far_m), near_m)
    is_near, is_over = ranges_m <= near_m[rays] + BODY_M, ranges_m <= over_m[rays] + BODY_M
    is_far = ranges_m <= find_farthest_beside(over_m)[rays] + BODY_M
    seen_beyond = np.where(is_over, NOISE.seen_over_ratio, NOISE.seen_by_edge_ratio)
    rows, cols = np.nonzero(is_far)
    return Outlook(
        cells=(rows + low[0]) * sight.rows.shape[1] + cols + low[1],
        angles=angles[is_far],
        ranges_m=ranges_m[is_far],
        sight=np.where(is_near, 1.0, seen_beyond)[is_far],
        near_m=near_m,
    )


def weigh_view(
    sight: SightMap, outlook: Outlook, pose: Pose, landmark: Landmark
) -> ViewLikelihood | None:
    """Return what a landmark's direction and range say; None where it has neither."""
    if landmark.bearing_rad is None and landmark.range_m is None:
        return None
    cells, ratios, ranges_m = outlook.cells, outlook.sight, outlook.ranges_m
    update = None
    if landmark.bearing_rad is not None:
        ahead = pose.yaw_rad + landmark.bearing_rad - sight.grid.origin.yaw_rad
        off = np.abs(np.remainder(outlook.angles - ahead + math.pi, math.tau) - math.pi)
        sigma = NOISE.bearing_rad_of(landmark)
        # Right before a robot cells are wide, and the middle of none may lie in the direction.
        near = np.flatnonzero(off <= max(_FARTHEST_SIGMAS * sigma, float(off.min(initial=math.pi))))
        bell = np.exp(-0.5 * (off[near] / sigma) ** 2) * (math.sqrt(math.tau) / sigma)
        cells, ratios, ranges_m = cells[near], ratios[near], ranges_m[near]
        if landmark.laser is not None:
            update, ratios = correct_by_laser(
                sight,
                pose,
                landmark.laser,
                near_m=outlook.near_m,
                cells=cells,
                angles=outlook.angles[near],
                ranges_m=ranges_m,
                seen=ratios,
            )
        ratios = ratios * bell
    ratios = ratios * np.exp(-0.5 * (ranges_m / NOISE.named_m) ** 2)
    if landmark.range_m is not None:
        ratios = ratios * _weigh_range(ranges_m, landmark.range_m)
    return ViewLikelihood(cells=cells, ratios=ratios, update=update)


def _weigh_range(ranges_m: FloatArray, told_m: float) -> FloatArray:
    sigma = NOISE.range_m + NOISE.range_ratio * ranges_m
    bell = np.exp(-0.5 * ((told_m - ranges_m) / sigma) ** 2) / (sigma * math.sqrt(math.tau))
    wrong = NOISE.wrong_range_ratio
    return np.asarray((1 - wrong) * bell * NOISE.named_m + wrong, dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WeighedView:
    """One landmark of one waypoint; compared by identity.

    Attributes:
        waypoint: From where it was seen: the standpoint, whose pose is the one it was seen from.
        number: Of the landmark, among those of the standpoint.
        likelihood: Where it may be; None where nothing says.
        stance: Where such things are.
        least_ratio: It speaks of places that it makes so much likelier.
        spoken_of: The cells that it speaks of; where it contradicts the map, all that are near.
    """

    waypoint: Waypoint
    number: int
    landmark: Landmark
    category: Category
    wrong_ratio: float
    likelihood: ViewLikelihood | None
    stance: Stance
    least_ratio: float
    spoken_of: IntArray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surroundings:
    """What is seen of the map from a standpoint of a waypoint, and what was named there.

    Attributes:
        of: The waypoint with all its standpoints.
        pose: Of the standpoint.
        near_m: To the first obstacle, by ray of the grid's frame.
    """

    of: Waypoint
    pose: Pose
    near_m: FloatArray
    far_m: FloatArray
    sightings: tuple[WeighedView, ...]


Seen = Mapping[str, tuple[Surroundings, ...]]
"""What is seen from each standpoint of the waypoints of a name, a waypoint's own pose first."""


def read_waypoints(sight: SightMap, waypoints: Sequence[Waypoint], known: Seen) -> Seen:
    """Return what is seen from everywhere; what is known of an equal waypoint is taken as it is."""
    read: dict[str, tuple[Surroundings, ...]] = {}
    new: list[tuple[Waypoint, Waypoint]] = []
    for waypoint in waypoints:
        kept = known.get(waypoint.name, ())
        if len(kept) != 1 or kept[0].of is not waypoint:
            # The present one is held, so that the next time it is the very same.
            kept = tuple(
                each if each.of is waypoint else replace(each, of=waypoint)
                for each in kept
                if each.of is waypoint or each.of == waypoint
            )
        read[waypoint.name] = (*read[waypoint.name], *kept) if waypoint.name in read else kept
        new += () if kept else ((waypoint, stand) for stand in waypoint.standpoints)
    near_m, far_m = look_around(sight, [stand.pose for _, stand in new])
    for (waypoint, stand), near, far in zip(new, near_m, far_m, strict=True):
        read[waypoint.name] += (_read(sight, waypoint, stand, near, far),)
    return read


def _read(
    sight: SightMap, of: Waypoint, waypoint: Waypoint, near_m: FloatArray, far_m: FloatArray
) -> Surroundings:
    outlook = build_outlook(sight, waypoint.pose, near_m, far_m)
    sorted_in = (
        (Category.SAFETY, waypoint.safety_landmarks),
        (Category.FUNCTIONAL, waypoint.functional_landmarks),
    )
    sightings: list[WeighedView] = []
    for category, landmarks in sorted_in:
        for landmark in landmarks:
            likelihood = weigh_view(sight, outlook, waypoint.pose, landmark)
            if likelihood is not None and not likelihood.ratios.any():
                likelihood = None
            stance = find_stance(landmark.label)
            least_ratio = _least_ratio(sight, likelihood, stance)
            sightings.append(
                WeighedView(
                    waypoint=waypoint,
                    number=len(sightings),
                    landmark=landmark,
                    category=category,
                    wrong_ratio=NOISE.wrong_ratio_of(landmark.confidence),
                    likelihood=likelihood,
                    stance=stance,
                    least_ratio=least_ratio,
                    spoken_of=_find_spoken_of(sight, likelihood, least_ratio),
                )
            )
    return Surroundings(
        of=of, pose=waypoint.pose, near_m=near_m, far_m=far_m, sightings=tuple(sightings)
    )


def _least_ratio(sight: SightMap, likelihood: ViewLikelihood | None, stance: Stance) -> float:
    """Return how much likelier than by chance a thing has to make a view, to be what it shows.

    Else a thing of its own explains the view better (Bayes), of which so many are on each metre.
    """
    if likelihood is None:
        return LEAST_RATIO
    log_priors = find_log_priors(sight, likelihood.cells, (likelihood.update,), stance)
    per_cell = HANGING_PER_CELL if stance is Stance.ON_WALL else STANDING_PER_CELL
    return max(LEAST_RATIO, per_cell * float(np.exp(log_priors) @ likelihood.ratios))


def _find_spoken_of(
    sight: SightMap, likelihood: ViewLikelihood | None, least_ratio: float
) -> IntArray:
    """Return the cells that a view speaks of, rising; its thing is elsewhere if it is wrong."""
    if likelihood is None:
        return np.empty(0, dtype=np.intp)
    is_likely = likelihood.ratios >= least_ratio
    if is_likely.any():
        return likelihood.cells[is_likely]
    # It contradicts the map, and may be an error about what is near.
    rows, cols = sight.rows.ravel(), sight.cols.ravel()
    weights = likelihood.ratios / likelihood.ratios.sum()
    middle = weights @ rows[likelihood.cells], weights @ cols[likelihood.cells]
    off = np.hypot(rows - middle[0], cols - middle[1])
    return np.flatnonzero(off * sight.grid.resolution_m <= NEAR_M)
