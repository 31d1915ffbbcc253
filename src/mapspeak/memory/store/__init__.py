"""The semantic map file as text: read with the place of every fault, edited with comments kept.

Nothing here opens a file; `mapspeak.memory.store.semanticmap` does.
"""

from mapspeak.memory.store.document import MapDocument, parse_document
from mapspeak.memory.store.rewriting import (
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
