"""What objects look like, and what the laser and the bumper feel of them."""

from mapspeak.simulator.models.catalogue import KINDS, build_parts, find_kind, footprint
from mapspeak.simulator.models.kinds import Category, Kind
from mapspeak.simulator.models.parts import Part
from mapspeak.simulator.models.surfaces import Surface

__all__ = [
    "KINDS",
    "Category",
    "Kind",
    "Part",
    "Surface",
    "build_parts",
    "find_kind",
    "footprint",
]
