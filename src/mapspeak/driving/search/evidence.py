"""What speaks for a thing being at a place: things around it, earlier pictures, the model."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from mapspeak.geometry import Point, Pose
from mapspeak.memory import SemanticMap, TakenPicture
from mapspeak.memory.search.answer import Entry, EntryKind
from mapspeak.memory.search.index import EntryIndex

LEAST_SAID_RATIO = 0.25
"""Words refer to the thing from this similarity on.

Little, since what a detector reports is shown before anybody relies on it.
"""


def speaks_of(words: str, thing: str) -> bool:
    """Return True when words, such as a detector's label, name a thing.

    By the rules of the memory.
    """
    named = Entry(id=words, kind=EntryKind.PLACE, name=words)
    answer = EntryIndex([named]).find(thing)
    return bool(answer.find_speaking(least_said_ratio=LEAST_SAID_RATIO))


KITCHEN = (
    *("kitchen", "break room", "fridge", "refrigerator", "freezer", "oven", "stove", "microwave"),
    *("dishwasher", "kettle", "toaster", "coffee machine", "coffee maker", "sink"),
)
BATHROOM = ("bathroom", "restroom", "toilet", "urinal", "shower", "bathtub", "towel", "sink")
OFFICE = (
    *("office", "desk", "computer", "laptop", "monitor", "keyboard", "printer", "copier"),
    *("whiteboard", "filing cabinet"),
)
LIVING_ROOM = ("living room", "lounge", "sofa", "couch", "armchair", "television", "coffee table")
BEDROOM = ("bedroom", "bed", "mattress", "pillow", "wardrobe", "nightstand")
STORE = ("warehouse", "pallet", "crate", "forklift", "loaded shelf")
ROOMS = (KITCHEN, BATHROOM, OFFICE, LIVING_ROOM, BEDROOM, STORE)
AMONG_ITS_LIKE = 0.8
"""The score of a place where something stands that belongs to the same room."""
AMONG_STRANGERS = 0.3
"""The score of a place where something stands that belongs to another one."""

_PATTERNS = tuple(
    re.compile(rf"\b(?:{'|'.join(words)})(?:s|es)?\b", re.IGNORECASE) for words in ROOMS
)


def find_context_score(words: str, thing: str) -> float | None:
    """Find how likely a thing is near what words name, from 0 to 1; None if unknown."""
    named, wanted = _rooms_of(words), _rooms_of(thing)
    if not named or not wanted:
        return None
    shared_ratio = len(named & wanted) / len(named)
    return AMONG_STRANGERS + (AMONG_ITS_LIKE - AMONG_STRANGERS) * shared_ratio


def _rooms_of(words: str) -> frozenset[int]:
    """Return the rooms that things of some words belong to, by their numbers."""
    return frozenset(index for index, room in enumerate(_PATTERNS) if room.search(words))


MOST_REPORTS = 4
APART_M = 1.0
"""Reports from nearer to each other are one place to look again from."""

Look = tuple[Pose, float | None]
"""Where the camera was, in the map frame, and its opening."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Earlier:
    """What is known of a thing from pictures before a search.

    Attributes:
        looks: Those that count as looked at, and did not show it.
        reporting: Those in which the robot's detector reported it, the latest first, one a place.
        n_reporting: How many there are in all.
        n_unread: How many say nothing, because no model has described them.
    """

    looks: tuple[Look, ...] = ()
    reporting: tuple[TakenPicture, ...] = ()
    n_reporting: int = 0
    n_unread: int = 0


def read_earlier(
    pictures: Iterable[TakenPicture], thing: str, *, judged: Sequence[Look] = ()
) -> Earlier:
    """Return what pictures from before a search say about a thing.

    Args:
        pictures: The oldest first.
        judged: Looks of an earlier search for the same thing, in which a model saw none; they
            count while their pictures do, and so on the same map alone.
    """
    taken = list(pictures)
    shown = {(each.pose, each.horizontal_fov_rad) for each in taken}
    read = [each for each in taken if each.reported is not None]
    labels = {label for each in read for label in each.reported or ()}
    speaking = {label for label in labels if speaks_of(label, thing)}
    found = [each for each in read if speaking.intersection(each.reported or ())]
    none = [each for each in read if each not in found]
    looks = dict.fromkeys((each.pose, each.horizontal_fov_rad) for each in none)
    looks |= dict.fromkeys(each for each in judged if each in shown)
    unread = (each for each in taken if each.reported is None)
    return Earlier(
        looks=tuple(looks),
        reporting=_apart(found[::-1]),
        n_reporting=len(found),
        n_unread=sum((each.pose, each.horizontal_fov_rad) not in looks for each in unread),
    )


def leave_out_shown(
    pictures: Iterable[TakenPicture], memory: SemanticMap, thing: str
) -> tuple[TakenPicture, ...]:
    """Return the pictures except those in which the thing was seen and noted.

    The detector may have had no word for it; where it was seen, the memory says.
    """
    labels = {each.label for place in memory.waypoints for each in place.landmarks}
    speaking = {label for label in labels if speaks_of(label, thing)}
    shown = {
        place.dated(each).picture
        for place in memory.waypoints
        for each in place.landmarks
        if each.label in speaking
    }
    return tuple(each for each in pictures if each.name not in shown)


def _apart(pictures: Iterable[TakenPicture]) -> tuple[TakenPicture, ...]:
    chosen: list[TakenPicture] = []
    for picture in pictures:
        point = picture.pose.point
        if all(point.distance_to(each.pose.point) > APART_M for each in chosen):
            chosen.append(picture)
    return tuple(chosen[:MOST_REPORTS])


NEUTRAL = 0.5
"""The score of a place without any opinion."""
STRENGTH = 4.0
"""How many times more a place that surely has the thing weighs than a neutral one."""
REACH_M = 5.0
"""A view says something about what lies this near to the middle of it."""
VIEW_STRENGTH = 2.0
"""The weight of the model's opinion of a view against the neutral prior."""
CONTEXT_STRENGTH = 1.0
"""The weight of what stands at a place: less, because it was not noted with the thing in mind."""
CONTEXT_APART_M = 1.5
"""The same score this near to an earlier one is of the same thing."""


@dataclass(frozen=True, slots=True)
class _ViewOpinion:
    point: Point
    score: float
    strength: float


class Opinions:
    """Scores between 0 (surely not there) and 1 (surely there)."""

    def __init__(self) -> None:
        self._by_id: dict[str, float] = {}
        self._views: list[_ViewOpinion] = []

    @property
    def speaks_of_rooms(self) -> bool:
        """True when a room, corridor or open space has a score."""
        return any(key.startswith(("R", "C", "O")) for key in self._by_id)

    def add_scores(self, scores: Mapping[str, float]) -> None:
        """Take in scores of places by their ids; newer ones replace older ones."""
        self._by_id |= {key.strip().upper(): score for key, score in scores.items()}

    def add_view(self, point: Point, score: float) -> None:
        """Take in how likely the thing is near what a picture showed."""
        self._views.append(_ViewOpinion(point, score, VIEW_STRENGTH))

    def add_context(self, point: Point, score: float) -> bool:
        """Take in how likely the thing is near another one; return False where that is no news."""
        for known in self._views:
            is_alike = known.strength == CONTEXT_STRENGTH and known.score == score
            if is_alike and known.point.distance_to(point) <= CONTEXT_APART_M:
                return False
        self._views.append(_ViewOpinion(point, score, CONTEXT_STRENGTH))
        return True

    def score_at(self, point: Point, *, ids: tuple[str, ...]) -> float:
        """Return the score of a place: by its own id, its room's id, else by views near it."""
        for place_id in ids:
            if place_id in self._by_id:
                return self._by_id[place_id]
        total, n = NEUTRAL, 1.0
        for view in self._views:
            nearness = max(1.0 - view.point.distance_to(point) / REACH_M, 0.0)
            weight = view.strength * nearness
            total, n = total + weight * view.score, n + weight
        return total / n


def weight_of(score: float) -> float:
    """Return by how much a score makes a place more worth a look, 1 for a neutral one."""
    return math.pow(STRENGTH, 2 * score - 1)
