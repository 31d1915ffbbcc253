"""How far each remembered place and thing may be trusted, by all that is odd about the memory."""

from collections import defaultdict
from collections.abc import Iterable

from mapspeak.memory.consistency import MemoryFinding, Trust, judge_trust
from mapspeak.worldmodel.recollection import RememberedPlace, RememberedThing


class Judge:
    """Findings, sorted by what they are about.

    Args:
        findings: All of a memory's.

    Attributes:
        findings: The same, in their order.
    """

    def __init__(self, findings: Iterable[MemoryFinding]) -> None:
        self.findings = tuple(findings)
        # By identity: findings hold the very things, and comparing those as values is slow.
        self._of_thing: dict[int, list[int]] = defaultdict(list)
        self._of_waypoint: dict[str, list[int]] = defaultdict(list)
        for number, finding in enumerate(self.findings):
            for thing in finding.things:
                self._of_thing[id(thing)].append(number)
            for name in () if finding.things else finding.waypoints:
                self._of_waypoint[name].append(number)

    def judge_thing(self, remembered: RememberedThing) -> Trust:
        """Return the trust that a thing deserves."""
        thing = remembered.thing
        numbers = set(self._of_thing.get(id(thing), ()))
        for name in thing.waypoints:
            numbers.update(self._of_waypoint.get(name, ()))
        return judge_trust(thing, [self.findings[number] for number in sorted(numbers)])

    def judge_place(self, place: RememberedPlace) -> Trust:
        """Return the trust that a record deserves: it is sure until something speaks against it."""
        ratio, against = 1.0, []
        for number in self._of_waypoint.get(place.waypoint.name, ()):
            finding = self.findings[number]
            if finding.label is None and finding.weight < 1.0:
                ratio *= finding.weight
                against.append(finding)
        return Trust(ratio, tuple(against))
