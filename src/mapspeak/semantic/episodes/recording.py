"""Records of the semantic map as observations, and the pictures that they name."""

from collections.abc import Iterator

from mapspeak.semantic.episodes.observation import Observation, ObservationKind
from mapspeak.semantic.waypoint import SemanticMap, Waypoint

__all__ = ["named_pictures", "observations_from"]


def observations_from(waypoint: Waypoint) -> tuple[Observation, ...]:
    """Gives the writing of a record as an observation; nothing where its time is not known."""
    if waypoint.recorded_at is None:
        return ()
    said = (waypoint.name, waypoint.description, *waypoint.geometric_features)
    return (
        Observation(
            recorded_at=waypoint.recorded_at,
            stamp_s=waypoint.stamp_s,
            pose=waypoint.pose,
            map_id=waypoint.map_id,
            room_id=waypoint.room_id,
            kind=ObservationKind.RECORD,
            text="\n".join(filter(None, said)),
            labels=tuple(landmark.label for landmark in waypoint.landmarks),
            picture=waypoint.picture,
        ),
    )


def named_pictures(semantic_map: SemanticMap) -> frozenset[str]:
    """Gives the pictures that waypoints and their landmarks name."""
    return frozenset(_names(semantic_map))


def _names(semantic_map: SemanticMap) -> Iterator[str]:
    for waypoint in semantic_map.waypoints:
        pictures = (waypoint.picture, *(landmark.picture for landmark in waypoint.landmarks))
        yield from filter(None, pictures)
