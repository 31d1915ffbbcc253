"""Remembered places and things under ids that stay while these do, and how far to trust them."""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import chain, repeat

from mapspeak.geometry import Point
from mapspeak.memory import Waypoint, name_key
from mapspeak.memory.consistency.checking import MemoryCheck
from mapspeak.memory.consistency.findings import MemoryFinding, Trust, judge_trust
from mapspeak.memory.things.labels import name_the_same
from mapspeak.memory.things.thing import Thing
from mapspeak.spatial.rooms.identity import match_best_first
from mapspeak.worldmodel.thingids import ThingIds, ViewKeys

SAME_THING_M = 1.0
"""A thing of the same name within this distance of an earlier one is that one, seen better."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, weakref_slot=True)
class RememberedPlace:
    """A waypoint under its id, "W1" for the first in the file; compared by identity."""

    id: str
    waypoint: Waypoint


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, weakref_slot=True)
class RememberedThing:
    """A thing that was seen from remembered places; compared by identity.

    Attributes:
        id: "T1"; it stays while the thing does.
        is_reported: It was not written down: the robot's detector alone reported it in pictures.
            Its id is its place, as "(1.20, -3.40)", and its views name the pictures.
    """

    id: str
    thing: Thing
    is_reported: bool = False

    @property
    def point(self) -> Point:
        """Where it is; of one without a position, where it was seen from."""
        return self.thing.position or self.thing.supporting[0].place


Remembered = RememberedPlace | RememberedThing


def number_places(
    waypoints: Sequence[Waypoint], earlier: Sequence[RememberedPlace] = ()
) -> tuple[RememberedPlace, ...]:
    """Return waypoints as remembered places with ids, in the order of the file.

    Args:
        earlier: Those of before, which are kept where they are the same.
    """
    return tuple(
        before
        if before is not None and before.waypoint is waypoint
        else RememberedPlace(id=_place_id(number), waypoint=waypoint)
        for number, (waypoint, before) in enumerate(
            zip(waypoints, chain(earlier, repeat(None)), strict=False)
        )
    )


def find_place_id(waypoints: Sequence[Waypoint], name: str) -> str:
    """Return the id of the place of a name; of exactly that name if there is one."""
    # Keys of names cost much, and hardly ever are they needed.
    exact = (number for number, each in enumerate(waypoints) if each.name == name)
    alike = (n for n, each in enumerate(waypoints) if name_key(each.name) == name_key(name))
    return _place_id(next(chain(exact, alike)))


def _place_id(number: int) -> str:
    return f"W{number + 1}"


def number_things(
    things: Sequence[Thing], earlier: Sequence[RememberedThing], ids: ThingIds, keys: ViewKeys
) -> tuple[RememberedThing, ...]:
    """Return things under the ids that their views bear, and new things under new ones.

    A thing has the id that most of its views bear; of two that would have one id, it stays with the
    one that has more of the views. A thing that is gone leaves its id unused.

    Args:
        earlier: The things of before, in this session.

    Returns:
        The things in the order of their ids.
    """
    # By identity first: that is most of them, and to compare them as values is slow.
    present, known = set(map(id, things)), {id(each.thing) for each in earlier}
    left = {each.thing: each for each in earlier if id(each.thing) not in present}
    new = [thing for thing in things if id(thing) not in known]
    named: dict[str, RememberedThing | None] = {each.id: each for each in earlier}
    if left:
        same = {id(thing): left.pop(thing) for thing in new if thing in left}
        named |= {same[id(t)].id: replace(same[id(t)], thing=t) for t in new if id(t) in same}
        new = [thing for thing in new if id(thing) not in same]
    named |= dict.fromkeys(each.id for each in left.values())
    if new:
        taken = {_number_of(id_) for id_, each in named.items() if each is not None}
        for number, thing in zip(_give_numbers(new, left, taken, ids, keys), new, strict=True):
            named[f"T{number}"] = RememberedThing(id=f"T{number}", thing=thing)
    things_left = (each for each in named.values() if each is not None)
    return tuple(sorted(things_left, key=lambda each: _number_of(each.id)))


def _number_of(thing_id: str) -> int:
    return int(thing_id.removeprefix("T"))


def _give_numbers(
    new: Sequence[Thing],
    left: Mapping[Thing, RememberedThing],
    taken: Collection[int],
    ids: ThingIds,
    keys: ViewKeys,
) -> list[int]:
    """Return the number of each new thing: what its views bear, else that of a thing it continues.

    Args:
        left: Things of before that are there no longer as they were.
        taken: The numbers of all other things.
    """
    views = [keys.of(thing) for thing in new]
    with ids.giving() as given:
        borne = [Counter(ids.numbers.get(key) for key in each) for each in views]
        found = match_best_first(
            # Most views first, then least of other things.
            ((-n_shared, counts.total() - n_shared, old), old, number)
            for number, counts in enumerate(borne)
            for old, n_shared in counts.items()
            if old is not None and old not in taken
        )
        claimed = {*taken, *found.values()}
        found |= match_best_first(
            ((rank, number), old, number)
            for number, thing in enumerate(new)
            if number not in found
            for former, each in left.items()
            if (old := _number_of(each.id)) not in claimed
            and (rank := _sameness(thing, former)) is not None
        )
        numbers = [found[n] if n in found else ids.new() for n in range(len(new))]
        for number, counts, each in zip(numbers, borne, views, strict=True):
            # Views of a thing that has parted bear its own number from now on.
            is_known = number in counts
            given |= {key: number for key in each if not is_known or key not in ids.numbers}
    return numbers


def _sameness(thing: Thing, before: Thing) -> tuple[int, float] | None:
    """Rank how surely one thing is another that was known before; None for another thing."""
    if not name_the_same(thing.label, before.label):
        return None
    n_shared = len(_views_of(thing) & _views_of(before))
    if thing.position is None or before.position is None:
        return (-n_shared, 0.0) if n_shared else None
    away_m = thing.position.distance_to(before.position)
    return (-n_shared, away_m) if n_shared or away_m <= SAME_THING_M else None


def _views_of(thing: Thing) -> set[tuple[str, str]]:
    return {(view.waypoint, view.landmark.label) for view in thing.supporting}


class Judge:
    """Says how far each remembered place and thing may be trusted.

    Args:
        check: Finds what speaks against them.
    """

    def __init__(self, check: MemoryCheck) -> None:
        self._check = check

    @property
    def findings(self) -> tuple[MemoryFinding, ...]:
        """All that is odd about the memory."""
        return self._check.findings

    def judge_thing(self, remembered: RememberedThing, *, now: datetime | None) -> Trust:
        """Return the trust that a thing deserves at a moment; without one its age is no matter."""
        thing = remembered.thing
        against = () if remembered.is_reported else self._check.find_of_thing(thing)
        return judge_trust(thing, against, now=now)

    def judge_place(self, place: RememberedPlace) -> Trust:
        """Return the trust that a record deserves: it is sure until something speaks against it."""
        ratio, against = 1.0, []
        for finding in self._check.find_of_place(place.waypoint):
            if finding.label is None and finding.weight < 1.0:
                ratio *= finding.weight
                against.append(finding)
        return Trust(ratio, tuple(against))
