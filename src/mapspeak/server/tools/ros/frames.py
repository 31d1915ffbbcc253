"""The tree of TF frames as it is heard: its transforms, their rates, and what is wrong with it."""

import math
from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import anyio
import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import LinkError
from mapspeak.ros.messages.fields import Message
from mapspeak.ros.messages.poses import read_transforms
from mapspeak.ros.port import RosConnection, find_nearest
from mapspeak.ros.transforms import TransformTree
from mapspeak.server.text.offered import lead
from mapspeak.server.text.wording import list_some, say_count
from mapspeak.server.tools.ros.inquiry import RosInquiry
from mapspeak.server.tools.ros.reading import say_lag, say_rate

TRANSFORMS = "tf2_msgs/TFMessage"
FRAMES_COME_S = 2.0
"""Longest wait for a published frame, in wall time."""

LATE_PERIODS = 3.0
LEAST_LATE_S = 1.0
MOST_LINES = 150
MOST_NAMED = 12
LOCKED = 1e-6
"""Cosine of a pitch at which roll and yaw turn about the same axis (gimbal lock)."""


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


class HeardFrames:
    """The transforms that came in a time: how often, and where they put the frames."""

    def __init__(self) -> None:
        self.links: dict[tuple[str, str, bool], FrameLink] = {}
        self.tree = TransformTree()

    @property
    def frames(self) -> set[str]:
        """The frames that have been heard of."""
        return {frame for parent, child, _ in self.links for frame in (parent, child)}

    def take(self, message: Message, *, is_static: bool, now_s: float) -> None:
        """Count the transforms of a message that came at a time of the event loop's clock."""
        try:
            transforms = read_transforms(message)
        except LinkError:
            return  # ros_read shows the fault of an unreadable one.
        self.tree.take(transforms, is_static=is_static)
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
) -> HeardFrames:
    """Return the transforms that come in a time, latched ones included.

    Args:
        connection: To listen with.
        topics: Name, type as this ROS writes it, and whether its transforms are static.
        duration_s: In wall time.
        wanted: Once all these frames have come, it ends; empty to listen for the whole time.
    """
    listener = HeardFrames()

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
    return listener


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
    heard = await hear_frames(
        inquiry.connection,
        [(topic, type_name, topic.endswith("_static")) for topic in topics],
        duration_s=FRAMES_COME_S,
        wanted=wanted,
    )
    known = sorted(heard.frames)
    strangers = sorted(wanted - set(known))
    if strangers and not all(link.is_static for link in heard.links.values()):
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


def say_transform(tree: TransformTree, *, outer: str, inner: str) -> str:
    """Return where a frame lies in another, in metres and degrees, and the way between them.

    Roll, pitch and yaw turn about the outer frame's x, y and z, in this order (REP 103).

    Raises:
        LinkError: No chain of transforms joins the two.
    """
    matrix = tree.find_matrix(outer, inner)
    x, y, z = np.round(matrix[:3, 3], 3) + 0.0  # No -0.000.
    roll, pitch, yaw = np.round(np.degrees(_angles(matrix[:3, :3])), 1) + 0.0
    from_outer, from_inner = tree.find_ways(outer, inner)
    way = [outer, *(each.parent for each in from_outer)]
    way += [each.child for each in reversed(from_inner)]
    return (
        f"{inner} in {outer}: x {x:.3f}, y {y:.3f}, z {z:.3f} m; "
        f"roll {roll:.1f}, pitch {pitch:.1f}, yaw {yaw:.1f} deg\nway: {' > '.join(way)}"
    )


def _angles(turn: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return roll, pitch and yaw, rad; where pitch leaves roll and yaw open, yaw is 0."""
    level = math.hypot(turn[2, 1], turn[2, 2])
    pitch = math.atan2(-turn[2, 0], level)
    if level < LOCKED:
        return math.atan2(-turn[1, 2], turn[1, 1]), pitch, 0.0
    return math.atan2(turn[2, 1], turn[2, 2]), pitch, math.atan2(turn[1, 0], turn[0, 0])


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
