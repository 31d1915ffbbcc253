"""The tree of TF frames, its faults and the transforms in it, in words."""

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from mapspeak.ros.listening import FrameLink, HeardFrames
from mapspeak.server.text.ros.listening import say_lag, say_rate
from mapspeak.server.text.wording import list_some, say_count

LATE_PERIODS = 3.0
LEAST_LATE_S = 1.0
MOST_LINES = 150
MOST_NAMED = 12
LOCKED = 1e-6
"""Cosine of a pitch at which roll and yaw turn about the same axis (gimbal lock)."""


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
    return "\n".join([head, *_say_faults(links, roots, in_tree), *lines])


def say_transform(
    heard: HeardFrames, *, outer: str, inner: str, now_s: float, heard_s: float
) -> str:
    """Return where a frame lies in another, the way between them, and how old that is.

    Roll, pitch and yaw turn about the outer frame's x, y and z, in this order (REP 103).

    Raises:
        LinkError: No chain of transforms joins the two.
    """
    matrix = heard.tree.find_matrix(outer, inner)
    x, y, z = np.round(matrix[:3, 3], 3) + 0.0  # No -0.000.
    roll, pitch, yaw = np.round(np.degrees(_angles(matrix[:3, :3])), 1) + 0.0
    from_outer, from_inner = heard.tree.find_ways(outer, inner)
    way = [outer, *(each.parent for each in from_outer)]
    way += [each.child for each in reversed(from_inner)]
    keys = [(each.parent, each.child, False) for each in (*from_outer, *from_inner)]
    moving = [heard.links[key] for key in keys if key in heard.links]
    oldest = min(moving, key=lambda link: link.stamp_s, default=None)
    age = "all of it is static" if oldest is None else _say_link(oldest, now_s, heard_s)
    return (
        f"{inner} in {outer}: x {x:.3f}, y {y:.3f}, z {z:.3f} m; "
        f"roll {roll:.1f}, pitch {pitch:.1f}, yaw {yaw:.1f} deg\n"
        f"way: {' > '.join(way)}\noldest: {age}"
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


def _say_faults(
    links: Sequence[FrameLink], roots: Sequence[str], in_tree: set[int]
) -> Iterator[str]:
    """Name gaps, frames with two parents, and ways that lead back to where they began."""
    if len(roots) > 1:
        named = list_some(roots, most=MOST_NAMED)
        yield f"NOT CONNECTED: {len(roots)} trees, from {named}: nothing leads from one to another"
    for child in sorted({link.child for link in links}):
        here = [link for link in links if link.child == child]
        parents = sorted({link.parent for link in here})
        if len(parents) > 1:
            yield f"TWO PARENTS: {child} hangs on {' and on '.join(parents)}"
        elif len(here) > 1:
            yield f"TWICE: {parents[0]} > {child} comes as static and as moving"
    parent_of = {link.child: link.parent for link in links if id(link) not in in_tree}
    told: set[str] = set()
    for frame in sorted(parent_of):
        way = [frame]
        while way[-1] in parent_of and parent_of[way[-1]] not in way:
            way.append(parent_of[way[-1]])
        again = parent_of.get(way[-1])
        if again is not None and not told & set(way):
            told.update(way)
            yield f"LOOP: {' > '.join(reversed([*way[way.index(again) :], again]))}"
