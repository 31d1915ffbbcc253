"""Why an observation was found, in words: one for each filter that it has passed."""

from mapspeak.memory.episodes.observation import EpisodeFilter, EpisodeMatch
from mapspeak.memory.quoting import quote, quote_name

_NOT_SHOWN = (EpisodeFilter.WORDS, EpisodeFilter.MEANING, EpisodeFilter.LABEL)
"""The filters that an observation does not show itself to have passed."""


def say_reasons(match: EpisodeMatch) -> list[str]:
    """Say why an observation is there, one reason for each filter."""
    return [_say_reason(each, match) for each in match.filters]


def say_evidence(match: EpisodeMatch) -> str:
    """Say those reasons that the observation itself does not show."""
    return "; ".join(_say_reason(each, match) for each in match.filters if each in _NOT_SHOWN)


def _say_reason(passed: EpisodeFilter, match: EpisodeMatch) -> str:
    seen = match.observation
    return {
        EpisodeFilter.WORDS: f"says {', '.join(map(quote, match.fitting))}",
        EpisodeFilter.MEANING: f"means nearly {', '.join(map(quote_name, match.fitting))} "
        f"({match.score_ratio or 0:.2f})",
        EpisodeFilter.PLACE: f"{match.distance_m or 0:.2f} m from {_say_place(match)}",
        EpisodeFilter.ROOM: f"in {seen.room_id}",
        EpisodeFilter.LABEL: f"label {quote_name(match.label or '')}",
        EpisodeFilter.TIME: f"at {seen.recorded_at.isoformat(timespec='seconds')}",
        EpisodeFilter.KIND: f"a {seen.kind}",
        EpisodeFilter.MAP: f"on the map {seen.map_id}",
    }[passed]


def _say_place(match: EpisodeMatch) -> str:
    place = "" if match.near is None else f"({match.near.x:.2f}, {match.near.y:.2f})"
    return place if match.near_id is None else f"where {match.near_id} was made, {place}"
