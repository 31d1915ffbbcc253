"""Which map remembered places belong to: told from its walls, and moved when the map moves."""

from mapspeak.memory.alignment.fitting import LEAST_SHARED_M, Certainty, MapFit, find_fit
from mapspeak.memory.alignment.keeping import (
    MapComparison,
    MapKeeper,
    MapRelation,
    RealignReceipt,
    SnapshotFolder,
    compare_maps,
)
from mapspeak.memory.alignment.surfaces import MapAgreement, MapSurfaces, placed

__all__ = [
    "LEAST_SHARED_M",
    "Certainty",
    "MapAgreement",
    "MapComparison",
    "MapFit",
    "MapKeeper",
    "MapRelation",
    "MapSurfaces",
    "RealignReceipt",
    "SnapshotFolder",
    "compare_maps",
    "find_fit",
    "placed",
]
