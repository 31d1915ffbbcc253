"""Remembered text on clean lines, compared, and told between quotes that it cannot end."""

import re
import unicodedata

_JOINERS = "\u200c\u200d"
"""Invisible, yet part of how Persian, Indic and emoji words are written."""


def clean_line(text: str) -> str:
    """Return the text on one line: every run of spaces and unprintable characters is one space."""
    if not text.isprintable():
        text = "".join(c if c.isprintable() or c in _JOINERS else " " for c in text)
    return " ".join(text.split())


def clean_text(text: str) -> str:
    """Return the text with every line cleaned and empty lines at its ends cut."""
    lines = text.replace("\r\n", "\n").split("\n")
    return "\n".join(map(clean_line, lines)).strip("\n")


def name_key(name: str) -> str:
    """Return what the spellings of a place's name have in common: no case, no spaces."""
    return clean_line(unicodedata.normalize("NFKC", name).casefold())


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
