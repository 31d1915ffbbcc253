"""The number that each view of a thing bears, kept beside the memory: ids outlast the session.

A view is told by its record, whatever map it is on, and keeps the number of the thing that it was
first taken for. So a thing that is joined of other views on another map is known again by them.
"""

import contextlib
import fcntl
import json
import os
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from io import FileIO
from pathlib import Path

from mapspeak.memory import Landmark, Waypoint, name_key
from mapspeak.memory.things.thing import Thing, View

IDS_FILE = "things.ids"
LARGEST = 10**8
"""A larger number in the log is no work of ours, and its id would be none that is read."""

ViewKey = tuple[str, str, float | None, float | None, int]
"""The `name_key` of the place, label, bearing and range; and the number among its equals there."""


class ViewKeys:
    """What tells each view of a memory from all others.

    Args:
        places: By their names.
    """

    def __init__(self, places: Iterable[Waypoint]) -> None:
        self._places = {place.name: place for place in places}
        self._known: dict[str, dict[int, ViewKey]] = {}

    def of(self, thing: Thing) -> list[ViewKey]:
        """Return the keys of all views of a thing."""
        return [self._of_view(each) for each in thing.supporting]

    def _of_view(self, view: View) -> ViewKey:
        known = self._of_place(view.waypoint).get(id(view.landmark))
        # Views that were kept in an earlier session are no parts of this very memory.
        return known or _first_key(name_key(view.waypoint), view.landmark)

    def _of_place(self, name: str) -> Mapping[int, ViewKey]:
        if name not in self._known:
            place_key, n_equal = name_key(name), Counter[ViewKey]()
            self._known[name] = keys = {}
            for each in self._places[name].landmarks:
                first = _first_key(place_key, each)
                keys[id(each)] = (*first[:-1], n_equal[first])
                n_equal[first] += 1
        return self._known[name]


def _first_key(place_key: str, landmark: Landmark) -> ViewKey:
    return place_key, landmark.label, landmark.bearing_rad, landmark.range_m, 0


class ThingIds:
    """The numbers that views bear, in a log that several programs may share.

    Args:
        path: The log; None keeps none. One that cannot be written costs only that later sessions
            give other ids.

    Attributes:
        numbers: By the key of the view.
        n_named: The highest number that was ever given.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._n_read = 0
        self.numbers: dict[ViewKey, int] = {}
        self.n_named = 0

    @contextlib.contextmanager
    def giving(self) -> Iterator[dict[ViewKey, int]]:
        """Let numbers be given to views, which are kept; no other program gives any meanwhile."""
        given: dict[ViewKey, int] = {}
        with contextlib.ExitStack() as stack:
            log = self._open(stack)
            if log is not None:
                self._read(log)
            yield given
            self._take(given)
            if log is not None:
                lines = (json.dumps([number, *key]) + "\n" for key, number in given.items())
                with contextlib.suppress(OSError):
                    self._n_read += log.write("".join(lines).encode())

    def has_given(self, thing_id: str) -> bool:
        """Return True for the id of a thing, or of one that once was."""
        number = thing_id.removeprefix("T")
        return number.isdecimal() and 1 <= int(number) <= self.n_named

    def count_bearing(self, thing_id: str, views: Iterable[ViewKey]) -> int:
        """Return how many of some views bear an id."""
        number = int(thing_id.removeprefix("T"))
        return sum(self.numbers.get(key) == number for key in views)

    def new(self) -> int:
        """Return a number that no thing ever had."""
        self.n_named += 1
        return self.n_named

    def _open(self, stack: contextlib.ExitStack) -> FileIO | None:
        if self._path is None:
            return None
        with contextlib.suppress(OSError):
            self._path.parent.mkdir(parents=True, exist_ok=True)
            log = stack.enter_context(self._path.open("a+b", buffering=0))
            fcntl.flock(log, fcntl.LOCK_EX)
            return log
        return None

    def _read(self, log: FileIO) -> None:
        """Read what was written since; half a line that a crash has left is ended."""
        said = b""
        with contextlib.suppress(OSError):
            if log.seek(0, os.SEEK_END) < self._n_read:
                self._n_read = 0  # It was removed, and another program began anew.
            log.seek(self._n_read)
            said = log.read()
            self._n_read += len(said)
            if said and not said.endswith(b"\n"):
                self._n_read += log.write(b"\n")
        for line in said.splitlines():
            with contextlib.suppress(ValueError, TypeError, OverflowError, RecursionError):
                number, place, label, bearing_rad, range_m, nth = json.loads(line)
                if 1 <= int(number) <= LARGEST:
                    self._take({(place, label, bearing_rad, range_m, nth): int(number)})

    def _take(self, numbers: Mapping[ViewKey, int]) -> None:
        self.numbers.update(numbers)
        self.n_named = max(self.n_named, *numbers.values(), 0)
