"""YAML layout of records: one line per key, and one line for each nested value without lines."""

import json
import re

from mapspeak.memory.store.yamltext import Bare, Data

MAX_COLUMNS = 100
"""A list that would be wider stands with one item a line."""

_OTHER_MEANING = frozenset({"true", "false", "yes", "no", "on", "off", "null", "y", "n"})
_WORD = re.compile(r"\w[\w. -]*")
_SPECIAL_IN_BLOCK = re.compile(r":(?= |$)| #")
_SPECIAL_IN_FLOW = re.compile(r"[,\[\]{}:#?]")


def is_plain(text: str) -> bool:
    """Return True if every YAML reader reads the unquoted text, on its own line, unchanged."""
    return (
        text[:1].isalpha()
        and text.isprintable()
        and not text.endswith(" ")
        and not _SPECIAL_IN_BLOCK.search(text)
        and text.casefold() not in _OTHER_MEANING
    )


def is_plain_in_flow(text: str) -> bool:
    """Return True when every YAML reader takes the unquoted text, within brackets, for itself."""
    return is_plain(text) and not _SPECIAL_IN_FLOW.search(text)


def flow_text(data: Data) -> str:
    """Return a value on one line, as it may stand within brackets."""
    if data is None:
        return "null"
    if isinstance(data, str):
        is_bare = isinstance(data, Bare) and data.isprintable() and not _is_special(data)
        # JSON's quotes are YAML's, except for characters that it would write as surrogate pairs.
        return data if is_bare or is_plain_in_flow(data) else json.dumps(data, ensure_ascii=False)
    if isinstance(data, list):
        return f"[{', '.join(map(flow_text, data))}]"
    entries = (
        f"{key if _WORD.fullmatch(key) else json.dumps(key)}: {flow_text(data[key])}"
        for key in data
    )
    return f"{{{', '.join(entries)}}}"


def _is_special(text: str) -> bool:
    return not text or bool(_SPECIAL_IN_FLOW.search(text.replace(":", "")) or ": " in text)


def line_text(data: Data) -> str:
    """Return a value that ends its line, outside of brackets."""
    return data if isinstance(data, str) and is_plain(data) else flow_text(data)


def entry_text(key: str, data: Data, *, indent: int, comments: str = "") -> str:
    """Return `key: value` without the first line's indentation, over several lines where needed.

    Args:
        comments: To stand at the end of the first line.
    """
    below, behind = "\n" + " " * (indent + 2), comments and f"  {comments}"
    if isinstance(data, str) and "\n" in data:
        lines = (below + line if line else "\n" for line in data.split("\n"))
        return f"{key}: |-{behind}{''.join(lines)}"
    if isinstance(data, list):
        has_mapping = any(isinstance(item, dict) for item in data)
        if has_mapping or len(key) + indent + len(flow_text(data)) > MAX_COLUMNS:
            return f"{key}:{behind}" + "".join(f"{below}- {line_text(item)}" for item in data)
    return f"{key}: {line_text(data)}{behind}"


def record_text(data: dict[str, Data], *, indent: int) -> str:
    """Return one item of a list of records, with its final line break."""
    margin = " " * (indent + 2)
    entries = [entry_text(key, value, indent=indent + 2) for key, value in data.items()]
    return " " * indent + "- " + f"\n{margin}".join(entries) + "\n"
