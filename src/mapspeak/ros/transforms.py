"""The tree of coordinate frames that ROS keeps in /tf and /tf_static, as far as it was heard."""

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import replace
from functools import partial

import anyio
import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import LinkError
from mapspeak.geometry import Pose, wrap_angle
from mapspeak.robot import StampedPose
from mapspeak.ros.activity import News, Subscription
from mapspeak.ros.messages.fields import Dialect, Message
from mapspeak.ros.messages.poses import FrameTransform, read_transforms
from mapspeak.ros.port import RosConnection

MAX_FRAMES = 10_000
CLOCK_JUMP_S = 10.0
"""A transform this much older than the last one is not late: the robot's clock was set back."""
PAST_STEP_S = 0.03
"""Between two transforms of one frame that are kept; what moved meanwhile is interpolated."""
N_PAST = 200
"""Of each frame: what was measured six seconds ago can still be placed."""
TF_HINT = (
    "Start SLAM or localisation (slam_toolbox, Cartographer, AMCL, gmapping) and the robot's "
    "drivers; `ros2 run tf2_tools view_frames` (ROS 1: `rosrun tf view_frames`) draws the tree."
)


class TransformTree:
    """The newest transform of each frame to its parent, and those of the last seconds."""

    def __init__(self) -> None:
        self._to_parent: dict[str, FrameTransform] = {}
        self._past: dict[str, deque[FrameTransform]] = {}
        self._static: set[str] = set()

    @property
    def frames(self) -> frozenset[str]:
        """All frames that have been heard of."""
        parents = (known.parent for known in self._to_parent.values())
        return frozenset(self._to_parent) | frozenset(parents)

    def take(self, transforms: Iterable[FrameTransform], *, is_static: bool) -> bool:
        """Keep transforms, and return whether any of them says something new.

        Each is kept unless a newer one of the same frame is known.
        """
        is_news = False
        for transform in transforms:
            known = self._to_parent.get(transform.child)
            if known is None and len(self._to_parent) >= MAX_FRAMES:
                continue
            if known is None or not 0.0 < known.stamp_s - transform.stamp_s < CLOCK_JUMP_S:
                is_news = is_news or known != transform
                self._to_parent[transform.child] = transform
                (self._static.add if is_static else self._static.discard)(transform.child)
                if not is_static:
                    self._keep_past(transform)
        return is_news

    def find(self, *, outer: str, inner: str, at_s: float = math.inf) -> StampedPose:
        """Return the pose of a frame in one that is above it in the tree.

        Its stamp is that of the oldest part that moves; 0 where nothing moves.

        Args:
            at_s: When, in robot time; what was heard last where nothing is known of then.

        Raises:
            LinkError: There is no such chain of frames, or it is a circle.
        """
        outer_from_inner = Pose(0.0, 0.0, 0.0)
        stamps: list[float] = []
        for newest in self._way_up(outer=outer, inner=inner):
            known = self._recall(newest, at_s)
            outer_from_inner = known.parent_from_child @ outer_from_inner
            if known.child not in self._static:
                stamps.append(known.stamp_s)
        return StampedPose(outer_from_inner, min(stamps, default=0.0))

    def find_ways(self, one: str, other: str) -> tuple[list[FrameTransform], list[FrameTransform]]:
        """Return the transforms from each of two frames up to the first that both lie in."""
        above = [one]
        while (known := self._to_parent.get(above[-1])) and known.parent not in above:
            above.append(known.parent)
        for outer in above:
            try:
                up = self._way_up(outer=outer, inner=other)
            except LinkError:
                continue
            return self._way_up(outer=outer, inner=one), up
        raise self._gap(outer=one, passed=[other])

    def find_matrix(self, outer: str, inner: str) -> NDArray[np.float64]:
        """Return outer_from_inner in space, shape (4, 4), for any two frames of one tree.

        Raises:
            LinkError: No chain of transforms joins the two.
        """
        from_outer, from_inner = self.find_ways(outer, inner)
        return np.linalg.inv(_chain(from_outer)) @ _chain(from_inner)

    def _keep_past(self, transform: FrameTransform) -> None:
        past = self._past.setdefault(transform.child, deque(maxlen=N_PAST))
        if past and transform.stamp_s < past[-1].stamp_s:
            past.clear()
        if not past or transform.stamp_s >= past[-1].stamp_s + PAST_STEP_S:
            past.append(transform)

    def _recall(self, newest: FrameTransform, at_s: float) -> FrameTransform:
        """Return how a frame lay at a time, between those that were heard before and after it."""
        after = newest
        for before in reversed(self._past.get(newest.child, ())):
            if not at_s < newest.stamp_s or before.parent != newest.parent:
                break
            if before.stamp_s <= at_s:
                return _interpolate(before, after, at_s)
            after = before
        return newest

    def _way_up(self, *, outer: str, inner: str) -> list[FrameTransform]:
        way: list[FrameTransform] = []
        passed = [inner]
        while passed[-1] != outer:
            known = self._to_parent.get(passed[-1])
            if known is None:
                raise self._gap(outer=outer, passed=passed)
            if known.parent in passed:
                circle = " -> ".join([*passed, known.parent])
                raise LinkError(
                    f"The robot's TF tree goes round in a circle: {circle}.",
                    hint="Two nodes publish contradicting transforms: stop one of them.",
                )
            way.append(known)
            passed.append(known.parent)
        return way

    def _gap(self, *, outer: str, passed: list[str]) -> LinkError:
        frames = self.frames
        if not frames:
            return LinkError("The robot publishes no TF transforms.", hint=TF_HINT)
        for name in (outer, passed[0]):
            if name not in frames:
                known = ", ".join(sorted(frames)[:12])
                return LinkError(
                    f"The robot's TF tree has no frame {name!r}; it has {known}.", hint=TF_HINT
                )
        return LinkError(
            f"The robot's TF tree has a gap: from {passed[0]!r} it reaches {passed[-1]!r} and not "
            f"{outer!r}.",
            hint=TF_HINT,
        )


def _interpolate(before: FrameTransform, after: FrameTransform, at_s: float) -> FrameTransform:
    """Return the transform between two, seen from above: straight and turning evenly."""
    passed = (at_s - before.stamp_s) / (after.stamp_s - before.stamp_s)
    one, other = before.parent_from_child, after.parent_from_child
    pose = Pose(
        one.x + passed * (other.x - one.x),
        one.y + passed * (other.y - one.y),
        wrap_angle(one.yaw_rad + passed * wrap_angle(other.yaw_rad - one.yaw_rad)),
    )
    return replace(before, parent_from_child=pose, stamp_s=at_s)


def _chain(way_up: Iterable[FrameTransform]) -> NDArray[np.float64]:
    """Return the matrix from the lowest frame of a way to the highest."""
    matrix = np.eye(4)
    for transform in way_up:
        matrix = _matrix(transform) @ matrix
    return matrix


def _matrix(transform: FrameTransform) -> NDArray[np.float64]:
    pose, half_rad = transform.parent_from_child, transform.parent_from_child.yaw_rad / 2
    x, y, z, w = transform.rotation or (0.0, 0.0, math.sin(half_rad), math.cos(half_rad))
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), pose.x],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), pose.y],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), transform.height_m],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


class FrameListener:
    """Keeps a tree of frames up to date from /tf and /tf_static.

    Neither is throttled: that would drop whole transforms, not repetitions of one.
    """

    def __init__(self, connection: RosConnection) -> None:
        self.tree = TransformTree()
        self.arrived_s: float | None = None
        """When something new was told of one that moves, by the event loop's clock; None before."""
        self._connection = connection
        self._subscriptions: dict[str, Subscription] = {}
        self.news = News()
        """Told of each message."""

    def listen(self, moving_topic: str, static_topic: str, *, dialect: Dialect) -> None:
        """Subscribe to both topics, also before anybody publishes them, and to no others."""
        wanted = {
            moving_topic: partial(self._take, is_static=False),
            static_topic: partial(self._take, is_static=True),
        }
        for topic in self._subscriptions.keys() - wanted.keys():
            self._connection.unsubscribe(self._subscriptions.pop(topic))
        type_name = dialect.type_name("tf2_msgs/TFMessage")
        for topic, take in wanted.items():
            if topic not in self._subscriptions:
                subscription = self._connection.subscribe(topic, type_name=type_name)
                subscription.listen(take)
                self._subscriptions[topic] = subscription

    def has_way(self, *, outer: str, inner: str) -> bool:
        """Return True when the tree leads from one frame to the other."""
        try:
            self.tree.find(outer=outer, inner=inner)
        except LinkError:
            return False
        return True

    def _take(self, message: Message, *, is_static: bool) -> None:
        try:
            transforms = read_transforms(message)
        except LinkError:
            return
        if self.tree.take(transforms, is_static=is_static) and not is_static:
            self.arrived_s = anyio.current_time()
        self.news.tell()
