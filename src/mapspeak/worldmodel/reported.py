"""Things that are not written down: the robot's detector reported them in pictures.

A picture with what is reported in it is a look with landmarks, and is joined with others by what
joins the looks that are remembered. Nothing of it is kept longer than the pictures.
"""

import threading
from collections.abc import Iterable, Iterator, Sequence

from mapspeak.geometry import Point
from mapspeak.memory import Landmark, SemanticMap, TakenPicture, Waypoint, find_concern
from mapspeak.memory.pictures import PictureReading
from mapspeak.memory.things.finding import Things, find_things
from mapspeak.memory.things.labels import group_names, name_the_same
from mapspeak.memory.things.likelihood import Seen
from mapspeak.memory.things.thing import Thing
from mapspeak.spatial import OccupancyGrid
from mapspeak.worldmodel.labelindex import LabelIndex
from mapspeak.worldmodel.remembered import RememberedThing

MOST_PICTURES = 200
"""Of more pictures of one name the latest are joined."""
APART_M = 1.5
"""What is reported nearer to a thing of its name may be another side of it."""

NOISE_M, NOISE_RATIO = 0.5, 0.2
"""What one picture alone shows is no better known; what the map puts elsewhere, it contradicts."""


def list_reported(pictures: Iterable[TakenPicture]) -> tuple[str, ...]:
    """Return the labels that the detector reported, each once, without those left out of memory."""
    labels = dict.fromkeys(each.label for taken in pictures for each in taken.readings)
    return tuple(label for label in labels if find_concern(label) is None)


class ReportJoiner:
    """Joins what the detector reported into things, and keeps them until pictures or map change.

    Attributes:
        index: Finds labels by words.
    """

    def __init__(self) -> None:
        self.index = LabelIndex()
        self._lock = threading.Lock()
        self._joined: dict[frozenset[str], tuple[Things, tuple[RememberedThing, ...]]] = {}

    def join(
        self,
        labels: Iterable[str],
        pictures: Sequence[TakenPicture],
        grid: OccupancyGrid,
        *,
        sight_of: Things,
    ) -> tuple[RememberedThing, ...]:
        """Return the things of some labels, and of others of their names, that have a place.

        Args:
            labels: Of those that were reported.
            pictures: All that count, the oldest first.
            sight_of: Things found on the same map, whose lines of sight serve here as well.
        """
        if not (wanted := set(labels)):
            return ()
        groups = [names for names in group_names(list_reported(pictures)) if names & wanted]
        with self._lock:
            return tuple(
                each
                for names in sorted(groups, key=min)
                for each in self._join(names, pictures, grid, sight_of)
                if any(name_the_same(each.thing.label, label) for label in wanted)
            )

    def _join(
        self,
        names: frozenset[str],
        pictures: Sequence[TakenPicture],
        grid: OccupancyGrid,
        sight_of: Things,
    ) -> tuple[RememberedThing, ...]:
        key = next((each for each in self._joined if each & names), names)
        before, known = self._joined.pop(key, (None, ()))
        if before is None or before.sight is not sight_of.sight:
            before = Things(things=(), sight=sight_of.sight, seen={}, of_label={}, pools={})
        looks = tuple(_looks(names, pictures, before.seen if key == names else {}))
        found = find_things(SemanticMap(waypoints=looks[-MOST_PICTURES:]), grid, earlier=before)
        by_thing = {id(each.thing): each for each in known}
        things = tuple(
            by_thing.get(id(each)) or RememberedThing(id=_id_of(each), thing=each, is_reported=True)
            for each in _pick_apart(found.things)
        )
        self._joined[names] = found, things
        return things


def _pick_apart(things: Iterable[Thing]) -> Iterator[Thing]:
    """Yield things whose place is told, each the one with most views of all that are near to it."""
    picked: list[tuple[Point, str]] = []
    for each in sorted(things, key=lambda thing: -thing.n_agreeing):
        at, label = each.position, each.label
        if at is None or not _is_told(each):
            continue
        alone_m = 0.0 if each.n_agreeing else NOISE_RATIO * (each.supporting[0].far_m or 0.0)
        apart_m = APART_M + alone_m
        near = (other for place, other in picked if at.distance_to(place) < apart_m)
        if not any(name_the_same(label, other) for other in near):
            picked.append((at, label))
            yield each


def _is_told(thing: Thing) -> bool:
    """Return True where views agree on a place, or one alone is not at odds with the map."""
    if thing.n_agreeing:
        return True
    first, *others = thing.supporting
    told_m, far_m = first.landmark.range_m, first.far_m or 0.0
    is_as_told = told_m is None or abs(far_m - told_m) <= NOISE_M + NOISE_RATIO * told_m
    return not others and is_as_told


def _id_of(thing: Thing) -> str:
    at = thing.position
    return "" if at is None else f"({at.x:.2f}, {at.y:.2f})"


def _looks(
    names: frozenset[str], pictures: Iterable[TakenPicture], known: Seen
) -> Iterator[Waypoint]:
    """Yield pictures as looks that show things of some names; those known are the very same."""
    for taken in pictures:
        if taken.id in known:
            yield known[taken.id][0].of
        elif seen := tuple(each for each in taken.readings if each.label in names):
            yield Waypoint(
                name=taken.id,
                pose=taken.pose,
                functional_landmarks=tuple(_landmark(taken, each) for each in seen),
                stamp_s=taken.stamp_s,
                recorded_at=taken.recorded_at,
                picture=taken.name,
            )


def _landmark(taken: TakenPicture, reading: PictureReading) -> Landmark:
    return Landmark(
        label=reading.label,
        bearing_rad=reading.bearing_rad,
        range_m=reading.range_m,
        range_from=None if reading.range_m is None else reading.source,
        bearing_from=reading.source,
        laser=None
        if taken.laser is None
        else taken.laser.find_fan(taken.pose, reading.bearing_rad),
    )
