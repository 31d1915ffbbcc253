"""What there is in a ROS system, and what came: lists, ends of topics, rates, stamps."""

import fnmatch
import math
import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence

import anyio

from mapspeak.ros.census import Census, Nodes
from mapspeak.ros.listening import Heard
from mapspeak.ros.messages.fields import Dialect, Message, find_stamp
from mapspeak.ros.port import EndQuality, NodeLinks, OwnEnds, RosConnection, RosGraph, TopicQuality
from mapspeak.server.text.wording import list_some, say_count

LATE_PERIODS = 3.0
LEAST_LATE_S = 0.5
"""A way over a network takes some time, and so does an answer."""
OLD_S = 2.0
"""A message whose rate is not known may be so old without a word."""
MOST_NODES = 20
MOST_NAMED = 40
PAGE_SIZE = 40
NOTABLE = {
    "maps": ("nav_msgs/OccupancyGrid",),
    "velocities": ("geometry_msgs/Twist", "geometry_msgs/TwistStamped"),
    "odometry": ("nav_msgs/Odometry",),
    "scans and clouds": ("sensor_msgs/LaserScan", "sensor_msgs/PointCloud2"),
    "pictures": ("sensor_msgs/Image", "sensor_msgs/CompressedImage"),
}


# --- when and how often


def say_rate(rate_hz: float) -> str:
    """Return a rate with three digits: 13.5 Hz is no 14 Hz."""
    return f"{rate_hz:.0f} Hz" if rate_hz >= 1000.0 else f"{f'{rate_hz:#.3g}'.rstrip('.')} Hz"


def say_lag(lag_s: float) -> str:
    """Say how far a stamp is from robot time."""
    where = "behind" if lag_s >= 0.0 else "ahead of"
    return f"{abs(lag_s):.2f} s {where} robot time"


def say_stamp(
    message: Message, *, now_s: float, age_s: float = 0.0, period_s: float | None = None
) -> str:
    """Say a message's stamp and how far it is off; empty where it has none.

    Args:
        message: Of any type.
        now_s: Robot time.
        age_s: Since the message came.
        period_s: Between two messages of its topic; None where that is not known.
    """
    stamp_s = find_stamp(message)
    if not stamp_s:
        return "" if stamp_s is None else "stamp 0: not set"
    lag_s = now_s - stamp_s
    old_s, fault = lag_s - age_s, ""
    if old_s < -LEAST_LATE_S:
        fault = f" - AHEAD: {-old_s:.1f} s in the future when it came"
    elif period_s is None and old_s > OLD_S:
        fault = f" - it was {old_s:.1f} s old when it came: kept for latecomers, or late"
    elif period_s is not None and old_s > max(LATE_PERIODS * period_s, LEAST_LATE_S):
        fault = f" - LATE: {old_s:.1f} s old when it came, though one comes every {period_s:.3g} s"
    return f"stamp {stamp_s:.3f} s, {say_lag(lag_s)}{fault}"


def say_heard(heard: Heard, duration_s: float) -> str:
    """Say how many messages are shown, and how old they are or how often they came."""
    shown = len(heard.messages)
    if duration_s:
        stopped = f", the last {heard.age_s:.1f} s ago" if heard.has_stopped else ""
        return (
            f"{say_count(heard.n_received, 'message')} in {heard.listened_s:.1f} s, "
            f"{say_rate(heard.rate_hz)}{stopped}; the "
            f"{'latest' if shown == 1 else f'latest {shown}, the newest last'}:"
        )
    return f"{'' if shown == 1 else f'{shown} messages, the newest '}{heard.age_s:.1f} s ago:"


def say_measured(heard: Heard, *, now_s: float, n_bytes: int | None) -> str:
    """Say how often messages came and how much that is, whether they stopped, and the last stamp.

    Args:
        heard: One message at least.
        now_s: Robot time.
        n_bytes: Of the latest on ROS's own wire; None where its type is not described.
    """
    many = say_count(heard.n_received, "message")
    rate = f"{say_rate(heard.rate_hz)}, {many}" if heard.n_received > 1 else many
    rate += f", {_say_size(n_bytes, heard)}"
    stopped = f"; STOPPED, the last {heard.age_s:.1f} s ago" if heard.has_stopped else ""
    stamp = say_stamp(heard.messages[-1], now_s=now_s, age_s=heard.age_s, period_s=heard.period_s)
    return f"{rate}{stopped}{f'; {stamp}' if stamp else ''}"


def _say_size(n_bytes: int | None, heard: Heard) -> str:
    """Say the size of a message, or the bandwidth by that of the latest where a rate is known."""
    if n_bytes is None:
        return "bandwidth not known: the type is not described"
    is_rate = heard.n_received > 1
    n_kb = n_bytes * (heard.rate_hz if is_rate else 1.0) / 1000.0
    shown = f"{n_kb / 1000.0:.3g} MB" if n_kb >= 1000.0 else f"{n_kb:.3g} kB"
    return f"about {shown}{'/s' if is_rate else ''}"


def say_silence(heard: Heard) -> str:
    """Say for how long nothing has come."""
    if heard.age_s < heard.known_for_s:
        return f"the last message came {heard.age_s:.1f} s ago"
    return f"nothing came in the {heard.known_for_s:.1f} s since we listen"


def say_silent(heard: Heard, publishers: Nodes) -> str:
    """Say for how long nothing has come, and from whom it should."""
    return f"SILENT, {say_silence(heard)}; published by {say_nodes(publishers)}"


def say_loss(connection: RosConnection, *, since_s: float) -> str:
    """Say that the connection is lost, or was lost after a moment; empty where it held.

    Args:
        connection: To the robot.
        since_s: That moment, by the event loop's clock; minus infinity where nothing was asked or
            heard before.
    """
    lost_s, up_s = connection.lost_for_s, connection.connected_for_s
    if lost_s is not None:
        return (
            f"The connection was lost {lost_s:.1f} s ago and is not back yet: this is as old as "
            "that."
        )
    if up_s is not None and anyio.current_time() - up_s > since_s > -math.inf:
        return (
            f"The connection was lost meanwhile and is back since {up_s:.1f} s: what came before "
            "may be old."
        )
    return ""


# --- who


def _mark_ours(names: Iterable[str], ours: Collection[str | None]) -> list[str]:
    """Return names, with a mark on those that are our own doing."""
    return [f"{name} (mapspeak)" if name in ours else name for name in names]


def say_nodes(nodes: Nodes) -> str:
    """Name nodes, with a mark on ours."""
    named = sorted((*nodes.others, *filter(None, [nodes.ours])))
    return list_some(_mark_ours(named, (nodes.ours,)), most=MOST_NODES) or "nobody"


def say_senders(topic: str, publishers: Nodes) -> str:
    """Name the publishers of a topic, of which several may send one thing."""
    is_open = len(publishers.others) > 1
    untold = " (which of them sends which is not told)" if is_open else ""
    return f"{topic} published by: {say_nodes(publishers)}{untold}"


def say_ends(publishers: Nodes, subscribers: Nodes) -> str:
    """Name the nodes at both ends of a topic."""
    return f"published by: {say_nodes(publishers)}\nheard by: {say_nodes(subscribers)}"


def count_ends(census: Census, topic: str) -> str:
    """Say how many nodes are at both ends of a topic, and whether we are there too."""
    publishers, subscribers = census.publishers_of(topic), census.subscribers_of(topic)
    return f"published by {_count(publishers)}, heard by {_count(subscribers)}"


def _count(nodes: Nodes) -> str:
    if nodes.ours is None:
        return str(len(nodes.others) or "nobody")
    return f"{len(nodes.others)} and mapspeak" if nodes.others else "mapspeak alone"


def say_node(name: str, links: NodeLinks, own: OwnEnds) -> str:
    """Say what a node publishes, hears and serves, with a mark on what it does for us."""
    is_ours = bool(own.node) and name.endswith(f"/{own.node}")
    told = {
        "publishes": _mark_ours(links.publishes, own.publishes if is_ours else ()),
        "hears": _mark_ours(links.subscribes, own.subscribes if is_ours else ()),
        "serves": links.serves,
    }
    lines = [
        f"{does}: {list_some(each, most=MOST_NAMED) or 'nothing'}" for does, each in told.items()
    ]
    return "\n".join([name, *lines])


def say_quality(quality: TopicQuality | None, dialect: Dialect, link: str) -> list[str]:
    """Say the quality of service of a topic's ends, and why a subscriber is not served.

    Args:
        quality: None where it is not told.
        dialect: ROS 1 has no quality of service.
        link: The kind of our connection.
    """
    if quality is None:
        is_ros1 = dialect is Dialect.ROS1
        return [f"QoS: {'ROS 1 has none' if is_ros1 else f'not known: {link} does not tell it'}"]
    ends = {"published": quality.publishers, "heard": quality.subscribers}
    said = "; ".join(f"{what} {_say_ends(each)}" for what, each in ends.items())
    lines = [f"QoS: {said}"]
    pairs = [(one, other) for one in quality.publishers for other in quality.subscribers]
    if any(other.is_reliable and not one.is_reliable for one, other in pairs):
        lines.append("MISMATCH: reliable is wanted, best effort is offered: nothing comes there")
    if any(other.is_latched and not one.is_latched for one, other in pairs):
        lines.append(
            "MISMATCH: transient local is wanted, volatile is offered: nothing comes there"
        )
    return lines


def _say_ends(ends: Sequence[EndQuality]) -> str:
    counts = Counter(
        f"{'reliable' if each.is_reliable else 'best effort'}, "
        f"{'transient local' if each.is_latched else 'volatile'}"
        for each in ends
    )
    if len(counts) < 2:
        return next(iter(counts), "by nobody")
    return " and ".join(f"{said} ({n})" for said, n in sorted(counts.items()))


def say_loose_ends(census: Census, topics: Sequence[str]) -> list[str]:
    """Name the topics without a publisher or a subscriber, and the nodes that did not answer."""
    unheard = {each: census.subscribers_of(each).ours for each in topics}
    unheard = {
        each: ours for each, ours in unheard.items() if not census.subscribers_of(each).others
    }
    told = {
        "published by nobody": [each for each in topics if not census.publishers_of(each).others],
        "heard by nobody": [each for each, ours in unheard.items() if ours is None],
        "heard by mapspeak alone": [each for each, ours in unheard.items() if ours is not None],
        "not counted, they did not answer": census.mute,
    }
    always = ("published by nobody", "heard by nobody")
    return [
        f"{what}: {list_some(names, most=MOST_NODES) or 'none'}"
        for what, names in told.items()
        if names or what in always
    ]


# --- lists


def match_names(names: Mapping[str, str] | Sequence[str], pattern: str | None) -> list[str]:
    """Return the names that a pattern fits; one without a star fits any part.

    Args:
        names: Those of a mapping are also chosen by the words of the lines that tell them.
        pattern: None fits all.
    """
    lines = names if isinstance(names, Mapping) else {name: name for name in names}
    if not pattern:
        return list(lines)
    wanted = (pattern if any(sign in pattern for sign in "*?[") else f"*{pattern}*").lower()
    return [name for name, line in lines.items() if fnmatch.filter(_words(line), wanted)]


def _words(line: str) -> list[str]:
    """Return the words of a line, types also as "package/Type"."""
    words = line.lower().split()
    return [*words, *(re.sub("/(msg|action)/", "/", each) for each in words)]


def page_of(names: Sequence[str], page: int) -> Sequence[str]:
    """Return the names on one page; 1 is the first."""
    return names[(page - 1) * PAGE_SIZE : page * PAGE_SIZE]


def list_page(
    what: str, lines: Mapping[str, str], pattern: str | None, page: int, n_all: int | None = None
) -> str:
    """Return a heading and a page of lines.

    Args:
        what: The items are, in the plural.
        lines: By name: all, or those that were chosen already.
        pattern: Fits the names that are told.
        page: 1 is the first.
        n_all: How many there are to choose from; None where all are given.
    """
    names = match_names(lines, pattern)
    n_all = len(lines) if n_all is None else n_all
    head = f"{what}: {len(names)}{'' if len(names) == n_all else f' of {n_all}'}"
    n_pages = max(1, -(-len(names) // PAGE_SIZE))
    if page > n_pages:
        last = "the only one" if n_pages == 1 else "the last"
        return f"{head}. There is no page {page}: page {n_pages} is {last}."
    head += f", page {page} of {n_pages}" if n_pages > 1 else ""
    return "\n".join([head, *(lines[name] for name in page_of(names, page))])


# --- all of it


def say_overview(
    graph: RosGraph,
    counts: Mapping[str, int],
    actions: Sequence[str],
    *,
    connected_s: float | None,
    time_s: float | None,
) -> str:
    """Say which ROS it is, how many of all there are, and the topics that are asked for most.

    Args:
        graph: The topics.
        counts: By what is counted.
        actions: Their names.
        connected_s: For how long, in wall time; None without a connection.
        time_s: Robot time; None where the robot does not say.
    """
    number = "1" if graph.dialect is Dialect.ROS1 else "2"
    head = f"ROS {number} {graph.distro}".rstrip()
    head += "" if connected_s is None else f", connected for {connected_s:.0f} s"
    head += "" if time_s is None else f", robot time {time_s:.1f} s"
    told = {what: graph.topics_of(*types) for what, types in NOTABLE.items()}
    notable = [f"{what}: {list_some(each, most=MOST_NAMED)}" for what, each in told.items() if each]
    counted = ", ".join(f"{what}: {n}" for what, n in counts.items())
    named = list_some(actions, most=MOST_NAMED) or "none"
    return "\n".join([f"{head}.", counted, *notable, f"actions: {named}"])
