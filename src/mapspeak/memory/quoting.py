"""Remembered text between quotes: whatever it says, it cannot end them."""

import re

from mapspeak.memory.waypoint import clean_line

LONGEST_NAME = 120
"""What writes allow; a file that somebody else wrote may have any."""
_AS_APOSTROPHE = dict.fromkeys(
    map(ord, '"\u201c\u201d\u201e\u201f\u2033\u2036\u301d\u301e\uff02'), "'"
)
_ID = re.compile(r"[\w./-]{1,100}")


def quote(text: str, *, most: int | None = None) -> str:
    """Return a text on one line between double quotes, with none inside.

    What is told beside it would else be taken for ours: `"` and what looks like it become `'`, and
    line breaks and control signs become spaces. A backslash at the end escapes nothing.

    Args:
        text: What was observed, or what somebody said.
        most: At most so many of its first characters; None for all.
    """
    line = clean_line(text).translate(_AS_APOSTROPHE)[:most]
    return f'"{line} "' if line.endswith("\\") else f'"{line}"'


def quote_name(name: str) -> str:
    """Return what a place or a thing is called, as a quote that is no longer than names are."""
    return quote(name, most=LONGEST_NAME)


def tell_name(name: str) -> str:
    """Return an id or the name of a file; quoted where it does not read like one."""
    return name if _ID.fullmatch(name) else quote_name(name)
