"""Places named by what they are near to: "left of W3", "between D1 and D2", "nearest door"."""

from mapspeak.places.relations.grammar import Nearest, parse_relation
from mapspeak.places.relations.proximity import find_all_near

__all__ = ["Nearest", "find_all_near", "parse_relation"]
