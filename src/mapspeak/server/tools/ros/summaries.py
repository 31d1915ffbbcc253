"""Topics whose messages are told together: the log of all nodes, and diagnostics."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence

from mapspeak.errors import LinkError
from mapspeak.ros.messages.fields import Message, parts_of, text_of
from mapspeak.server.tools.ros.reports import show_value

MOST_SUMMED = 1000
"""Messages; what came before them is forgotten."""
MOST_LINES = 30
MOST_VALUES = 8
LOG_LEVELS = {10: "DEBUG", 20: "INFO", 30: "WARN", 40: "ERROR", 50: "FATAL"} | {
    1: "DEBUG",
    2: "INFO",
    4: "WARN",
    8: "ERROR",
    16: "FATAL",
}
"""By level in rcl_interfaces/Log, then in rosgraph_msgs/Log."""
SEVERITY = ("FATAL", "ERROR", "WARN", "INFO", "DEBUG", "level unknown")
STATES = {0: "OK", 1: "WARN", 2: "ERROR", 3: "STALE"}
"""By level in diagnostic_msgs/DiagnosticStatus."""
WORST_FIRST = ("ERROR", "STALE", "WARN", "level unknown", "OK")


def summarize_log(messages: Sequence[Message]) -> str:
    """Return how many lines came at each level, then each different line once, the worst first."""
    lines = Counter(_read_line(message) for message in messages)
    levels: Counter[str] = Counter()
    for (level, _), n in lines.items():
        levels[level] += n
    told = sorted(lines.items(), key=lambda item: (SEVERITY.index(item[0][0]), -item[1]))
    said = [f"{level} {line}{f' ({n} times)' if n > 1 else ''}" for (level, line), n in told]
    return _list(levels, SEVERITY, said)


def summarize_diagnostics(messages: Sequence[Message]) -> str:
    """Return how many parts are in each state, then those that are not OK with their values.

    Several nodes publish the diagnostics of their own parts: the latest state of each counts.
    """
    latest: dict[str, tuple[str, Message]] = {}
    n_refused = 0
    for message in messages:
        try:
            for part in parts_of(message, "status"):
                latest[text_of(part, "name")] = _read_state(part)
        except LinkError:
            n_refused += 1
    states = Counter(state for state, _ in latest.values())
    bad = [(state, name, part) for name, (state, part) in latest.items() if state != "OK"]
    bad.sort(key=lambda each: (WORST_FIRST.index(each[0]), each[1]))
    said = [
        f"{state} {show_value(name)}: {show_value(part.get('message', ''))}{_say_values(part)}"
        for state, name, part in bad
    ]
    if n_refused:
        said.append(f"{n_refused} messages could not be read")
    return _list(states, WORST_FIRST, said)


def _read_line(message: Message) -> tuple[str, str]:
    level = message.get("level")
    known = LOG_LEVELS.get(level) if isinstance(level, int) else None
    node, text = message.get("name", ""), message.get("msg", "")
    return known or SEVERITY[-1], f"{show_value(node)}: {show_value(text)}"


def _read_state(part: object) -> tuple[str, Message]:
    if not isinstance(part, Mapping):
        raise LinkError("A diagnostic status is no message.", hint="Look at the node that sends.")
    level = part.get("level")
    if isinstance(level, bytes) and len(level) == 1:
        level = level[0]  # rclpy hands out a ROS byte so.
    known = STATES.get(level) if isinstance(level, int) else None
    return known or "level unknown", part


def _say_values(part: Message) -> str:
    values = part.get("values")
    listed = values if isinstance(values, list | tuple) else ()
    pairs = [each for each in listed if isinstance(each, Mapping)]
    if not pairs:
        return ""
    said = [
        f"{show_value(each.get('key', ''))} = {show_value(each.get('value', ''))}"
        for each in pairs[:MOST_VALUES]
    ]
    more = f", {len(pairs) - MOST_VALUES} more" if len(pairs) > MOST_VALUES else ""
    return f" [{', '.join(said)}{more}]"


def _list(counts: Counter[str], order: Sequence[str], lines: Sequence[str]) -> str:
    head = ", ".join(f"{counts[level]} {level}" for level in order if counts[level])
    more = [f"... {len(lines) - MOST_LINES} more"] if len(lines) > MOST_LINES else []
    return "\n".join([head or "nothing in it", *lines[:MOST_LINES], *more])


SUMMARIES: Mapping[str, Callable[[Sequence[Message]], str]] = {
    "rcl_interfaces/Log": summarize_log,
    "rosgraph_msgs/Log": summarize_log,
    "diagnostic_msgs/DiagnosticArray": summarize_diagnostics,
}
"""By type, named as "package/Type"."""
