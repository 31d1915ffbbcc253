"""Which map remembered places belong to: told from its walls, and moved when the map moves."""

from mapspeak.semantic.alignment.comparing import (
    MapComparison,
    MapRelation,
    SnapshotFolder,
    compare_maps,
    say_comparison,
)
from mapspeak.semantic.alignment.fitting import Certainty, MapFit, find_fit
from mapspeak.semantic.alignment.keeping import MapKeeper, RealignReceipt
from mapspeak.semantic.alignment.surfaces import MapAgreement, MapSurfaces, placed

__all__ = [
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
    "say_comparison",
]
