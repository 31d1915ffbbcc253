"""What waits to be sent to one client: bounded, so that one who does not read costs nothing."""

import math
from collections import deque
from collections.abc import Callable, Iterable

import anyio

from mapspeak.rosbridge_server.hub import Frame, Publication

MOST_REPLIES = 1000

Item = Frame | Publication


class Lane:
    """The messages of one topic that wait; when there are too many, the oldest goes."""

    def __init__(self, *, depth: int, throttle_s: float, holds_back: bool) -> None:
        self.waiting: deque[Item] = deque(maxlen=depth)
        self.throttle_s = throttle_s
        self.holds_back = holds_back
        self.due_s = -math.inf

    def offer(self, item: Item, now_s: float) -> None:
        """Take a message in, unless it comes too early and nothing may wait."""
        if now_s >= self.due_s or self.holds_back:
            self.waiting.append(item)
        if now_s >= self.due_s and not self.holds_back:
            self.due_s = now_s + self.throttle_s

    def take(self, now_s: float) -> Item | None:
        """Return the message that may go now."""
        if not self.waiting or (self.holds_back and now_s < self.due_s):
            return None
        if self.holds_back:
            self.due_s = now_s + self.throttle_s
        return self.waiting.popleft()


class Outbox:
    """One client's replies, in order, and its topics, one lane each; all on the wall clock.

    Args:
        give_up: Called when the client asks and asks, and reads nothing.
    """

    def __init__(self, give_up: Callable[[], None]) -> None:
        self._give_up = give_up
        self._replies: deque[Frame] = deque()
        self._lanes: dict[str, Lane] = {}
        self._news = anyio.Event()

    def open_lane(self, topic: str, *, depth: int, throttle_s: float, holds_back: bool) -> None:
        """Make room for a topic, or change the room it has."""
        lane = Lane(depth=depth, throttle_s=throttle_s, holds_back=holds_back)
        if topic in self._lanes:
            lane.waiting.extend(self._lanes[topic].waiting)
        self._lanes[topic] = lane

    def close_lane(self, topic: str) -> None:
        """Forget a topic and what waits on it."""
        self._lanes.pop(topic, None)

    def reply(self, frame: Frame) -> None:
        """Put an answer behind the others; none is ever left out."""
        if len(self._replies) >= MOST_REPLIES:
            self._give_up()
            return
        self._replies.append(frame)
        self._news.set()

    def hear(self, publication: Publication) -> None:
        """Put a message on its topic's lane."""
        self.offer(publication.topic, publication)

    def offer(self, lane: str, item: Item) -> None:
        """Put something on a lane, if it is open; one too many pushes the oldest out."""
        if lane in self._lanes:
            self._lanes[lane].offer(item, anyio.current_time())
            self._news.set()

    async def take(self) -> Iterable[Item]:
        """Wait for something to send: all answers, then at most one message of each topic."""
        while True:
            if self._news.is_set():
                self._news = anyio.Event()
            now_s = anyio.current_time()
            replies, self._replies = self._replies, deque()
            due = [lane.take(now_s) for lane in self._lanes.values()]
            found = [*replies, *(each for each in due if each is not None)]
            if found:
                return found
            with anyio.move_on_at(self._next_due_s()):
                await self._news.wait()

    def _next_due_s(self) -> float:
        return min((lane.due_s for lane in self._lanes.values() if lane.waiting), default=math.inf)
