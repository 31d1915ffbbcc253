"""A landmark of a waypoint, made ready for joining: seen from where, and what it says of where."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mapspeak.semantic.things.likelihood import ViewLikelihood, build_outlook, weigh_view
from mapspeak.semantic.things.sight import SightMap, look_around
from mapspeak.semantic.things.spots import Spot, find_spot
from mapspeak.semantic.things.thing import Category
from mapspeak.semantic.waypoint import Landmark, Waypoint
from mapspeak.spatial.grid import FloatArray

__all__ = ["Sighting", "Surroundings", "read_waypoints"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sighting:
    """One landmark of one waypoint; compared by identity.

    Attributes:
        waypoint: From where it was seen: the standpoint, whose pose is the one it was seen from.
        landmark: What was seen.
        category: What it is filed under.
        wrong_ratio: How likely it is wrong as a whole.
        likelihood: Where it may be; None where nothing says.
        spot: Where its direction and range together say that it is; None without both.
    """

    waypoint: Waypoint
    landmark: Landmark
    category: Category
    wrong_ratio: float
    likelihood: ViewLikelihood | None
    spot: Spot | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surroundings:
    """What a waypoint sees of the map, and its sightings.

    Attributes:
        near_m: To the first obstacle, by ray of the grid's frame.
        far_m: To the first wall.
        sightings: Of all its landmarks; none where its standpoints have them.
    """

    near_m: FloatArray
    far_m: FloatArray
    sightings: tuple[Sighting, ...]


def read_waypoints(
    sight: SightMap, waypoints: Sequence[Waypoint], known: Mapping[Waypoint, Surroundings]
) -> dict[Waypoint, Surroundings]:
    """Gives what every waypoint sees, and what was seen from each of its standpoints.

    What is known of an equal one is taken as it is.
    """
    stands = [stand for waypoint in waypoints for stand in waypoint.standpoints]
    every = dict.fromkeys((*waypoints, *stands))
    new = [waypoint for waypoint in every if waypoint not in known]
    near_m, far_m = look_around(sight, [waypoint.pose for waypoint in new])
    read = {
        waypoint: _read(sight, waypoint, near, far)
        for waypoint, near, far in zip(new, near_m, far_m, strict=True)
    }
    return {waypoint: known.get(waypoint) or read[waypoint] for waypoint in every}


def _read(
    sight: SightMap, waypoint: Waypoint, near_m: FloatArray, far_m: FloatArray
) -> Surroundings:
    if waypoint.standpoints != (waypoint,):
        return Surroundings(near_m=near_m, far_m=far_m, sightings=())
    outlook = build_outlook(sight, waypoint.pose, near_m, far_m)
    sorted_in = (
        (Category.SAFETY, waypoint.safety_landmarks),
        (Category.FUNCTIONAL, waypoint.functional_landmarks),
    )
    sightings = []
    for category, landmarks in sorted_in:
        for landmark in landmarks:
            likelihood = weigh_view(sight, outlook, waypoint.pose, landmark)
            sightings.append(
                Sighting(
                    waypoint=waypoint,
                    landmark=landmark,
                    category=category,
                    wrong_ratio=sight.noise.wrong_ratio_of(landmark.confidence),
                    likelihood=likelihood if likelihood and np.any(likelihood.ratios) else None,
                    spot=find_spot(waypoint.pose, landmark, sight.noise),
                )
            )
    return Surroundings(near_m=near_m, far_m=far_m, sightings=tuple(sightings))
