"""What things stand together, as anybody would say: a fridge near an oven, not near a toilet.

Only rooms that are furnished alike nearly everywhere are told apart; of all other words this says
nothing. What the model says of its pictures counts for more.
"""

import re

__all__ = ["find_company_score"]

KITCHEN = (
    *("kitchen", "break room", "fridge", "refrigerator", "freezer", "oven", "stove", "microwave"),
    *("dishwasher", "kettle", "toaster", "coffee machine", "coffee maker", "sink"),
)
BATHROOM = ("bathroom", "restroom", "toilet", "urinal", "shower", "bathtub", "towel", "sink")
OFFICE = (
    *("office", "desk", "computer", "laptop", "monitor", "keyboard", "printer", "copier"),
    *("whiteboard", "filing cabinet"),
)
LIVING_ROOM = ("living room", "lounge", "sofa", "couch", "armchair", "television", "coffee table")
BEDROOM = ("bedroom", "bed", "mattress", "pillow", "wardrobe", "nightstand")
STORE = ("warehouse", "pallet", "crate", "forklift", "loaded shelf")
ROOMS = (KITCHEN, BATHROOM, OFFICE, LIVING_ROOM, BEDROOM, STORE)
AMONG_ITS_LIKE = 0.8
"""The score of a place where something stands that belongs to the same room."""
AMONG_STRANGERS = 0.3
"""The score of a place where something stands that belongs to another one."""

_PATTERNS = tuple(
    re.compile(rf"\b(?:{'|'.join(words)})(?:s|es)?\b", re.IGNORECASE) for words in ROOMS
)


def find_company_score(words: str, thing: str) -> float | None:
    """Finds how likely a thing is near what words name, from 0 to 1; None where nobody can say."""
    named, wanted = _rooms_of(words), _rooms_of(thing)
    if not named or not wanted:
        return None
    shared_ratio = len(named & wanted) / len(named)
    return AMONG_STRANGERS + (AMONG_ITS_LIKE - AMONG_STRANGERS) * shared_ratio


def _rooms_of(words: str) -> frozenset[int]:
    """Gives the rooms that things of some words belong to, by their numbers."""
    return frozenset(index for index, room in enumerate(_PATTERNS) if room.search(words))
