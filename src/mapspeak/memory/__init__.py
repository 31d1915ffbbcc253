"""Remembered places in words, and the file that holds them."""

from mapspeak.memory.laserfan import LaserFan, LaserRing, build_ring
from mapspeak.memory.merging import (
    SAME_SPOT_M,
    SAME_VIEW_RAD,
    Merge,
    Reunion,
    group_views,
    merge_waypoint,
    noted_at,
    seen_from,
)
from mapspeak.memory.pictures import PictureBook, PictureReading, TakenPicture
from mapspeak.memory.policy import (
    LEFT_OUT,
    Concern,
    find_concern,
    find_passing,
    gives_orders,
    is_purpose,
    tells_what_to_do,
)
from mapspeak.memory.quoting import name_key
from mapspeak.memory.store.memorystore import MemoryStore, WriteReceipt
from mapspeak.memory.store.semanticmap import SemanticMapStore
from mapspeak.memory.waypoint import Confidence, Landmark, SemanticMap, Waypoint

__all__ = [
    "LEFT_OUT",
    "SAME_SPOT_M",
    "SAME_VIEW_RAD",
    "Concern",
    "Confidence",
    "Landmark",
    "LaserFan",
    "LaserRing",
    "MemoryStore",
    "Merge",
    "PictureBook",
    "PictureReading",
    "Reunion",
    "SemanticMap",
    "SemanticMapStore",
    "TakenPicture",
    "Waypoint",
    "WriteReceipt",
    "build_ring",
    "find_concern",
    "find_passing",
    "gives_orders",
    "group_views",
    "is_purpose",
    "merge_waypoint",
    "name_key",
    "noted_at",
    "seen_from",
    "tells_what_to_do",
]
