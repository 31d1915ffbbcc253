"""The topics of the robot and of its clients, their subscribers, and bounded output queues."""

import base64
import io
import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property

import anyio
from PIL import Image

from mapspeak.links.rosbridge.protocol.codec import to_cbor, to_json
from mapspeak.links.rosbridge.protocol.conversation import Encoding
from mapspeak.ros.messages.fields import Message, bare_type


@dataclass(frozen=True, slots=True)
class Frame:
    """One websocket message: UTF-8 text, or bytes."""

    data: bytes
    is_text: bool


class Publication:
    """One message on one topic.

    Attributes:
        type: Of the message, as "package/Type".
        message: Its fields; arrays as numpy arrays, uint8[] as bytes.
    """

    def __init__(self, topic: str, message_type: str, message: Message) -> None:
        self.topic = topic
        self.type = message_type
        self.message = message

    def frame(self, encoding: Encoding) -> Frame:
        """Return the message as a client wants it."""
        match encoding:
            case Encoding.CBOR:
                return Frame(self._cbor, is_text=False)
            case Encoding.PNG:
                return Frame(self._png, is_text=True)
            case Encoding.JSON:
                return Frame(self._json, is_text=True)

    @property
    def _operation(self) -> dict[str, object]:
        return {"op": "publish", "topic": self.topic, "msg": self.message}

    @cached_property
    def _json(self) -> bytes:
        return to_json(self._operation)

    @cached_property
    def _cbor(self) -> bytes:
        return to_cbor(self._operation)

    @cached_property
    def _png(self) -> bytes:
        return to_json({"op": "png", "data": base64.b64encode(_as_picture(self._json)).decode()})


def answer_frame(operation: Message, answer: Message) -> Frame:
    """Return the answer to an operation, with its id if it had one."""
    named = {**answer, "id": operation["id"]} if "id" in operation else answer
    return Frame(to_json(named), is_text=True)


def fragments_of(frame: Frame, *, length: int) -> Iterator[Frame]:
    """Return a text in pieces of a given length, as the operation `fragment`."""
    text = frame.data.decode()
    for number, start in enumerate(range(0, len(text), length)):
        piece = {
            "op": "fragment",
            "id": "0",
            "data": text[start : start + length],
            "num": number,
            # The real one forgets to round down.
            "total": (len(text) - 1) / length + 1,
        }
        yield Frame(to_json(piece), is_text=True)


def _as_picture(text: bytes) -> bytes:
    """Lay a text out as the pixels of a PNG, filled up with line ends, as rosbridge does."""
    n_pixels = len(text) / 3.0
    width_px = max(math.floor(math.sqrt(n_pixels)), 1)
    height_px = max(math.ceil(n_pixels / width_px), 1)
    padded = text.ljust(width_px * height_px * 3, b"\n")
    encoded = io.BytesIO()
    Image.frombytes("RGB", (width_px, height_px), padded).save(encoded, format="PNG")
    return encoded.getvalue()


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
        """Forget a topic and its waiting messages."""
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
            waiting = [lane.due_s for lane in self._lanes.values() if lane.waiting]
            with anyio.move_on_at(min(waiting, default=math.inf)):
                await self._news.wait()


Listener = Callable[[Publication], None]
ROSBRIDGE_NODE = "/rosbridge_websocket"


@dataclass(slots=True, kw_only=True)
class Topic:
    """One topic.

    Attributes:
        name: With its leading slash.
        type: Of its messages, as "package/Type".
        is_latched: A late subscriber gets the last message at once.
        depth: How many messages wait for a slow client; the newest stay.
    """

    name: str
    type: str
    is_latched: bool = False
    depth: int = 50
    publishers: tuple[str, ...] = ()
    subscribers: tuple[str, ...] = ()
    last: Publication | None = None
    n_advertisers: int = 0
    listeners: list[Listener] = field(default_factory=list)
    takers: list[Listener] = field(default_factory=list)


class Hub:
    """All topics there are; listeners are clients, takers are the robot's own nodes."""

    def __init__(self, topics: list[Topic]) -> None:
        self._topics = {topic.name: topic for topic in topics}
        self._own = frozenset(self._topics)

    @property
    def topics(self) -> list[Topic]:
        """The topics with a publisher or a subscriber, by name."""
        return sorted(self._topics.values(), key=lambda topic: topic.name)

    def find(self, name: str) -> Topic | None:
        """Find a topic."""
        return self._topics.get(name)

    def is_wanted(self, name: str) -> bool:
        """Return True when a client listens."""
        return name in self._topics and bool(self._topics[name].listeners)

    def publish(self, name: str, message: Message) -> None:
        """Hand a message to all subscribers of the topic."""
        topic = self._topics[name]
        publication = Publication(name, topic.type, message)
        if topic.is_latched:
            topic.last = publication
        for hear in [*topic.takers, *topic.listeners]:
            hear(publication)

    def take(self, name: str, taker: Listener) -> None:
        """Let one of the robot's own nodes hear a topic."""
        self._topics[name].takers.append(taker)

    def subscribe(self, name: str, message_type: str, listener: Listener) -> None:
        """Let a client hear a topic, and return it the last message of a latched one."""
        topic = self._topics.setdefault(name, Topic(name=name, type=bare_type(message_type)))
        if listener not in topic.listeners:
            topic.listeners.append(listener)
        if topic.last is not None:
            listener(topic.last)

    def unsubscribe(self, name: str, listener: Listener) -> None:
        """End a client's hearing."""
        topic = self._topics.get(name)
        if topic is not None and listener in topic.listeners:
            topic.listeners.remove(listener)
            self._forget_unused(topic)

    def advertise(self, name: str, message_type: str, *, is_latched: bool) -> None:
        """Note that a client publishes a topic."""
        topic = self._topics.setdefault(name, Topic(name=name, type=bare_type(message_type)))
        topic.n_advertisers += 1
        topic.is_latched = topic.is_latched or (is_latched and name not in self._own)

    def unadvertise(self, name: str) -> None:
        """Note that a client publishes a topic no more."""
        topic = self._topics.get(name)
        if topic is not None:
            topic.n_advertisers -= 1
            self._forget_unused(topic)

    def publishers_of(self, topic: Topic) -> list[str]:
        """Return the nodes that publish a topic; clients do so through rosbridge."""
        return [*topic.publishers, *([ROSBRIDGE_NODE] if topic.n_advertisers else [])]

    def subscribers_of(self, topic: Topic) -> list[str]:
        """Return the nodes that hear a topic."""
        return [*topic.subscribers, *([ROSBRIDGE_NODE] if topic.listeners else [])]

    def _forget_unused(self, topic: Topic) -> None:
        is_used = topic.name in self._own or topic.listeners or topic.n_advertisers > 0
        if not is_used:
            del self._topics[topic.name]
