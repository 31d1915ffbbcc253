"""Observations by the things they show: without one, and the rooms of where these are."""

from collections.abc import Callable, Mapping
from dataclasses import replace

from mapspeak.memory.episodes.observation import EpisodeMatch, EpisodePage, EpisodeQuery
from mapspeak.memory.things.labels import name_the_same
from mapspeak.worldmodel.model import WorldModel

ALL = 1_000_000


def leave_out_label(
    label: str, query: EpisodeQuery, find: Callable[[EpisodeQuery], EpisodePage]
) -> EpisodePage:
    """Return a page of what passes a query and shows nothing of that label."""
    every = find(replace(query, limit=ALL, offset=0))
    left = tuple(
        match
        for match in every.matches
        if not any(name_the_same(each, label) for each in match.observation.labels)
    )
    end = query.offset + query.limit
    return EpisodePage(
        matches=left[query.offset : end],
        n_matches=len(left),
        next_page=replace(query, offset=end) if end < len(left) else None,
    )


def find_rooms_of_things(
    world: WorldModel, matches: Mapping[str, EpisodeMatch]
) -> dict[str, tuple[str, ...]]:
    """Return the rooms of the things that observations show, by label, where that can be told.

    Args:
        matches: The observation that shows a thing of each label.
    """
    # An observation calls its picture by its name, or by its short id.
    ids = {key: each.id for each in world.pictures for key in (each.name, each.id)}
    shown = {
        label: ids[match.observation.picture]
        for label, match in matches.items()
        if match.observation.picture in ids
    }
    things = [each for each in world.join_reported(shown) if not each.thing.is_guessed]
    found: dict[str, tuple[str, ...]] = {}
    for label, picture_id in shown.items():
        for each in things:
            views = each.thing.supporting
            if any((view.waypoint, view.landmark.label) == (picture_id, label) for view in views):
                found.setdefault(label, world.rooms_before(each))
    return found
