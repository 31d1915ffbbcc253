"""Doors that did not let the robot through, remembered as events of the robot's own.

A map that is not updated while driving shows a door as open that is shut. What the robot's drives
tell of it is noted like anybody else's event: people read it and end it, and ways lead round it.
"""

from collections.abc import Iterable
from dataclasses import replace
from datetime import datetime, timedelta

from mapspeak.geometry import Point
from mapspeak.navigation.drive import Drive
from mapspeak.navigation.events.footprints import outline_of_door
from mapspeak.navigation.events.notices import end_event, find_hindrances
from mapspeak.navigation.revision import MapRevision
from mapspeak.robot import GoalState
from mapspeak.semantic import SemanticMapStore
from mapspeak.semantic.events import Effect, Event, current_events
from mapspeak.spatial.paths import Path

__all__ = ["SOURCE", "learn_from_drive"]

SOURCE = "the robot"
AHEAD_M = 1.5
"""A robot that gives up at a door stands so near to it, along its way."""
SAME_DOOR_M = 0.5
FIRST_PAUSE = timedelta(minutes=15)
LONGEST_PAUSE = timedelta(hours=24)
PAUSE_GROWTH = 4


def learn_from_drive(
    drive: Drive,
    store: SemanticMapStore,
    *,
    revision: MapRevision,
    begun: Point,
    robot: Point,
    now: datetime,
) -> tuple[Event, ...]:
    """Notes the door at which a drive gave up, or ends what was noted of one it came through.

    Args:
        drive: The last that has ended.
        store: Where events are remembered.
        revision: The map as it is after it: what that shows as closed needs no event.
        begun: Where the robot was before it.
        robot: Where it is now.
        now: The operator's time.

    Returns:
        What was written.

    Raises:
        SemanticMapError: The memory cannot be read or written.
    """
    state = None if drive.final is None else drive.final.state
    if state not in (GoalState.ARRIVED, GoalState.BLOCKED, GoalState.TIMED_OUT):
        return ()
    own = [each for each in store.read_events() if each.source == SOURCE]
    if state is GoalState.ARRIVED:
        passed = _find_crossed(own, revision, revision.find_path(begun, robot), now) if own else []
        return tuple(end_event(store, each.id, now=now) for each in passed)
    shut = _find_door_ahead(revision, robot, drive.goal.point, now)
    return () if shut is None else (store.write_event(_prolong(shut, own, now)),)


def _find_crossed(
    events: Iterable[Event], revision: MapRevision, path: Path | None, now: datetime
) -> list[Event]:
    """Gives those events that last and lie on a way."""
    if path is None:
        return []
    return [
        event
        for event in current_events(events, now)
        if any(each.is_crossed_by(path) for each in find_hindrances([event], revision, now))
    ]


def _find_door_ahead(
    revision: MapRevision, robot: Point, goal: Point, now: datetime
) -> Event | None:
    """Gives an event for the door close before the robot that its way goes on through."""
    rooms = revision.rooms
    near = [
        Event(
            text="the robot could not get through",
            place=door.id,
            effect=Effect.AVOID,
            at=door.place,
            outlines=(outline_of_door(rooms, door),),
            source=SOURCE,
            recorded_at=now,
        )
        for door in sorted(rooms.doors, key=lambda door: door.place.distance_to(robot))
        if door.place.distance_to(robot) <= AHEAD_M + door.width_m / 2
    ]
    crossed = _find_crossed(near, revision, revision.find_path(robot, goal), now) if near else []
    return crossed[0] if crossed else None


def _prolong(shut: Event, own: Iterable[Event], now: datetime) -> Event:
    """Gives the event an end: later each time that the robot finds the same door shut again."""
    earlier = [each for each in own if _is_at(each, shut)]
    lasting = current_events(earlier, now)
    pauses = [each.until - each.recorded_at for each in earlier if each.until and each.recorded_at]
    pause = min(PAUSE_GROWTH * pauses[-1], LONGEST_PAUSE) if pauses else FIRST_PAUSE
    return replace(shut, id=lasting[-1].id if lasting else "", until=now + max(pause, FIRST_PAUSE))


def _is_at(event: Event, door: Event) -> bool:
    return (
        event.at is not None
        and door.at is not None
        and event.at.distance_to(door.at) <= SAME_DOOR_M
    )
