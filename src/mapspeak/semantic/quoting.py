"""Remembered text between quotes: whatever it says, it cannot end them."""

from mapspeak.semantic.waypoint import clean_line

__all__ = ["quote"]


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
