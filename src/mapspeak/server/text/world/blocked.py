"""What is in the robot's way, with why and until when: one answer from all that knows of it."""

from collections.abc import Iterator, Sequence
from datetime import datetime
from itertools import groupby

from mapspeak.driving.drivereport import Drive
from mapspeak.driving.exploration.progress import find_refused
from mapspeak.memory.events import Effect, Event
from mapspeak.memory.quoting import quote_name
from mapspeak.places.goalcheck import say_check
from mapspeak.places.naming import Place
from mapspeak.places.recall.events import say_events, say_unplaced
from mapspeak.places.relations.choosing import check_place
from mapspeak.places.standing import find_standing_point
from mapspeak.server.text.wording import (
    join_words,
    say_obstruction,
    say_point,
    shorten,
)
from mapspeak.server.text.world.drives import say_end
from mapspeak.server.text.world.maps import say_refusal
from mapspeak.worldmodel.model import WorldModel

MOST_LINES = 12
BORDERS = "borders with the unknown not offered"
NOTHING = (
    "Nothing is known to be blocked: the robot gets to every room, door and remembered place, and "
    "no drive has failed."
)


def describe_blocked(
    world: WorldModel,
    *,
    events: Sequence[Event],
    failed: Sequence[Drive],
    held_by: str | None,
    now: datetime | None,
    now_s: float,
) -> str:
    """Return all that is in the robot's way.

    Args:
        failed: Drives that did not arrive, the latest first.
        held_by: Who keeps the robot standing.
        now: By the calendar; None where that is not known.
        now_s: Robot time.
    """
    parts = {
        "events and closed areas": list(_say_closed(world, events, now)),
        "doors without a way": list(_say_doors(world)),
        "rooms without a way": list(_say_rooms(world)),
        "remembered places without a way": list(_say_places(world)),
        BORDERS: list(_say_borders(world)),
        "goals that failed": [_say_drive(drive, now_s) for drive in failed],
    }
    known = {what: lines for what, lines in parts.items() if lines}
    n_borders = len(find_refused(world))
    counted = ", ".join(
        f"{what} ({n_borders if what == BORDERS else len(lines)})" for what, lines in known.items()
    )
    lines = [f"The robot is held, so it drives nowhere: {shorten(held_by)}."] if held_by else []
    lines += [f"In the way: {counted}." if known else NOTHING]
    return "\n\n".join(["\n".join(lines), *(_section(*part) for part in known.items())])


def _section(what: str, lines: Sequence[str]) -> str:
    n_more = len(lines) - MOST_LINES
    more = [f"... and {n_more} more"] if n_more > 0 else []
    return "\n".join([f"## {what.capitalize()}", *lines[:MOST_LINES], *more])


def _say_closed(world: WorldModel, events: Sequence[Event], now: datetime | None) -> Iterator[str]:
    """Say what events close or hinder, now or later, then what the policy closes."""
    if now is not None:
        hindering = [each for each in events if each.effect is not Effect.NONE]
        yield from say_events(hindering, now)
        yield from say_unplaced(hindering, world.map, now)
    for area in world.map.areas:
        if not area.event_id:
            reason = f" ({shorten(area.reason)})" if area.reason else ""
            yield f"{area.title}{reason}{'' if area.until else ', always closed'}."


def _say_doors(world: WorldModel) -> Iterator[str]:
    for door in world.rooms.doors:
        if world.find_crossing(door) is None:
            joins = join_words(door.region_ids, "-")
            why = say_obstruction(world, door)
            yield f"{door.id} ({joins}, {door.width_m:.2f} m wide): {why}."


def _say_rooms(world: WorldModel) -> Iterator[str]:
    for region in world.rooms.regions:
        if find_standing_point(world, region) is None:
            yield f"{region.id}: {_why_no_way(world, Place(region.id, region))}"


def _say_places(world: WorldModel) -> Iterator[str]:
    for place in world.places:
        if world.path_m(place.waypoint.pose.point) is None:
            name = quote_name(place.waypoint.name)
            yield f"{place.id} {name}: {_why_no_way(world, Place(place.id, place))}"


def _why_no_way(world: WorldModel, place: Place) -> str:
    return say_check(check_place(world, place).check)


def _say_borders(world: WorldModel) -> Iterator[str]:
    """Say where the map ends without being offered, a line for each reason."""
    by_reason = sorted(find_refused(world), key=say_refusal)
    for why, group in groupby(by_reason, key=say_refusal):
        borders = [f"{each.length_m:.1f} m at {say_point(each.anchor)}" for each in group]
        shown = "; ".join(borders[:MOST_LINES])
        n_more = len(borders) - MOST_LINES
        yield f"{why}: {shown}{f'; {n_more} more' if n_more > 0 else ''}."


def _say_drive(drive: Drive, now_s: float) -> str:
    state = "" if drive.final is None else str(drive.final.state).replace("_", " ")
    why = "" if drive.final is None else say_end(drive.final)
    where = f"{drive.goal_id} to {shorten(drive.place)} at {say_point(drive.goal.point)}"
    sent = f"sent {max(now_s - drive.started_s, 0.0) / 60:.0f} min ago"
    return f"{where}, {sent}: {' '.join(filter(None, (state, why and f'({why})')))}."
