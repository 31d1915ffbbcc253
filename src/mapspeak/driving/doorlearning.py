"""Doors that did not let the robot through, remembered as events of the robot's own.

A map that is not updated while driving shows a door as open that is shut. What the robot's drives
tell of it is noted like anybody else's event: people read it and end it, and ways lead round it.
"""

from collections.abc import Iterable
from dataclasses import replace
from datetime import datetime, timedelta

from mapspeak.driving.drivereport import Drive
from mapspeak.geometry import Point
from mapspeak.memory import MemoryStore
from mapspeak.memory.events import OPEN_AGAIN, ROBOT, SHUT, Effect, Event, current_events
from mapspeak.places.recall.events import end_event, find_hindrances
from mapspeak.robot import GoalState
from mapspeak.spatial.paths import Path
from mapspeak.worldmodel.keepout import outline_of_door
from mapspeak.worldmodel.revision import MapRevision

AHEAD_M = 1.5
"""A robot that gives up at a door stands so near to it, along its way."""
SAME_DOOR_M = 0.5
LEAST_TRY_M = 0.3
"""A robot that has not come this much nearer to a door has not tried it."""
FIRST_PAUSE = timedelta(minutes=15)
LONGEST_PAUSE = timedelta(hours=24)
PAUSE_GROWTH = 4


def learn_from_drive(
    drive: Drive, store: MemoryStore, *, revision: MapRevision, now: datetime
) -> tuple[Event, ...]:
    """Note the door at which a drive gave up, or end what was noted of one it came through.

    Args:
        revision: The map as it is after it: what that shows as closed needs no event.

    Returns:
        What was written.

    Raises:
        SemanticMapError: The memory cannot be read or written.
    """
    begun, ended = drive.begun_at, drive.ended_at
    if drive.final is None or begun is None or ended is None:
        return ()
    own = [each for each in store.read_events() if each.is_of_robot]
    if drive.final.state is GoalState.ARRIVED:
        passed = _find_crossed(own, revision, revision.find_path(begun, ended), now) if own else []
        return tuple(_end(store, each, now) for each in passed)
    if drive.final.state is not GoalState.BLOCKED:
        return ()
    shut = _find_door_ahead(revision, begun, ended, drive.goal.point, now)
    return () if shut is None else (store.write_event(_prolong(shut, own, now)),)


def _find_crossed(
    events: Iterable[Event], revision: MapRevision, path: Path | None, now: datetime
) -> list[Event]:
    """Return those events that last and lie on a way."""
    if path is None:
        return []
    return [
        event
        for event in current_events(events, now)
        if any(each.is_crossed_by(path) for each in find_hindrances([event], revision, now))
    ]


def _find_door_ahead(
    revision: MapRevision, begun: Point, robot: Point, goal: Point, now: datetime
) -> Event | None:
    """Return an event for the door close before the robot that its way goes on through."""
    rooms = revision.rooms
    near = [
        Event(
            text=SHUT,
            place=door.id,
            effect=Effect.AVOID,
            at=door.place,
            outlines=(outline_of_door(rooms, door),),
            source=ROBOT,
            recorded_at=now,
        )
        for door in sorted(rooms.doors, key=lambda door: door.place.distance_to(robot))
        if door.place.distance_to(robot) <= AHEAD_M + door.width_m / 2
        and door.place.distance_to(begun) >= door.place.distance_to(robot) + LEAST_TRY_M
    ]
    crossed = _find_crossed(near, revision, revision.find_path(robot, goal), now) if near else []
    return crossed[0] if crossed else None


def _end(store: MemoryStore, event: Event, now: datetime) -> Event:
    ended = end_event(store, event.id, now=now)
    return store.write_event(replace(ended, text=OPEN_AGAIN))


def _prolong(shut: Event, own: Iterable[Event], now: datetime) -> Event:
    """Return the event an end: later each time that the robot finds the same door shut again.

    A door has one event, which is written anew. What is long over, or was open in between, counts
    no more.
    """
    before = next((each for each in own if _is_at(each, shut)), None)
    if before is None:
        return replace(shut, until=now + FIRST_PAUSE)
    pause = FIRST_PAUSE
    if before.text == SHUT and before.until and before.recorded_at:
        is_lately = now - before.until <= LONGEST_PAUSE
        longer = PAUSE_GROWTH * (before.until - before.recorded_at)
        pause = min(longer, LONGEST_PAUSE) if is_lately else FIRST_PAUSE
    return replace(shut, id=before.id, until=now + max(pause, FIRST_PAUSE))


def _is_at(event: Event, door: Event) -> bool:
    return (
        event.at is not None
        and door.at is not None
        and event.at.distance_to(door.at) <= SAME_DOOR_M
    )
