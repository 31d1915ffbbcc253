"""Ways and sizes compared, as text."""

import math
from collections.abc import Iterator, Mapping, Sequence

from mapspeak.errors import GoalError
from mapspeak.places.goalcheck import GoalVerdict, say_check
from mapspeak.places.naming import Place, Spot
from mapspeak.places.relations.choosing import check_place, find_place, find_places
from mapspeak.places.ways import Way, find_way, measure_path, standing_point
from mapspeak.server.text.offered import lead
from mapspeak.server.text.wording import build_table, join_words, say_kind, say_path, say_point
from mapspeak.server.text.world.tables import say_sizes
from mapspeak.spatial.rooms import Door, Region
from mapspeak.worldmodel.model import WorldModel

MOST_WAYS = 30
MOST_SIZES = 60
MOST_REASONS = 6


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
        f"There is nothing to measure from {begin.name} to.",
        hint=lead("Name other places than the start, or explore. {look_at_map} shows more."),
    )


def _way_table(world: WorldModel, start: Place, ends: Sequence[Place]) -> str:
    lengths_m = {end.name: measure_path(world, start, end) for end in ends}
    nearest_first = sorted(
        ends, key=lambda end: math.inf if (m := lengths_m[end.name]) is None else m
    )
    begin = check_place(world, Place(start.name, Spot(standing_point(world, start))))
    table = build_table(
        f"Ways from {start.name} ({say_point(begin.pose.point)}), nearest first",
        ("to", "at x, y", "path m", "straight m", "through", "least clearance m"),
        nearest_first[:MOST_WAYS],
        lambda end: _way_row(world, find_way(world, start, end)),
        n_all=len(nearest_first),
    )
    is_there = begin.check.is_ok or start.point == world.robot.point
    said = [] if is_there else [f"No way begins there: {say_check(begin.check)}"]
    if is_there and world.map.areas:
        said = list(_say_closed(world, nearest_first[:MOST_WAYS], lengths_m))
    return "\n".join([table, *said])


def _say_closed(
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
        f"{way.straight_m:.1f}",
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
        ("id", "kind", "floor m2", "free m2", "times the smallest"),
        by_size[:MOST_SIZES],
        lambda region: (
            region.id,
            say_kind(region),
            f"{region.floor_area_m2:.1f}",
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
