"""How a search stands, as a value."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from mapspeak.driving.exploration.blocked import BlockedPlace, TripEnd
from mapspeak.driving.search.candidates import SearchCandidate
from mapspeak.driving.search.evidence import Earlier
from mapspeak.geometry import Pose
from mapspeak.robot import PoseDoubt
from mapspeak.worldmodel.model import WorldModel


class SearchState(StrEnum):
    """How a search stands; the first three go on with the next call."""

    DRIVING = "driving"
    LOOK = "look"
    REPORTED = "reported"
    FOUND = "found"
    NOT_FOUND = "not_found"
    BUDGET_SPENT = "budget_spent"
    INTERRUPTED = "interrupted"

    @property
    def is_end(self) -> bool:
        """True when the next call begins a new search."""
        return self not in (SearchState.DRIVING, SearchState.LOOK, SearchState.REPORTED)

    @property
    def shows_picture(self) -> bool:
        """True when the caller should judge what the camera sees."""
        return self in (SearchState.LOOK, SearchState.REPORTED)


class BudgetKind(StrEnum):
    """What a budget limits."""

    LOOKS = "looks"
    METRES = "metres"


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """What a search may cost."""

    n_looks: int | None = None
    driven_m: float | None = None


@dataclass(frozen=True, slots=True)
class SeenRegion:
    """A room or corridor, and how much of its floor the camera has looked at."""

    id: str
    seen_ratio: float


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SearchProgress:
    """How a search stands.

    Attributes:
        spent: The part of the budget that is spent, if one is.
        label: What the robot's detector reports here; None where it reports nothing.
        trip_end: What interrupted it; None where that is not known.
        earlier: The pictures it begins from, in its first answer only.
        looks_anew: What only earlier pictures showed is looked at again, from this answer on.
        n_earlier: Pictures from before that count as looked at.
        here: What the robot looks at now, or is on the way to; None for neither.
        next: What comes after that, best first.
        regions: What the camera has seen of each room and corridor, in the end; none before.
        pose_doubt: Why it may be elsewhere.
    """

    state: SearchState
    budget: Budget
    spent: BudgetKind | None
    label: str | None
    trip_end: TripEnd | None
    earlier: Earlier | None
    looks_anew: bool
    thing: str
    n_looks: int
    n_earlier: int
    driven_m: float
    here: SearchCandidate | None
    goal_id: str | None
    next: tuple[SearchCandidate, ...]
    regions: tuple[SeenRegion, ...]
    seen_ratio: float
    blocked: tuple[BlockedPlace, ...]
    pose: Pose
    pose_doubt: PoseDoubt | None


def find_seen_regions(world: WorldModel, seen: NDArray[np.bool_]) -> tuple[SeenRegion, ...]:
    """Return how much of each room and corridor was looked at, by a mask of the map's cells."""
    labels = world.rooms.labels
    n_all = np.bincount(labels[world.grid.free])
    n_seen = np.bincount(labels[seen], minlength=n_all.size)
    return tuple(
        SeenRegion(region.id, float(n_seen[region.index] / max(n_all[region.index], 1)))
        for region in world.rooms.regions
        if region.index < n_all.size
    )
