"""The memory for other programs, and two memories as one."""

from mapspeak.memory.exchange.geojson import facts_of, from_geojson, place_of, to_geojson
from mapspeak.memory.exchange.uniting import Union, merge_files, merge_into, unite

__all__ = [
    "Union",
    "facts_of",
    "from_geojson",
    "merge_files",
    "merge_into",
    "place_of",
    "to_geojson",
    "unite",
]
