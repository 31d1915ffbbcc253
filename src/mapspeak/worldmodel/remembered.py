"""Remembered places and things under ids that stay while these do, and how far to trust them."""

from collections.abc import Sequence
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
    things: Sequence[Thing], earlier: Sequence[RememberedThing], *, n_named: int
) -> tuple[tuple[RememberedThing, ...], int]:
    """Return things under the ids that they had before, and new things under new ones.

    Args:
        n_named: How many ids were ever given; a thing that is gone leaves its id unused.

    Returns:
        The things in the order of their ids, and how many ids were ever given.
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
    seen_better = match_best_first(
        ((rank, number), each.id, number)
        for number, thing in enumerate(new)
        for each in left.values()
        if (rank := _sameness(thing, each.thing)) is not None
    )
    for number, thing in enumerate(new):
        if number not in seen_better:
            n_named += 1
        id_ = seen_better.get(number, f"T{n_named}")
        named[id_] = RememberedThing(id=id_, thing=thing)
    return tuple(each for each in named.values() if each is not None), n_named


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
