"""The tree of coordinate frames as the topics of TF tell it, with what is wrong with it."""

from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import anyio

from mapspeak.errors import LinkError
from mapspeak.ros import RosConnection, find_nearest
from mapspeak.ros.messages import Message, read_transforms
from mapspeak.server.tools.ros.inquiry import RosInquiry
from mapspeak.server.tools.ros.reading import say_rate
from mapspeak.server.tools.ros.stamps import say_lag
from mapspeak.server.wording import list_some, say_count

TRANSFORMS = "tf2_msgs/TFMessage"
FRAMES_COME_S = 2.0
"""For a frame that somebody sends to come, in wall time."""

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
            return  # Of one that cannot be read, ros_read shows what is wrong.
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
    """Gives the transforms that come in a time, those that are kept for latecomers too.

    Args:
        connection: To listen with.
        topics: Name, type as this ROS writes it, and whether what comes never changes.
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
            hint=f"Its {len(known)} frames are such as {', '.join(near)}; ros_frames lists all.",
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
    """Gives the frames as a tree, after what is wrong with it.

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
    """Gives the transforms below some frames with their depth, each branch to its end."""
    below: dict[str, list[FrameLink]] = {}
    for link in sorted(links, key=lambda link: link.child, reverse=True):
        below.setdefault(link.parent, []).append(link)
    reached = set(roots)
    for root in roots:
        stack = [(link, 0) for link in below.get(root, [])]
        while stack:
            link, depth = stack.pop()
            yield link, depth
            # A frame with two parents is told at both; what hangs on it, once.
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
    """Names the ways that lead back to where they began."""
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
