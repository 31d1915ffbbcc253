"""How many commands of each kind were allowed lately."""

from collections import defaultdict, deque

from mapspeak.safety.commands import Kind

MINUTE_S = 60.0
MOST_KEPT = 10_000


class RateLog:
    """Counts commands in the last minute of robot time, whichever way its clock jumps."""

    def __init__(self) -> None:
        self._times_s: dict[Kind, deque[float]] = defaultdict(lambda: deque(maxlen=MOST_KEPT))

    def note(self, kind: Kind, now_s: float) -> None:
        """Counts a command."""
        self._times_s[kind].append(now_s)

    def count(self, kind: Kind, now_s: float) -> int:
        """Gives how many commands there were within a minute of now."""
        times_s = self._times_s[kind]
        while times_s and now_s - times_s[0] >= MINUTE_S:
            times_s.popleft()
        return sum(abs(now_s - each_s) < MINUTE_S for each_s in times_s)
