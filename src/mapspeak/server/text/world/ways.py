"""Ways: what is in them, with why and until when, and how long they are, compared."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import datetime
from itertools import groupby

from mapspeak.driving.drivereport import FRONTIER, Drive
from mapspeak.driving.exploration.progress import find_refused, is_unknown_beside
from mapspeak.errors import GoalError
from mapspeak.memory.events import Effect, Event
from mapspeak.memory.quoting import quote_name
from mapspeak.places.goalcheck import GoalVerdict, say_check
from mapspeak.places.naming import Place, Spot
from mapspeak.places.recall.events import leave_out_events, say_events, say_unplaced
from mapspeak.places.relations.choosing import CheckedGoal, check_place, find_place, find_places
from mapspeak.places.standing import find_standing_point, stand_again
from mapspeak.places.ways import Way, find_way, measure_path, standing_point
from mapspeak.server.text.offered import lead
from mapspeak.server.text.wording import build_table, join_words, say_path, say_point, shorten
from mapspeak.server.text.world.drives import say_end
from mapspeak.server.text.world.maps import say_refusal
from mapspeak.server.text.world.notices import say_obstruction, say_warnings
from mapspeak.server.text.world.tables import say_floor, say_sizes
from mapspeak.spatial.frontiers import RefusalReason, RefusedFrontier
from mapspeak.spatial.rooms import Door, Region
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.remembered import RememberedPlace, RememberedThing

OF_THINGS = "Straight is to a thing itself, the path to where the robot would stand to see it."
MOST_LINES = 12
BORDERS = "borders with the unknown not offered"
UNEXPLORED = "remembered places that the map does not show yet"
FAILED = "goals that failed"
MINOR = {BORDERS, UNEXPLORED, FAILED}
"""What keeps the robot from no place that the map shows."""
EVERYWHERE = (
    "Nothing is known to be blocked: the robot gets to every room, door and remembered place"
)
MOST_WAYS = 30
MOST_SIZES = 60
MOST_REASONS = 6


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
    blocked, unexplored = _find_places_without_way(world)
    parts = {
        "events and closed areas": list(_say_closed(world, events, now)),
        "doors without a way": list(_say_doors(world)),
        "rooms without a way": list(_say_rooms(world)),
        "remembered places without a way": list(_say_places(blocked)),
        UNEXPLORED: list(_say_places(unexplored)),
        BORDERS: list(_say_borders(world)),
        FAILED: [_say_drive(drive, now_s) for drive in failed if _is_open(world, drive)],
    }
    known = {what: lines for what, lines in parts.items() if lines}
    counts = {what: len(lines) for what, lines in known.items()}
    if BORDERS in counts:
        counts[BORDERS] = len(_find_borders(world))
    lines = list(_say_doubts(world, events, now))
    lines += [f"The robot is held, so it drives nowhere: {shorten(held_by)}."] if held_by else []
    lines.append(_say_in_the_way(counts))
    return "\n\n".join(["\n".join(lines), *(_section(*part) for part in known.items())])


def _say_in_the_way(counts: Mapping[str, int]) -> str:
    """Say first whether the robot gets everywhere; how often what is by the way."""
    shown = " that the map shows" if UNEXPLORED in counts else ""
    everywhere = f"{EVERYWHERE}{shown}."
    if not counts:
        return everywhere
    told = ", ".join(f"{what} ({n})" for what, n in counts.items())
    return f"{everywhere} Else: {told}." if counts.keys() <= MINOR else f"In the way: {told}."


def _say_doubts(world: WorldModel, events: Sequence[Event], now: datetime | None) -> Iterator[str]:
    """Say why not all that is in the way may be known: the warnings that are of no event."""
    told = (each.removeprefix("Warning: ") for each in say_warnings(world))
    for warning in leave_out_events(told, events, world.map, now):
        yield f"Warning: {warning}"


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


def _find_places_without_way(
    world: WorldModel,
) -> tuple[list[CheckedGoal], list[CheckedGoal]]:
    """Return the remembered places that something cuts off, and those that nobody has seen yet."""
    checked = [
        check_place(world, Place(place.id, place))
        for place in world.places
        if world.path_m(stand_again(world, place.waypoint.pose).point) is None
    ]
    parts: tuple[list[CheckedGoal], list[CheckedGoal]] = ([], [])
    for goal in checked:
        parts[goal.check.verdict in (GoalVerdict.OFF_MAP, GoalVerdict.UNKNOWN)].append(goal)
    return parts


def _say_places(goals: Iterable[CheckedGoal]) -> Iterator[str]:
    for goal in goals:
        if isinstance(place := goal.place.thing, RememberedPlace):
            yield f"{place.id} {quote_name(place.waypoint.name)}: {say_check(goal.check)}"


def _why_no_way(world: WorldModel, place: Place) -> str:
    return say_check(check_place(world, place).check)


def _say_borders(world: WorldModel) -> Iterator[str]:
    """Say where the map ends without being offered, a line for each reason."""
    by_reason = sorted(_find_borders(world), key=say_refusal)
    for why, group in groupby(by_reason, key=say_refusal):
        borders = [f"{each.length_m:.1f} m at {say_point(each.anchor)}" for each in group]
        shown = "; ".join(borders[:MOST_LINES])
        n_more = len(borders) - MOST_LINES
        yield f"{why}: {shown}{f'; {n_more} more' if n_more > 0 else ''}."


def _find_borders(world: WorldModel) -> list[RefusedFrontier]:
    """Return the borders that something keeps the robot from; too little to see does not."""
    refused = find_refused(world)
    return [each for each in refused if each.reason is not RefusalReason.NOTHING_TO_SEE]


def _is_open(world: WorldModel, drive: Drive) -> bool:
    """Return False for a drive to a frontier that has been seen since."""
    is_to_frontier = FRONTIER.fullmatch(drive.place) is not None
    return not is_to_frontier or is_unknown_beside(world, drive.goal.point)


def _say_drive(drive: Drive, now_s: float) -> str:
    state = "" if drive.final is None else str(drive.final.state).replace("_", " ")
    why = "" if drive.final is None else say_end(drive.final)
    where = f"{drive.goal_id} to {shorten(drive.place)} at {say_point(drive.goal.point)}"
    sent = f"sent {max(now_s - drive.started_s, 0.0) / 60:.0f} min ago"
    return f"{where}, {sent}: {' '.join(filter(None, (state, why and f'({why})')))}."


def describe_measures(world: WorldModel, *, start: str, places: Sequence[str] | None) -> str:
    """Return the ways from one place to others, nearest first, and their sizes, smallest first.

    Raises:
        GoalError: There is no such place, or nothing to measure.
    """
    begin = find_place(world, start)
    others = _find_others(world, begin, places)
    regions = [end.thing for end in (begin, *others) if isinstance(end.thing, Region)]
    doors = [end.thing for end in (begin, *others) if isinstance(end.thing, Door)]
    parts = [_way_table(world, begin, others)]
    parts += [f"{end.name} is {end.reason}." for end in (begin, *others) if end.reason]
    parts += [_size_table(world, regions)] if regions else []
    parts += [_width_line(doors)] if len(doors) > 1 else []
    return "\n\n".join(parts)


def _find_others(world: WorldModel, begin: Place, places: Sequence[str] | None) -> list[Place]:
    """Return each place once, without the one to measure from."""
    ends = [Place(region.id, region) for region in world.rooms.regions]
    if places is not None:
        ends = [place for words in places for place in find_places(world, words)]
    by_name = {end.name: end for end in ends if end.name != begin.name}
    if by_name:
        return list(by_name.values())
    raise GoalError(
        f"Only {begin.name} itself is named, where ways begin.",
        hint=lead("Name other places than the start, or explore. {look_at_map} shows more."),
    )


def _way_table(world: WorldModel, start: Place, ends: Sequence[Place]) -> str:
    lengths_m = {end.name: measure_path(world, start, end) for end in ends}
    nearest_first = sorted(
        ends, key=lambda end: math.inf if (m := lengths_m[end.name]) is None else m
    )
    begin = check_place(world, Place(start.name, Spot(standing_point(world, start))))
    order = "nearest first"
    if world.map.weights is not None:
        order += " by the shortest path; path m is of the way to drive"
    table = build_table(
        f"Ways from {start.name} ({say_point(begin.pose.point)}), {order}",
        ("to", "stand at x, y", "path m", "straight m", "through", "least clearance m"),
        nearest_first[:MOST_WAYS],
        lambda end: _way_row(world, find_way(world, start, end)),
        n_all=len(nearest_first),
    )
    is_there = begin.check.is_ok or start.point == world.robot.point
    has_things = any(isinstance(each.thing, RememberedThing) for each in (start, *ends))
    said = [OF_THINGS] if has_things else []
    said += [] if is_there else [f"No way begins there: {say_check(begin.check)}"]
    if is_there and world.map.areas:
        said += _say_why_closed(world, nearest_first[:MOST_WAYS], lengths_m)
    return "\n".join([table, *said])


def _say_why_closed(
    world: WorldModel, ends: Sequence[Place], lengths_m: Mapping[str, float | None]
) -> Iterator[str]:
    """Say why there is no way to some places, where it may be that something is closed."""
    without_way = [end for end in ends if lengths_m[end.name] is None]
    sentences = (say_check(check_place(world, end).check) for end in without_way[:MOST_REASONS])
    yield from dict.fromkeys(sentences)


def _way_row(world: WorldModel, way: Way) -> Sequence[str]:
    clear_m = way.clearance_m
    return (
        way.goal.name,
        say_point(way.end),
        _say_no_way(world, way.goal) if way.path_m is None else say_path(way.path_m),
        "-" if way.straight_m is None else f"{way.straight_m:.1f}",
        join_words(way.through, "-"),
        "-" if clear_m is None else f"{clear_m:.2f}",
    )


def _say_no_way(world: WorldModel, goal: Place) -> str:
    """Say that there is no way, with the reason where it lies in the goal."""
    verdict = check_place(world, goal).check.verdict
    return "no way" if verdict is GoalVerdict.OK else f"no way ({verdict.replace('_', ' ')})"


def _size_table(world: WorldModel, regions: Sequence[Region]) -> str:
    by_size = sorted(regions, key=lambda region: region.floor_area_m2)
    least_m2 = by_size[0].floor_area_m2
    table = build_table(
        "Sizes, smallest first",
        ("id", "floor m2", "free m2", "times the smallest"),
        by_size[:MOST_SIZES],
        lambda region: (
            region.id,
            say_floor(world, region),
            f"{region.free_area_m2:.1f}",
            f"{region.floor_area_m2 / least_m2:.2f}",
        ),
        n_all=len(by_size),
    )
    return f"{table}\n{say_sizes(world, regions)}"


def _width_line(doors: Sequence[Door]) -> str:
    by_width = sorted(doors, key=lambda door: door.width_m)
    widths = ", ".join(f"{door.id} {door.width_m:.2f} m" for door in by_width)
    return f"Doors, narrowest first: {widths}."
