"""Definitions as they are sent and filed: several in one text, and in the parts of a service."""

import re
from collections.abc import Iterable, Mapping

from mapspeak.ros.messages import bare_type

RULER_LINE = "=" * 80
RULER = re.compile(r"^=+\nMSG: (?P<name>\S+)\n?", re.MULTILINE)
DIVIDER = re.compile(r"^---[ \t]*$\n?", re.MULTILINE)
SERVICE_PARTS = ("Request", "Response")
ACTION_PARTS = ("Goal", "Result", "Feedback")
GENERATED = re.compile(r"_(Request|Response|Goal|Result|FeedbackMessage|Feedback)$")
"""What ROS 2 makes of services and actions; no message of a person has an underscore."""


def split_definition(type_name: str, text: str) -> dict[str, str]:
    """Return the text of a type and of each type within it, by name as "package/Type".

    Args:
        type_name: Of the first.
        text: All of them, with a ruler and "MSG: package/Type" before each but the first.
    """
    first, *rest = RULER.split(text)
    texts = {bare_type(type_name): first.strip("\n")}
    for name, part in zip(rest[::2], rest[1::2], strict=True):
        texts.setdefault(bare_type(name), part.strip("\n"))
    return texts


def write_definition(texts: Mapping[str, str], names: Iterable[str]) -> str:
    """Return the texts of some types as one, as `split_definition` reads it; the first leads."""
    first, *others = names
    parts = [f"{RULER_LINE}\nMSG: {name}\n{texts[name]}" for name in others]
    return "\n".join([texts[first], *parts])


def name_parts(type_name: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names that the parts of a service and of an action of that type would have."""
    bare = bare_type(type_name)
    return (
        tuple(f"{bare}_{part}" for part in SERVICE_PARTS),
        tuple(f"{bare}_{part}" for part in ACTION_PARTS),
    )


def split_parts(type_name: str, text: str) -> dict[str, str]:
    """Return the texts of a message, or of the parts of a service or an action, by their names.

    Args:
        type_name: As "package/Type".
        text: As in a .msg, .srv or .action file; two parts are a service, three an action.
    """
    parts = [part.strip("\n") for part in DIVIDER.split(text)]
    names = {2: name_parts(type_name)[0], 3: name_parts(type_name)[1]}.get(len(parts))
    if names is None:
        return {bare_type(type_name): parts[0]}
    return dict(zip(names, parts, strict=True))


def kinds_of(texts: Iterable[str]) -> dict[str, str]:
    """Return the kind of each type by its name: "msg", "srv" or "action", where parts are named."""
    kinds: dict[str, str] = {}
    for name in texts:
        part = GENERATED.search(name)
        if part is None:
            kinds.setdefault(name, "msg")
        else:
            kind = "srv" if part[1] in SERVICE_PARTS else "action"
            kinds[name.removesuffix(part[0])] = kind
    return kinds


def find_actions_of_ros1(texts: Mapping[str, str]) -> dict[str, str]:
    """Return parts of actions, which ROS 1 writes as messages of their own, named as ROS 2's."""
    named = (name.removesuffix("ActionGoal") for name in texts if name.endswith("ActionGoal"))
    return {
        f"{action}_{part}": texts[f"{action}{part}"]
        for action in named
        for part in ACTION_PARTS
        if f"{action}{part}" in texts
    }
