"""All that is to be said of one remembered place or thing."""

from mapspeak.places.choosing import stand_at
from mapspeak.places.goalcheck import judge_goal
from mapspeak.places.naming import Place
from mapspeak.places.recall.answer import RecallCandidate
from mapspeak.places.recall.filters import find_rooms, last_seen, list_views
from mapspeak.semantic.retrieval import EntryKind
from mapspeak.worldmodel.model import Atlas, RememberedPlace, RememberedThing
from mapspeak.worldmodel.recollection import Remembered

__all__ = ["describe_candidate"]


def describe_candidate(
    atlas: Atlas, remembered: Remembered, *, score_ratio: float = 1.0, evidence: str = ""
) -> RecallCandidate:
    """Gives what is known of a place or thing, and the pose in which a robot would stand for it.

    Args:
        atlas: The map with the memory.
        remembered: The place or thing.
        score_ratio: How alike it and a request are.
        evidence: Why it is meant, in words.
    """
    if isinstance(remembered, RememberedPlace):
        return _describe_place(atlas, remembered, score_ratio, evidence)
    return _describe_thing(atlas, remembered, score_ratio, evidence)


def _describe_place(
    atlas: Atlas, remembered: RememberedPlace, score_ratio: float, evidence: str
) -> RecallCandidate:
    waypoint = remembered.waypoint
    pose = stand_at(atlas, Place(remembered.id, remembered))
    check = judge_goal(atlas.grid, atlas.distances, pose, opened=atlas.map.open.distances_from)
    return RecallCandidate(
        id=remembered.id,
        kind=EntryKind.PLACE,
        name=waypoint.name,
        score_ratio=score_ratio,
        evidence=evidence,
        seen_from=(remembered.id,),
        pictures=() if waypoint.picture is None else (waypoint.picture,),
        position=waypoint.pose.point,
        uncertainty_m=None,
        room_ids=find_rooms(atlas, remembered),
        pose=pose,
        is_faced=False,
        faced_ratio=0.0,
        problem="" if check.is_ok else check.sentence,
        path_m=check.path_m,
        last_seen=last_seen(atlas, remembered),
        trust=atlas.judge.judge_place(remembered),
    )


def _describe_thing(
    atlas: Atlas, remembered: RememberedThing, score_ratio: float, evidence: str
) -> RecallCandidate:
    thing = remembered.thing
    pose = stand_at(atlas, Place(remembered.id, remembered))
    check = judge_goal(atlas.grid, atlas.distances, pose, opened=atlas.map.open.distances_from)
    views = list(list_views(atlas, remembered))
    pictures = (view.picture for _, view in views)
    return RecallCandidate(
        id=remembered.id,
        kind=EntryKind.THING,
        name=thing.label,
        score_ratio=score_ratio,
        evidence=evidence,
        seen_from=tuple(dict.fromkeys(place.id for place, _ in views)),
        pictures=tuple(dict.fromkeys(filter(None, pictures))),
        position=thing.position,
        uncertainty_m=thing.uncertainty_m,
        room_ids=find_rooms(atlas, remembered),
        pose=pose,
        is_faced=atlas.find_approach(remembered) is not None,
        faced_ratio=atlas.measure_faced(remembered),
        problem="" if check.is_ok else check.sentence,
        path_m=check.path_m,
        last_seen=last_seen(atlas, remembered),
        trust=atlas.judge.judge_thing(remembered),
    )
