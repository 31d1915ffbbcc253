"""How far remembered places and things may be trusted."""

from datetime import datetime

from mapspeak.memory.consistency.checking import MemoryCheck
from mapspeak.memory.consistency.findings import MemoryFinding, Trust, judge_trust
from mapspeak.worldmodel.remembered import RememberedPlace, RememberedThing


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
