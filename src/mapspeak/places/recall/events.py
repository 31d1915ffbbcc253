"""Events of the semantic map in path planning: the floor they close, and the floor they slow."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from datetime import datetime
from enum import StrEnum

import numpy as np

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point
from mapspeak.memory import LEFT_OUT, Concern, MemoryStore, name_key
from mapspeak.memory.events import (
    Effect,
    Event,
    Every,
    current_events,
    find_place_ids,
    gives_orders,
    show_local,
)
from mapspeak.memory.search.wordindex import content_stems
from mapspeak.places.naming import Place, Spot, Thing
from mapspeak.places.relations.choosing import find_place
from mapspeak.spatial.rooms import Door, Region, RoomMap
from mapspeak.worldmodel.keepout import (
    ClosedArea,
    Outline,
    mask_areas,
    outline_around,
    outline_of_door,
    outlines_of_region,
)
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedPlace
from mapspeak.worldmodel.revision import STEP_M, Hindrance, MapRevision

SPOT_RADIUS_M = 0.5
"""An event at a point takes this much floor around it."""
AROUND = f"{SPOT_RADIUS_M} m around "
REST_RATIO = 0.1
"""A room is cut off when at most this share of its reachable floor is left, at its door."""
AVOID_FACTOR, AVOID_EXTRA_M = 10.0, 20.0
SLOW_FACTOR, SLOW_EXTRA_M = 2.0, 5.0
"""Cost of a path through: its length times the factor, and at least the extra metres more."""


def note_event(
    world: WorldModel,
    store: MemoryStore,
    *,
    text: str,
    effect: Effect,
    now: datetime,
    place: str | None = None,
    begins: datetime | None = None,
    until: datetime | None = None,
    every: Every = Every.ONCE,
    source: str = "",
) -> Event:
    """Remember an event, with the outline that its place has now; return it as it was written.

    Args:
        place: An id, a name, coordinates, or words as for a goal; a mere note needs none.

    Raises:
        GoalError: There is no such place.
        SemanticMapError: It is over, its words give orders, it closes the floor below the robot, or
            it cannot be written.
    """
    if until is not None and until <= now:
        raise SemanticMapError(
            f"The event '{text}' was over at {until.isoformat(timespec='minutes')}.",
            hint=f"Give a time after {now.isoformat(timespec='minutes')}.",
        )
    _require_no_orders(event=text, place=place or "", source=source)
    found = None if place is None else find_place(world, place)
    event = Event(
        text=text,
        place="" if found is None else _name_of(found, place or "", effect),
        effect=effect,
        at=None if found is None else found.point,
        outlines=() if found is None or effect is Effect.NONE else _outline(world.rooms, found),
        begins=begins,
        until=until,
        every=every,
        source=source,
        recorded_at=now,
    )
    _require_robot_outside(world, event, now)
    return store.write_event(event)


def _require_no_orders(**said: str) -> None:
    for what, words in said.items():
        if gives_orders(words):
            raise SemanticMapError(
                f"The {what} '{words[:80]}' gives orders: {LEFT_OUT[Concern.ORDERS]}",
                hint="Say what is the matter, such as 'C1 is closed'; effect says what it means "
                "for ways.",
            )


def closes_robot_in(world: WorldModel, event: Event, now: datetime) -> bool:
    """Return True for an event that closes the floor below the robot, now or later."""
    area = _area_of(event, world.map, now) if event.effect is Effect.CLOSED else None
    return area is not None and area.contains(world.robot.point)


def _require_robot_outside(world: WorldModel, event: Event, now: datetime) -> None:
    """Refuse what would close the floor below the robot: it could drive nowhere any more."""
    if event.is_current(now) and closes_robot_in(world, event, now):
        raise SemanticMapError(
            f"The robot itself stands in {event.place or 'what is to be closed'}; closed, it could "
            "not drive out. Nothing was noted.",
            hint="Drive out first, then note it again; or note it with the effect avoid.",
        )


def find_cut_off(world: WorldModel, event: Event, now: datetime) -> list[str]:
    """Return the rooms beside what an event closes that the robot gets to only before and after.

    Args:
        world: The map before the event, with the robot outside what it closes.
    """
    area = _area_of(event, world.map, now) if event.effect is Effect.CLOSED else None
    if area is None:
        return []
    before = world.distances.reachable
    closed = _close(world.map, area)
    after = closed.distances_from(world.robot.point).reachable
    labels = world.rooms.labels
    return [
        region.id
        for region in world.rooms.regions
        if not area.contains(region.widest)
        and np.count_nonzero(after & (labels == region.index))
        < REST_RATIO * np.count_nonzero(before & (labels == region.index))
    ]


class OnWay(StrEnum):
    """What a closure means for a drive under way."""

    AT_GOAL = "at_goal"
    LED_ROUND = "led_round"
    NO_WAY_ROUND = "no_way_round"


def find_on_way(world: WorldModel, event: Event, goal: Point, now: datetime) -> OnWay | None:
    """Return what an event means for a drive to a goal; None where it leaves its way alone.

    Args:
        world: The map before the event, with the robot outside what it closes.
    """
    is_closed = event.effect is Effect.CLOSED and event.is_current(now)
    area = _area_of(event, world.map, now) if is_closed else None
    if area is None:
        return None
    if area.distance_to(goal) < world.map.radius_m:
        return OnWay.AT_GOAL
    here = world.robot.point
    way, closed = world.map.find_path(here, goal), _close(world.map, area)
    if way is None or not any(
        area.distance_to(each) < world.map.radius_m for each in way.sampled(STEP_M)
    ):
        return None
    return OnWay.NO_WAY_ROUND if closed.find_path(here, goal) is None else OnWay.LED_ROUND


def _close(revision: MapRevision, area: ClosedArea) -> MapRevision:
    return revision.with_areas((*revision.areas, area), revision.hindrances)


def end_event(store: MemoryStore, event_id: str, *, now: datetime) -> Event:
    """End an event at once; its record stays, as something that was.

    Args:
        event_id: "E3", or its number alone.

    Raises:
        SemanticMapError: There is none of that id, it is over already, or it cannot be written.
    """
    events = {event.id.upper(): event for event in store.read_events()}
    wanted = event_id.strip().upper()
    event = events.get(f"E{wanted}" if wanted.isdecimal() else wanted)
    if event is None:
        known = ", ".join(each.id for each in current_events(events.values(), now)) or "none"
        raise SemanticMapError(
            f"There is no event '{event_id}'.", hint=f"Events that last now: {known}."
        )
    if event.until is not None and event.is_over(now):
        raise SemanticMapError(
            f"{event.id} had already ended, at {event.until.isoformat(timespec='minutes')}.",
            hint="Nothing was changed.",
        )
    # The memory keeps whole seconds.
    ends = now.replace(microsecond=0)
    begins = None if event.begins is not None and event.begins >= ends else event.begins
    return store.write_event(replace(event, begins=begins, until=ends, every=Every.ONCE))


def find_also_closed(revision: MapRevision, event: Event, now: datetime) -> list[ClosedArea]:
    """Return what else closes floor that an event closes, or closed."""
    area = _area_of(event, revision, now) if event.effect is Effect.CLOSED else None
    if area is None:
        return []
    inside = mask_areas(revision.grid, [area])
    others = (each for each in revision.areas if each.event_id != event.id)
    return [each for each in others if (inside & mask_areas(revision.grid, [each])).any()]


def find_speaking_events(events: Iterable[Event], words: str, now: datetime) -> tuple[Event, ...]:
    """Return the events that last, or are still to come, and say words of a request.

    Those that say most of them come first.
    """
    wanted = set(content_stems(words))
    n_said = {
        event: len(wanted.intersection(content_stems(f"{event.text} {event.place}")))
        for event in events
        if not event.is_over(now)
    }
    return tuple(sorted(filter(n_said.get, n_said), key=lambda each: -n_said[each]))


def find_events_at(
    events: Iterable[Event], world: WorldModel, place: Place, now: datetime
) -> tuple[Event, ...]:
    """Return the events that last, or are still to come, of a place: of a room all in it."""
    thing = place.thing
    place_id = "" if isinstance(thing, Spot) else thing.id

    def is_of_it(event: Event) -> bool:
        if isinstance(thing, Region) and event.at is not None:
            return world.find_room_id(event.at) == place_id
        return place_id in find_place_ids(event.place) or name_key(event.place) == name_key(
            place.name
        )

    return tuple(each for each in events if not each.is_over(now) and is_of_it(each))


def leave_out_events(
    warnings: Iterable[str], events: Iterable[Event], revision: MapRevision, now: datetime | None
) -> list[str]:
    """Return those of a map's warnings that are of no event."""
    if now is None:
        return list(warnings)
    kept = tuple(events)
    of_events = {*say_events(kept, now), *say_unplaced(kept, revision, now)}
    return [each for each in warnings if each not in of_events]


def say_events(events: Iterable[Event], now: datetime) -> tuple[str, ...]:
    """Return the events that last, and those still to come, one sentence each."""
    return tuple(event.sentence(now) for event in events if not event.is_over(now))


def say_unplaced(events: Iterable[Event], revision: MapRevision, now: datetime) -> tuple[str, ...]:
    """Return the events that should change ways, but name no place on this map."""
    return tuple(
        f"The event {event.id} names no place on this map, so it changes no way: {event.told_text}."
        for event in current_events(events, now)
        if event.effect is not Effect.NONE and not _find_outlines(event, revision)
    )


def close_floor_of(
    events: Iterable[Event], revision: MapRevision, now: datetime
) -> Iterator[ClosedArea]:
    """Return what events close at a moment; none opens what something else closes."""
    for event in current_events(events, now):
        if event.effect is Effect.CLOSED:
            area = _area_of(event, revision, now)
            if area is not None:
                yield area


def find_hindrances(
    events: Iterable[Event], revision: MapRevision, now: datetime
) -> Iterator[Hindrance]:
    """Return where events make ways slow, or better avoided, at a moment."""
    for event in current_events(events, now):
        if event.effect in (Effect.SLOW, Effect.AVOID):
            area = _area_of(event, revision, now)
            if area is not None:
                is_slow = event.effect is Effect.SLOW
                yield Hindrance(
                    area=area,
                    extra_m=SLOW_EXTRA_M if is_slow else AVOID_EXTRA_M,
                    factor=SLOW_FACTOR if is_slow else AVOID_FACTOR,
                )


def _area_of(event: Event, revision: MapRevision, now: datetime) -> ClosedArea | None:
    outlines = _find_outlines(event, revision)
    if not outlines:
        return None
    until = ""
    _, end = event.find_time(now)
    if end is not None:
        local = show_local(end, now)
        until = f"{local:%H:%M}" if local.date() == now.date() else f"{local:%Y-%m-%d %H:%M}"
    return ClosedArea(
        name=_title_of(event),
        outline=outlines[0],
        further_outlines=outlines[1:],
        until=until,
        reason="" if gives_orders(event.text) else event.text,
        event_id=event.id,
    )


def _title_of(event: Event) -> str:
    """Return how the area is called: by the event's words only where these give no orders."""
    words = (event.place, *find_place_ids(event.place), event.text)
    return next((each for each in words if each and not gives_orders(each)), event.id)


def _find_outlines(event: Event, revision: MapRevision) -> tuple[Outline, ...]:
    """Return the outlines that were written, else those of the ids that its place names."""
    if event.outlines:
        return event.outlines
    found: list[Outline] = []
    for place_id in find_place_ids(event.place):
        # Rooms are found only for an event that was written without an outline.
        rooms = revision.rooms
        door = next((each for each in rooms.doors if each.id == place_id), None)
        found += _outlines_of(rooms, rooms.find_region(place_id) or door)
    if not found and event.at is not None:
        found.append(outline_around(event.at, radius_m=SPOT_RADIUS_M))
    return tuple(found)


def _outlines_of(rooms: RoomMap, thing: Thing | None) -> tuple[Outline, ...]:
    """Return the outlines of a region or a door; none of what has no extent."""
    match thing:
        case Region() as region:
            return outlines_of_region(rooms, region)
        case Door() as door:
            return (outline_of_door(rooms, door),)
        case _:
            return ()


def _outline(rooms: RoomMap, place: Place) -> tuple[Outline, ...]:
    around = outline_around(place.point, radius_m=SPOT_RADIUS_M)
    return _outlines_of(rooms, place.thing) or (around,)


def find_region_around(world: WorldModel, event: Event) -> str | None:
    """Return the region in which an event takes a spot alone, by id; None for other events."""
    if event.at is None or not event.place.startswith(AROUND):
        return None
    return world.find_room_id(event.at)


def _name_of(place: Place, words: str, effect: Effect) -> str:
    """Return the id with the words that were used for it, where these are others.

    What has no extent of its own tells how much floor is taken around it.
    """
    said = words.strip()
    if isinstance(place.thing, RememberedPlace):
        # It is called so, however it was spelt.
        said = name = place.thing.waypoint.name
    elif isinstance(place.thing, Spot) and not place.reason:
        said = name = _say_point(place.point)
    else:
        name = place.name
    named = said if name.casefold() in said.casefold() else f"{said} ({name})"
    if effect is Effect.NONE or isinstance(place.thing, (Region, Door)):
        return named
    at = "" if name == named == _say_point(place.point) else f" at {_say_point(place.point)}"
    return f"{AROUND}{named}{at}"


def _say_point(point: Point) -> str:
    """Return a point as it is written for a goal."""
    return f"{point.x:.2f}, {point.y:.2f}"
