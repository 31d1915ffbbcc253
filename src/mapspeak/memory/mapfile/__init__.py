"""The semantic map file as text: read with the place of every fault, edited with comments kept.

Nothing here opens a file; `mapspeak.memory.mapfile.store` does.
"""

from mapspeak.memory.mapfile.document import MapDocument, parse_document
from mapspeak.memory.mapfile.rewriting import (
    bound_to,
    moved,
    with_event,
    with_waypoint,
    without_waypoint,
)

__all__ = [
    "MapDocument",
    "bound_to",
    "moved",
    "parse_document",
    "with_event",
    "with_waypoint",
    "without_waypoint",
]
