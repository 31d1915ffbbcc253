"""What words mean which thing: the little a script knows of the world."""

import re

__all__ = ["find_label"]

CUES = (
    ("hand-held device|water comes from the wall", "fire hose reel"),
    ("[Ff]ire|burning|puts it out|flames|smoulder", "fire extinguisher"),
    ("bandage|plaster|bleeding", "first-aid box"),
    ("leave the building|way outside", "exit sign"),
    ("[Aa]cid|rinsed", "eye wash station"),
    ("climb", "ladder"),
    ("battery|plugged in", "charging dock"),
    ("heavy load", "forklift"),
    ("write a letter", "desk"),
    ("files are kept", "filing cabinet"),
    ("lie down", "sofa"),
    ("sketch", "whiteboard"),
    ("on paper", "printer"),
    ("kept cold", "fridge"),
    ("hot drink", "coffee machine"),
    ("wash", "sink"),
    ("privacy", "toilet"),
    ("apple", "trash bin"),
)


def find_label(wish: str) -> str | None:
    """Gives the thing that is meant; None where no word is known."""
    return next((label for words, label in CUES if re.search(words, wish)), None)
