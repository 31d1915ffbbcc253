"""What the robot's detector reported and nobody wrote down, in words."""

from collections.abc import Callable, Iterable, Sequence
from datetime import datetime
from difflib import SequenceMatcher

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point
from mapspeak.memory import TakenPicture, find_concern
from mapspeak.memory.episodes.observation import EpisodePage, EpisodeQuery, ObservationKind
from mapspeak.memory.episodes.store import EpisodeStore
from mapspeak.memory.quoting import quote_name
from mapspeak.memory.search.answer import EntryKind, Verdict
from mapspeak.memory.search.kinds import calls_by_name
from mapspeak.memory.things.labels import name_the_same
from mapspeak.places.asking import Recall, RecallQuery
from mapspeak.places.recall.reported import Reported, find_reported
from mapspeak.places.standing import stand_before
from mapspeak.places.things import list_pictures
from mapspeak.server.text.findings import say_guess
from mapspeak.server.text.memory import say_age
from mapspeak.server.text.offered import lead
from mapspeak.server.text.wording import list_some, say_count, say_pose
from mapspeak.server.text.world.notices import say_direction
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedThing
from mapspeak.worldmodel.reported import list_reported

MOST_READ = 200
MOST_PLACES = 5
MOST_NAMES = 3
MOST_LABELS = 12
APART_M = 1.0
"""Pictures from nearer to each other are from one place."""
PLACE_IT = "{write_semantic_data} with its column in {shown} places and remembers it."
GO_THERE = (
    "{look_at} takes {spot}. {navigate_to} takes {nearest}. {write_semantic_data} remembers it."
)
UNCHECKED = "Nobody has checked that."


def say_reported(
    world: WorldModel,
    store: EpisodeStore,
    find: Callable[[EpisodeQuery], EpisodePage],
    answer: Recall,
    *,
    now: datetime,
) -> str:
    """Return what the detector reported of a thing that no record is called by; empty for nothing.

    A report is less than a record: nobody has checked it.

    Args:
        world: The map as it is now, with its rooms and the pictures of this run.
        store: Knows the labels of earlier runs.
        find: Finds observations, placed on the robot's map.
        answer: What is remembered, and of what request.
        now: The operator's time.
    """
    query = answer.query
    is_open = answer.verdict in (Verdict.NOT_REMEMBERED, Verdict.SEVERAL, Verdict.UNSURE)
    is_called_so = any(calls_by_name(query.words, [each.name]) for each in answer.candidates)
    if not is_open or is_called_so or query.kind is EntryKind.PLACE:
        return ""
    labels = list_reported(world.pictures)
    meant = world.recollector.reports.index.find_meant(query.words, labels)
    if found := find_reported(world, query, meant):
        return _say_places(world, found, now)
    try:
        known = store.list_labels()
        earlier = world.recollector.reports.index.find_meant(query.words, known)
        if shown := _leave_out(_not_written_down(world, earlier)):
            return _say_pictures(world, find, query, shown, now)
    except SemanticMapError:
        # What cannot be read costs no answer about what is remembered.
        return ""
    is_none = answer.verdict is Verdict.NOT_REMEMBERED and not meant
    return say_labels(query.words, labels or known) if is_none else ""


def _not_written_down(world: WorldModel, labels: Iterable[str]) -> list[str]:
    written = {each.thing.label for each in world.things}
    return [each for each in labels if not any(name_the_same(each, name) for name in written)]


def _leave_out(labels: Iterable[str]) -> list[str]:
    return [each for each in labels if find_concern(each) is None]


def say_labels(words: str, labels: Iterable[str]) -> str:
    """Say that no label fits some words and which there are, the likest first."""
    likest = sorted(
        _leave_out(labels), key=lambda each: -SequenceMatcher(None, words, each).ratio()
    )
    if not likest:
        return ""
    named = list_some([*map(quote_name, likest)], most=MOST_LABELS)
    return f"No label of what was seen fits {quote_name(words)}; there are {named}."


def _say_places(world: WorldModel, found: Sequence[Reported], now: datetime) -> str:
    told = (
        _say_places_of(world, each, now, most=MOST_PLACES if each is found[0] else 1)
        for each in found[:MOST_NAMES]
    )
    nearest = repr(f"nearest {found[0].label}")
    way = lead("{navigate_to} takes {nearest}, {look_at} too.", nearest=nearest)
    said = f"Not written down, but seen: the robot's detector reported {'. Also '.join(told)}."
    return f"{said} {UNCHECKED} {way}".rstrip()


def _say_places_of(world: WorldModel, found: Reported, now: datetime, *, most: int) -> str:
    times = [each.recorded_at for each in found.pictures if each.recorded_at is not None]
    last = f", last {say_age(max(times), now)}" if times else ""
    told = "; ".join(say_whereabouts(world, each) for each in found.things[:most])
    n_more = len(found.things) - most
    more = f"; and {n_more} farther off" if n_more > 0 else ""
    return (
        f"{quote_name(found.label)} at {say_count(len(found.things), 'place')} "
        f"({say_count(len(found.pictures), 'picture')}{last}): {told}{more}"
    )


def say_whereabouts(world: WorldModel, thing: RememberedThing) -> str:
    """Say where a thing that was reported is, how well that is known, and what shows it."""
    at, radius_m = thing.point, thing.thing.uncertainty_m or 0.0
    how_well = say_guess(radius_m) if thing.thing.is_guessed else f"within {radius_m:.1f} m"
    rooms = " or ".join(world.rooms_before(thing)) or "no room"
    path_m = world.path_m(stand_before(world, thing).point)
    way = "no way there" if path_m is None else f"{path_m:.1f} m by path"
    shown = list_pictures(thing, most=1).partition(" ")[0]
    return f"{at.x:.2f}, {at.y:.2f} ({how_well}) in {rooms}, {way}, best in {shown}"


def say_found(world: WorldModel, words: str, shown: TakenPicture) -> tuple[str, str]:
    """Say where a thing is that a picture shows, and what to do next.

    Args:
        words: What the thing was searched by.
    """
    labels = list_reported(world.pictures)
    meant = world.recollector.reports.index.find_meant(words, labels)
    found = [each for each in world.join_reported(meant) if shown.id in each.thing.waypoints]
    if not found:
        where = f"It is in {shown.id}, taken at {say_pose(shown.pose)}; its place is not known."
        return where, lead(PLACE_IT, shown=shown.id)
    here = world.robot.point
    thing = min(found, key=lambda each: here.distance_to(each.point))
    where = f"It is at {say_whereabouts(world, thing)}; {say_direction(world, thing.point)}."
    spot = f"{thing.point.x:.2f}, {thing.point.y:.2f}"
    return where, lead(GO_THERE, spot=spot, nearest=repr(f"nearest {thing.thing.label}"))


def _say_pictures(
    world: WorldModel,
    find: Callable[[EpisodeQuery], EpisodePage],
    query: RecallQuery,
    labels: Iterable[str],
    now: datetime,
) -> str:
    """Say from where kept pictures were taken that show a thing, but not in which direction."""
    wanted = EpisodeQuery(
        labels=tuple(labels),
        near=query.near,
        radius_m=None if query.near is None else query.near_m,
        since=query.since,
        until=query.until,
        kind=ObservationKind.PICTURE,
        limit=MOST_READ,
    )
    seen = [
        (match.label or "", match.observation)
        for match in find(wanted).matches
        if not match.is_elsewhere
        and query.room_id in (None, world.find_room_id(match.observation.pose.point))
    ]
    if not seen:
        return ""
    label, last = max(seen, key=lambda pair: pair[1].recorded_at)
    n_places = _count_places([each.pose.point for _, each in seen])
    said = (
        f"Not written down, but seen: the robot's detector reported {quote_name(label)} in "
        f"{say_count(len(seen), 'picture')}; where it is was not kept. They are from "
        f"{say_count(n_places, 'place')}, last {say_age(last.recorded_at, now)} from "
        f"{say_pose(last.pose)} ({last.id}). {UNCHECKED}"
    )
    return f"{said} {lead('{recall_episodes} shows them.')}".rstrip()


def _count_places(points: list[Point]) -> int:
    places: list[Point] = []
    for point in points:
        if all(point.distance_to(each) > APART_M for each in places):
            places.append(point)
    return len(places)
