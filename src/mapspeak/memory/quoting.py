"""Clean, compare and quote remembered text, so that it cannot break out of its quotes."""

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
    """Return the key that all spellings of a place's name share: no case, no spaces."""
    return clean_line(unicodedata.normalize("NFKC", name).casefold())


LONGEST_NAME = 120
"""Limit for writes; files written by others may have longer names."""
_AS_APOSTROPHE = dict.fromkeys(
    map(ord, '"\u201c\u201d\u201e\u201f\u2033\u2036\u301d\u301e\uff02'), "'"
)
_ID = re.compile(r"[\w./-]{1,100}")


def quote(text: str, *, most: int | None = None) -> str:
    """Return a text on one line between double quotes, with none inside.

    Otherwise text after a quote inside could pass for ours: `"` and look-alikes become `'`, line
    breaks and control characters become spaces. A backslash at the end escapes nothing.

    Args:
        most: Number of first characters to keep; None for all.
    """
    line = clean_line(text).translate(_AS_APOSTROPHE)[:most]
    return f'"{line} "' if line.endswith("\\") else f'"{line}"'


def quote_name(name: str) -> str:
    """Return the name of a place or thing in quotes, cut to the length of names."""
    return quote(name, most=LONGEST_NAME)


def tell_name(name: str) -> str:
    """Return an id or the name of a file; quoted where it does not read like one."""
    return name if _ID.fullmatch(name) else quote_name(name)
