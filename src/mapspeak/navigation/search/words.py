"""Whether a few words speak of the thing that is looked for."""

from mapspeak.geometry import Pose
from mapspeak.semantic import SemanticMap, Waypoint, find_waypoints

__all__ = ["speaks_of"]


def speaks_of(words: str, thing: str) -> bool:
    """True when words, such as a detector's label, name a thing; by the rules of the memory."""
    if not words.strip():
        return False
    named = Waypoint(name=words, pose=Pose(0.0, 0.0))
    return bool(find_waypoints(SemanticMap(waypoints=(named,)), thing))
