"""What is where, in words: remembered places and the file that holds them."""

from mapspeak.semantic.retrieval import (
    MatchEvidence,
    MatchField,
    MatchKind,
    WaypointMatch,
    find_waypoints,
)
from mapspeak.semantic.store import SemanticMapStore, WriteReceipt
from mapspeak.semantic.waypoint import Landmark, SemanticMap, Waypoint, name_key

__all__ = [
    "Landmark",
    "MatchEvidence",
    "MatchField",
    "MatchKind",
    "SemanticMap",
    "SemanticMapStore",
    "Waypoint",
    "WaypointMatch",
    "WriteReceipt",
    "find_waypoints",
    "name_key",
]
