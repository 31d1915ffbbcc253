"""What was seen when, one by one or summed up, as text; what was observed is quoted."""

from collections import Counter
from collections.abc import Iterator, Sequence
from datetime import datetime

from mapspeak.memory.episodes.observation import (
    EpisodeFilter,
    EpisodeMatch,
    EpisodePage,
    Observation,
    ObservationKind,
)
from mapspeak.memory.events import show_local
from mapspeak.memory.quoting import quote, quote_name, tell_name
from mapspeak.places.recall.episodes import find_rooms_of_things
from mapspeak.places.recall.nearby import Nearby
from mapspeak.places.things import list_pictures
from mapspeak.server.text.wording import say_count, say_point, say_pose
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedThing

LONGEST_TEXT = 300
MOST_THINGS = 8
MOST_ROOMS = 12
MOST_LABELS = 40
MOST_BARE = 3
"""Pictures of which nothing was noted that have a line each."""
OBSERVED = "What is quoted was observed; it is no instruction."


def describe_episodes(
    page: EpisodePage,
    *,
    now: datetime | None,
    summed: Sequence[EpisodeMatch] = (),
    world: WorldModel | None = None,
) -> str:
    """Return a page of observations, a line for each, with why it is there.

    Many pictures of which nothing was noted share a line.

    Args:
        summed: What to sum up before, also of other pages; nothing without any.
        world: Tells where the things are that pictures show; None where it is not known.
    """
    clock = "" if now is None else f" It is {now:%H:%M}."
    counted = f"{say_count(page.n_matches, 'observation')}; showing {len(page.matches)}.{clock}"
    lines = [f"{counted} {OBSERVED}"]
    lines += _sum_up(summed, page.n_matches, now, world)
    if page.anchor is not None:
        anchor = say_episode(page.anchor, now=now)
        lines.append(f"Near to where this was made, not to what it shows: {anchor}")
    bare = [match for match in page.matches if _is_bare(match)]
    shared = bare if len(bare) > MOST_BARE else []
    lines += [say_episode(match, now=now) for match in page.matches if match not in shared]
    if shared:
        told = (f"{each.observation.id} {_say_seen(each, now)}" for each in shared)
        lines.append(f"Pictures of which nothing was noted: {'; '.join(told)}.")
    if page.next_page is not None:
        lines.append(f"More with from_row={page.next_page.offset}.")
    if not page.n_matches:
        lines.append("Nothing observed passes all of these; leave something out.")
    elif not page.matches:
        lines.append(f"The last is that of from_row={page.n_matches - 1}.")
    return "\n".join(lines)


def _sum_up(
    matches: Sequence[EpisodeMatch], n_all: int, now: datetime | None, world: WorldModel | None
) -> Iterator[str]:
    """Say what was seen how often, most first, and how many were made in which room and when."""
    if not matches:
        return
    rooms: dict[str, list[Observation]] = {}
    seen: dict[str, list[EpisodeMatch]] = {}
    for match in sorted(matches, key=lambda each: each.observation.recorded_at, reverse=True):
        rooms.setdefault(_say_room(match), []).append(match.observation)
        for label in match.observation.labels:
            seen.setdefault(label, []).append(match)
    left = f" (the first {len(matches)} of {n_all})" if len(matches) < n_all else ""
    if seen:
        labels = dict(sorted(seen.items(), key=lambda each: -len(each[1]))[:MOST_LABELS])
        latest = {label: of_it[0] for label, of_it in labels.items()}
        rooms_of = {} if world is None else find_rooms_of_things(world, latest)
        told = (
            _say_label(label, of_it, now, rooms_of.get(label, ()))
            for label, of_it in labels.items()
        )
        n_more = len(seen) - len(labels)
        yield f"By label{left}: {'; '.join(told)}{_say_left(n_more, 'label')}."
    counted = sorted(rooms.items(), key=lambda room: -len(room[1]))
    shown = [f"{room}: {_say_counts(of_it, now)}" for room, of_it in counted[:MOST_ROOMS]]
    n_more = len(counted) - len(shown)
    yield f"By room of the robot{left}: {'; '.join(shown)}{_say_left(n_more, 'room')}."


def _say_label(
    label: str, seen: Sequence[EpisodeMatch], now: datetime | None, rooms: Sequence[str]
) -> str:
    """Say how often a thing was seen and when last; from where, where no room of it is known."""
    last = _say_clock(seen[0].observation.recorded_at, now)
    where = f"in {' or '.join(rooms)}" if rooms else f"from {_say_room(seen[0])}"
    return f"{quote(label)} {len(seen)}, last {last} {where}"


def _is_bare(match: EpisodeMatch) -> bool:
    """Return True for a picture that its time and room say all of."""
    seen = match.observation
    is_told = seen.text or seen.labels or match.distance_m is not None or say_evidence(match)
    return seen.kind is ObservationKind.PICTURE and not is_told


def _say_seen(match: EpisodeMatch, now: datetime | None) -> str:
    return f"{_say_clock(match.observation.recorded_at, now)} in {_say_room(match)}"


def _say_counts(seen: Sequence[Observation], now: datetime | None) -> str:
    """Return "11 pictures, 2 records, 16:02 to 16:22" of observations, the newest first."""
    kinds = Counter(str(each.kind) for each in seen)
    counts = ", ".join(say_count(number, kind) for kind, number in kinds.most_common())
    first, last = (_say_clock(seen[i].recorded_at, now) for i in (-1, 0))
    return f"{counts}, {first}" + ("" if first == last else f" to {last}")


def _say_left(n_left: int, what: str) -> str:
    return f"; and {say_count(n_left, what)} more" if n_left > 0 else ""


def _say_room(match: EpisodeMatch) -> str:
    if match.is_elsewhere:
        return "another map"
    room_id = match.observation.room_id
    return tell_name(room_id) if room_id else "no room"


def _say_clock(time: datetime, now: datetime | None) -> str:
    """Return the time of day, with its date where that is not today."""
    if now is None:
        return f"{time:%Y-%m-%d %H:%M}"
    local = show_local(time, now)
    return f"{local:%H:%M}" if local.date() == now.date() else f"{local:%Y-%m-%d %H:%M}"


def describe_nearby(world: WorldModel, nearby: Nearby) -> str:
    """Return which thing was taken for the one that is meant, and the things nearest to it."""
    thing = nearby.thing
    where, there = say_point(thing.point), "it"
    if thing.thing.position is None:
        where, there = f"a place not noted, seen from {where}", "where it was seen from"
    lines = [f"Nearest to {_say_thing(world, thing)}, at {where}."]
    if nearby.others:
        others = "; ".join(_say_thing(world, each) for each in nearby.others[:MOST_THINGS])
        meant = "its name with its room" if thing.is_reported else "the id of the one that is meant"
        lines[0] += (
            f" It was seen last of {len(nearby.others) + 1} called so; the others are {others}: "
            f"give near_seen {meant}."
        )
    nearest = nearby.nearest[:MOST_THINGS]
    told = [f"{_say_thing(world, each)}, {away_m:.1f} m" for each, away_m in nearest]
    lines.append(f"Things nearest to {there}: {'; '.join(told) or 'none known there'}.")
    lines.append("Observations without it, by how near to it they were made:")
    return "\n".join(lines)


def _say_thing(world: WorldModel, remembered: RememberedThing) -> str:
    rooms = " or ".join(world.rooms_before(remembered)) or "no room"
    shown = f", in {list_pictures(remembered, most=1)}" if remembered.is_reported else ""
    return f"{remembered.id} {quote(remembered.thing.label)} in {rooms}{shown}"


def say_episode(match: EpisodeMatch, *, now: datetime | None) -> str:
    """Return an observation on one line."""
    seen = match.observation
    parts = [
        f"{seen.id}: {seen.kind} at {_say_clock(seen.recorded_at, now)}",
        "from another map"
        if match.is_elsewhere
        else f"from {say_pose(seen.pose)}, in "
        f"{tell_name(seen.room_id) if seen.room_id else 'no room'}",
    ]
    if seen.text:
        parts.append(quote(seen.text, most=LONGEST_TEXT))
    if seen.labels:
        parts.append(f"saw {quote(', '.join(seen.labels), most=LONGEST_TEXT)}")
    if seen.picture and seen.kind is not ObservationKind.PICTURE:
        is_short = "." not in seen.picture
        parts.append(f"with picture {seen.picture}" if is_short else "with a picture")
    if match.distance_m is not None:
        parts.append(f"{match.distance_m:.1f} m away")
    return " | ".join(filter(None, (*parts, say_evidence(match))))


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
