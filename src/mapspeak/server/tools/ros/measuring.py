"""The tools that measure publications: the rates of topics, and the tree of frames."""

from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from typing import Annotated

import anyio
from pydantic import Field

from mapspeak.errors import LinkError
from mapspeak.ros.messages.fields import Message
from mapspeak.ros.messages.poses import read_transforms
from mapspeak.ros.port import RosConnection, find_nearest
from mapspeak.server.text.offered import lead
from mapspeak.server.text.wording import list_some, say_count
from mapspeak.server.tools.ros.census import fetch_publishers
from mapspeak.server.tools.ros.inquiry import RosInquiry, full_name
from mapspeak.server.tools.ros.reading import Heard, hear, say_lag, say_rate, say_stamp
from mapspeak.server.tools.ros.reports import cut
from mapspeak.server.tools.ros.views import BULKY
from mapspeak.server.tools.toolset import ToolEffect, tool
from mapspeak.session import Session

TRANSFORMS = "tf2_msgs/TFMessage"
FRAMES_COME_S = 2.0
"""Longest wait for a published frame, in wall time."""

LATE_PERIODS = 3.0
LEAST_LATE_S = 1.0
MOST_LINES = 150
MOST_NAMED = 12


@dataclass(slots=True, kw_only=True)
class FrameLink:
    """A transform between two frames, as often as it came.

    Attributes:
        parent: The frame in which the child lies.
        child: A frame.
        is_static: It came as one that never changes.
        stamp_s: The latest time that was written on it, robot time.
        n: How often it came.
        first_s: When it came first, by the event loop's clock.
        last_s: When it came last.
    """

    parent: str
    child: str
    is_static: bool
    stamp_s: float
    first_s: float
    last_s: float
    n: int = 1

    @property
    def period_s(self) -> float | None:
        """Between two of them; None where one came only."""
        return (self.last_s - self.first_s) / (self.n - 1) if self.n > 1 else None


class _Listener:
    def __init__(self) -> None:
        self.links: dict[tuple[str, str, bool], FrameLink] = {}

    @property
    def frames(self) -> set[str]:
        return {frame for parent, child, _ in self.links for frame in (parent, child)}

    def take(self, message: Message, *, is_static: bool, now_s: float) -> None:
        try:
            transforms = read_transforms(message)
        except LinkError:
            return  # ros_read shows the fault of an unreadable one.
        for each in transforms:
            key = (each.parent, each.child, is_static)
            link = self.links.get(key)
            if link is None:
                self.links[key] = FrameLink(
                    parent=each.parent,
                    child=each.child,
                    is_static=is_static,
                    stamp_s=each.stamp_s,
                    first_s=now_s,
                    last_s=now_s,
                )
            else:
                link.n += 1
                link.last_s = now_s
                link.stamp_s = max(link.stamp_s, each.stamp_s)


async def hear_frames(
    connection: RosConnection,
    topics: Sequence[tuple[str, str, bool]],
    *,
    duration_s: float,
    wanted: AbstractSet[str] = frozenset(),
) -> list[FrameLink]:
    """Return the transforms that come in a time, latched ones included.

    Args:
        connection: To listen with.
        topics: Name, type as this ROS writes it, and whether its transforms are static.
        duration_s: In wall time.
        wanted: Once all these frames have come, it ends; empty to listen for the whole time.
    """
    listener = _Listener()

    async def listen(topic: str, type_name: str, is_static: bool) -> None:  # noqa: FBT001
        subscription = connection.subscribe(topic, type_name=type_name)
        n_seen = subscription.n_received
        try:
            if is_static and n_seen:
                # Several nodes keep one each, and only the latest of them is at hand.
                connection.renew(subscription)
            while True:
                message = await subscription.wait_for_more_than(n_seen, timeout_s=2 * duration_s)
                n_seen = subscription.n_received
                listener.take(message, is_static=is_static, now_s=subscription.arrived_s)
                if wanted and wanted <= listener.frames:
                    tasks.cancel_scope.cancel()
        except LinkError:
            return
        finally:
            connection.unsubscribe(subscription)

    with anyio.move_on_after(duration_s):
        async with anyio.create_task_group() as tasks:
            for topic, type_name, is_static in topics:
                tasks.start_soon(listen, topic, type_name, is_static)
    return list(listener.links.values())


async def check_frames(inquiry: RosInquiry, message: Message) -> None:
    """Return when TF has every frame that a goal is given in, or tells nothing that moves.

    Raises:
        LinkError: It has not; the goal would wait for ever, or be dropped without a word.
    """
    graph = await inquiry.fetch_topics()
    topics = graph.topics_of(TRANSFORMS)
    wanted = set(_frames_in(message))
    if not topics or not wanted:
        return
    type_name = graph.dialect.type_name(TRANSFORMS)
    links = await hear_frames(
        inquiry.connection,
        [(topic, type_name, topic.endswith("_static")) for topic in topics],
        duration_s=FRAMES_COME_S,
        wanted=wanted,
    )
    known = sorted({frame for link in links for frame in (link.parent, link.child)})
    strangers = sorted(wanted - set(known))
    if strangers and not all(link.is_static for link in links):
        near = find_nearest(strangers[0], known) or known[:MOST_NAMED]
        raise LinkError(
            f"TF has no frame {strangers[0][:80]!r}: a goal given in it would never be reached.",
            hint=lead(
                "Its {n} frames are such as {near}. {ros_frames} lists all.",
                n=len(known),
                near=", ".join(near),
            ),
        )


def _frames_in(value: object) -> Iterator[str]:
    """Yield the frames in the headers of a message and of all within, without a leading slash."""
    if isinstance(value, list):
        for each in value:
            yield from _frames_in(each)
    if isinstance(value, Mapping):
        for name, each in value.items():
            if name == "frame_id" and isinstance(each, str) and each.strip("/"):
                yield each.strip("/")
            yield from _frames_in(each)


def say_frames(links: Sequence[FrameLink], *, now_s: float, heard_s: float) -> str:
    """Return the frames as a tree, after its faults.

    Args:
        links: As they were heard.
        now_s: Robot time, now.
        heard_s: The event loop's clock, now.
    """
    frames = {name for link in links for name in (link.parent, link.child)}
    roots = sorted(frames - {link.child for link in links})
    told = list(_walk(links, roots))
    in_tree = {id(link) for link, _ in told}
    told += [(link, 0) for link in links if id(link) not in in_tree]
    lines = [f"{'  ' * depth}{_say_link(link, now_s, heard_s)}" for link, depth in told]
    if len(lines) > MOST_LINES:
        lines = [*lines[:MOST_LINES], f"... {len(lines) - MOST_LINES} more"]
    head = f"{say_count(len(frames), 'frame')}, {say_count(len(links), 'transform')}:"
    faults = [*_say_trees(roots), *_say_parents(links), *_say_loops(links, in_tree)]
    return "\n".join([head, *faults, *lines])


def _walk(links: Sequence[FrameLink], roots: Sequence[str]) -> Iterator[tuple[FrameLink, int]]:
    """Return the transforms below some frames with their depth, each branch to its end."""
    below: dict[str, list[FrameLink]] = {}
    for link in sorted(links, key=lambda link: link.child, reverse=True):
        below.setdefault(link.parent, []).append(link)
    reached = set(roots)
    for root in roots:
        stack = [(link, 0) for link in below.get(root, [])]
        while stack:
            link, depth = stack.pop()
            yield link, depth
            # A frame with two parents is listed under both; its children, once.
            if link.child not in reached:
                reached.add(link.child)
                stack += [(each, depth + 1) for each in below.get(link.child, [])]


def _say_link(link: FrameLink, now_s: float, heard_s: float) -> str:
    name = f"{link.parent} > {link.child}"
    if link.is_static:
        return f"{name}: static"
    period_s, silent_s = link.period_s, heard_s - link.last_s
    rate = say_rate(1.0 / period_s) if period_s else "came once"
    lag_s = now_s - link.stamp_s
    patience_s = max(LATE_PERIODS * (period_s or 0.0), LEAST_LATE_S)
    said = f"{name}: {rate}, stamp {say_lag(lag_s)}"
    if silent_s > patience_s:
        return f"{said} - STOPPED: the last came {silent_s:.1f} s ago"
    return f"{said} - LATE" if lag_s - silent_s > patience_s else said


def _say_trees(roots: Sequence[str]) -> Iterator[str]:
    if len(roots) > 1:
        named = list_some(roots, most=MOST_NAMED)
        yield f"NOT CONNECTED: {len(roots)} trees, from {named}: nothing leads from one to another"


def _say_parents(links: Sequence[FrameLink]) -> Iterator[str]:
    for child in sorted({link.child for link in links}):
        here = [link for link in links if link.child == child]
        parents = sorted({link.parent for link in here})
        if len(parents) > 1:
            yield f"TWO PARENTS: {child} hangs on {' and on '.join(parents)}"
        elif len(here) > 1:
            yield f"TWICE: {parents[0]} > {child} comes as static and as moving"


def _say_loops(links: Sequence[FrameLink], in_tree: set[int]) -> Iterator[str]:
    """Name the ways that lead back to where they began."""
    parent_of = {link.child: link.parent for link in links if id(link) not in in_tree}
    told: set[str] = set()
    for frame in sorted(parent_of):
        way = [frame]
        while way[-1] in parent_of and parent_of[way[-1]] not in way:
            way.append(parent_of[way[-1]])
        again = parent_of.get(way[-1])
        if again is None or told & set(way):
            continue
        ring = [*way[way.index(again) :], again]
        told.update(way)
        yield f"LOOP: {' > '.join(reversed(ring))}"


MOST_TOPICS = 20

Topics = Annotated[
    list[Annotated[str, Field(max_length=200)]],
    Field(description="full names", min_length=1, max_length=MOST_TOPICS),
]
Listen = Annotated[float, Field(description="seconds to listen", ge=0.2, le=25)]
FramesTopic = Annotated[
    str, Field(description="another robot's, such as /robot1/tf", max_length=200)
]


class MeasuringTools:
    """Listening for a time, and counting."""

    def __init__(self, session: Session, inquiry: RosInquiry) -> None:
        self._session = session
        self._inquiry = inquiry

    @tool("Rates of ROS topics", ToolEffect.READS, leads="{ros_read} shows the messages.")
    async def ros_rates(self, topics: Topics, duration_s: Listen = 3.0) -> str:
        """Measure several ROS topics at once: rate, age of the stamps, which are silent.

        Use it to find what has died, is slow or late.
        """
        said: dict[str, str] = {}

        async def measure(name: str) -> None:
            try:
                said[name] = await self._measure(name, duration_s)
            except LinkError as error:
                said[name] = f"{name}: {error}"

        names = list(dict.fromkeys(full_name(topic) for topic in topics))
        async with anyio.create_task_group() as tasks:
            for name in names:
                tasks.start_soon(measure, name)
        return cut("\n".join([f"listened for {duration_s:g} s", *(said[name] for name in names)]))

    @tool("The tree of TF frames", ToolEffect.READS)
    async def ros_frames(self, topic: FramesTopic = "/tf", duration_s: Listen = 3.0) -> str:
        """Tell the tree of TF frames: each transform's rate and age, static or not, who sends it.

        Use it when a transform is missing or late; it names loops, two parents and gaps.
        """
        moving = full_name(topic)
        graph = await self._inquiry.fetch_topics()
        static = f"{moving}_static"
        if moving not in graph.types and static not in graph.types:
            raise self._inquiry.stranger("topic", moving, graph.topics_of(TRANSFORMS))
        type_name = graph.dialect.type_name(TRANSFORMS)
        there = [(name, name == static) for name in (moving, static) if name in graph.types]
        links = await hear_frames(
            self._inquiry.connection,
            [(name, type_name, is_static) for name, is_static in there],
            duration_s=duration_s,
        )
        senders = [f"{name} published by: {await self._say_senders(name)}" for name, _ in there]
        now_s, heard_s = self._session.robot.now_s, anyio.current_time()
        tree = say_frames(links, now_s=now_s, heard_s=heard_s)
        return cut("\n".join([f"listened for {duration_s:g} s", *senders, tree]))

    async def _say_senders(self, topic: str) -> str:
        publishers = await fetch_publishers(self._inquiry.connection, topic)
        if len(publishers.others) < 2:
            return publishers.say()
        return f"{publishers.say()} (which of them sends which is not told)"

    async def _measure(self, name: str, duration_s: float) -> str:
        type_name = await self._inquiry.fetch_topic_type(name)
        heard = await hear(
            self._inquiry.connection,
            name,
            type_name=await self._inquiry.said(type_name),
            is_bulky=type_name in BULKY,
            n=1,
            wait_s=duration_s,
            duration_s=duration_s,
        )
        if not heard.n_received:
            publishers = await fetch_publishers(self._inquiry.connection, name)
            return f"{name}: SILENT, {say_silence(heard)}; published by {publishers.say()}"
        stamp = say_stamp(
            heard.messages[-1],
            now_s=self._session.robot.now_s,
            age_s=heard.age_s,
            period_s=heard.period_s,
        )
        many = "1 message" if heard.n_received == 1 else f"{heard.n_received} messages"
        rate = f"{say_rate(heard.rate_hz)}, {many}" if heard.n_received > 1 else many
        stopped = f"; STOPPED, the last {heard.age_s:.1f} s ago" if heard.has_stopped else ""
        return f"{name}: {rate}{stopped}{f'; {stamp}' if stamp else ''}"


def say_silence(heard: Heard) -> str:
    """Say for how long nothing has come."""
    if heard.age_s < heard.known_for_s:
        return f"the last message came {heard.age_s:.1f} s ago"
    return f"nothing came in the {heard.known_for_s:.1f} s since we listen"
