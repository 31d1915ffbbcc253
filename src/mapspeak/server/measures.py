"""Ways and sizes compared, as text."""

import math
from collections.abc import Sequence

from mapspeak.errors import GoalError
from mapspeak.navigation.atlas import Atlas
from mapspeak.navigation.places import Place, find_place
from mapspeak.navigation.ways import Way, find_way, measure_path
from mapspeak.server.roomtables import say_sizes
from mapspeak.server.wording import build_table, join_words, say_kind, say_path, say_point
from mapspeak.spatial.rooms import Door, Region

__all__ = ["describe_measures"]

MOST_WAYS = 30
MOST_SIZES = 60


def describe_measures(atlas: Atlas, *, start: str, places: Sequence[str] | None) -> str:
    """Gives the ways from one place to others, nearest first, and their sizes, smallest first.

    Raises:
        GoalError: There is no such place.
    """
    begin = find_place(atlas, start)
    ends = [Place(region.id, region) for region in atlas.rooms.regions]
    if places is not None:
        ends = [find_place(atlas, words) for words in dict.fromkeys(places)]
    if not ends:
        raise GoalError(
            "There is nothing to measure: the map shows no room yet.",
            hint="Name places, or call look_at_map and explore a frontier first.",
        )
    others = [end for end in ends if end.name != begin.name]
    regions = [end.thing for end in (begin, *others) if isinstance(end.thing, Region)]
    doors = [end.thing for end in (begin, *others) if isinstance(end.thing, Door)]
    parts = [_way_table(atlas, begin, others)] if others else []
    parts += [_size_table(atlas, regions)] if regions else []
    parts += [_width_line(doors)] if len(doors) > 1 else []
    return "\n\n".join(parts)


def _way_table(atlas: Atlas, start: Place, ends: Sequence[Place]) -> str:
    lengths_m = {end.name: measure_path(atlas, start, end) for end in ends}
    nearest_first = sorted(
        ends, key=lambda end: math.inf if (m := lengths_m[end.name]) is None else m
    )
    return build_table(
        f"Ways from {start.name} ({say_point(start.point)}), nearest first",
        ("to", "at x, y", "path m", "straight m", "through", "least clearance m"),
        nearest_first[:MOST_WAYS],
        lambda end: _way_row(find_way(atlas, start, end)),
        n_all=len(nearest_first),
    )


def _way_row(way: Way) -> Sequence[str]:
    clear_m = way.clearance_m
    return (
        way.goal.name,
        say_point(way.goal.point),
        say_path(way.path_m),
        f"{way.straight_m:.1f}",
        join_words(way.through, "-"),
        "-" if clear_m is None else f"{clear_m:.2f}",
    )


def _size_table(atlas: Atlas, regions: Sequence[Region]) -> str:
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
    return f"{table}\n{say_sizes(atlas, regions)}"


def _width_line(doors: Sequence[Door]) -> str:
    by_width = sorted(doors, key=lambda door: door.width_m)
    widths = ", ".join(f"{door.id} {door.width_m:.2f} m" for door in by_width)
    return f"Doors, narrowest first: {widths}."
