"""Kept pictures that no remembered place tells of."""

from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np

from mapspeak.geometry import Pose
from mapspeak.memory import SAME_SPOT_M, SAME_VIEW_RAD, SemanticMap, Waypoint
from mapspeak.memory.episodes.observation import (
    EpisodeMatch,
    EpisodePage,
    EpisodeQuery,
    ObservationKind,
)

MOST_SEARCHED = 500
"""Older pictures are not looked through."""


@dataclass(frozen=True, slots=True, kw_only=True)
class UndescribedPicture:
    """A kept picture of which nothing was written.

    Attributes:
        match: The observation, with its pose on the robot's map.
        beside: The name of a place that is remembered from the same spot, looking elsewhere.
    """

    match: EpisodeMatch
    beside: str | None


def find_undescribed(
    find: Callable[[EpisodeQuery], EpisodePage], memory: SemanticMap, *, named: Collection[str]
) -> tuple[UndescribedPicture, ...]:
    """Return the pictures that no place names or shows from there, the newest first.

    Of several pictures with one view the newest counts.

    Args:
        find: Finds observations, placed on the robot's map.
        memory: The remembered places, in the frame of that map.
        named: The pictures that records name.
    """
    page = find(EpisodeQuery(kind=ObservationKind.PICTURE, limit=MOST_SEARCHED))
    stands = _Stands(memory)
    found, views = list[UndescribedPicture](), list[Pose]()
    for match in page.matches:
        seen = match.observation
        if match.is_elsewhere or seen.picture is None or seen.picture in named:
            continue
        beside = stands.find_at(seen.pose)
        alike = (*views, *(pose for _, pose in beside))
        if any(p.is_near(seen.pose, off_m=SAME_SPOT_M, turn_rad=SAME_VIEW_RAD) for p in alike):
            continue
        views.append(seen.pose)
        name = next((place.name for place, _ in beside), None)
        found.append(UndescribedPicture(match=match, beside=name))
    return tuple(found)


class _Stands:
    """The poses that remembered places were observed from."""

    def __init__(self, memory: SemanticMap) -> None:
        self._stands = [(p, stand.pose) for p in memory.waypoints for stand in p.standpoints]
        self._at = np.array([(pose.x, pose.y) for _, pose in self._stands]).reshape(-1, 2)

    def find_at(self, pose: Pose) -> list[tuple[Waypoint, Pose]]:
        away_m = np.hypot(*(self._at - (pose.x, pose.y)).T)
        return [self._stands[i] for i in np.flatnonzero(away_m <= SAME_SPOT_M).tolist()]
