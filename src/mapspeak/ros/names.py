"""What ROS allows as a name, and as the name of a type."""

import difflib
import re
import uuid
from collections.abc import Iterable

NAME = re.compile(r"[~/]?[A-Za-z_][A-Za-z0-9_]*(?:/[A-Za-z_][A-Za-z0-9_]*)*")
TYPE = re.compile(r"[A-Za-z]\w*(?:/(?:msg|srv|action))?/[A-Za-z]\w*")


def new_id() -> str:
    """Gives an id that no other client of the same robot uses: 32 hex digits."""
    return uuid.uuid4().hex


def find_nearest(name: str, names: Iterable[str], *, most: int = 3) -> list[str]:
    """Gives the names most like one, the most alike first: what somebody may have meant."""
    known = list(names)
    last = name.rstrip("/").rpartition("/")[2].lower()
    ending = [each for each in known if last and each.lower().endswith(f"/{last}")]
    like = difflib.get_close_matches(name, known, n=most, cutoff=0.5)
    return list(dict.fromkeys([*ending, *like]))[:most]
