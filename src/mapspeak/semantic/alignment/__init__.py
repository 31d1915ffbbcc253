"""Which map remembered places belong to: told from its walls, and moved when the map moves."""

from mapspeak.semantic.alignment.agreement import Agreement
from mapspeak.semantic.alignment.comparing import MapComparison, MapRelation, compare_maps
from mapspeak.semantic.alignment.fitting import Certainty, MapFit, find_fit
from mapspeak.semantic.alignment.keeping import MapKeeper, RealignReceipt
from mapspeak.semantic.alignment.snapshot import SnapshotFolder
from mapspeak.semantic.alignment.surfaces import MapSurfaces, placed

__all__ = [
    "Agreement",
    "Certainty",
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
