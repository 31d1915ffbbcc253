"""Remembered text between quotes: whatever it says, it cannot end them."""

import re

from mapspeak.semantic.waypoint import clean_line

__all__ = ["quote", "quote_name", "tell_name"]

LONGEST_NAME = 120
"""What writes allow; a file that somebody else wrote may have any."""
_ID = re.compile(r"[\w./-]{1,100}")


def quote(text: str, *, most: int | None = None) -> str:
    """Gives a text on one line between double quotes, with none inside.

    What is told beside it would else be taken for ours: `"` becomes `'`, and line breaks and
    control signs become spaces.

    Args:
        text: What was observed, or what somebody said.
        most: At most so many of its first characters; None for all.
    """
    line = clean_line(text).replace('"', "'")
    return f'"{line[:most]}"'


def quote_name(name: str) -> str:
    """Gives what a place or a thing is called, as a quote that is no longer than names are."""
    return quote(name, most=LONGEST_NAME)


def tell_name(name: str) -> str:
    """Gives an id or the name of a file; quoted where it does not read like one."""
    return name if _ID.fullmatch(name) else quote_name(name)
