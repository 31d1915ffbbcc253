"""Draw a building of a style from a seed, and write it as a world file as a person would."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

from mapspeak.errors import ConfigError
from mapspeak.simulator.worlds.worldfiles import parse_world
from mapspeak.spatial.rooms import RoomClass
from tools.worldgen.furnishing import Spot, Thing, furnish
from tools.worldgen.laws import APART_RATIO, find_faults
from tools.worldgen.layout import Corner, Dice, Space
from tools.worldgen.purposes import Piece
from tools.worldgen.styles import STYLES, Building, Style

__all__ = ["Furnished", "draw_plan", "style_names", "write_plan"]

N_LAYOUTS, N_FURNISHINGS = 20_000, 60
START_M = 1.3
"""From the charging dock to where the robot starts."""
DOCK = Piece(label="charging dock", kind="charging_dock", front_m=START_M + 0.4)
AREA_RATIO = APART_RATIO + 0.1
"""Bare rooms differ by more than furnished ones have to."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Furnished:
    """A building with what stands in it.

    Attributes:
        title: A sentence about it.
        building: Walls, doors and spaces.
        things: What stands in each space, by its name.
        start: Where the robot stands at first.
    """

    title: str
    building: Building
    things: Mapping[str, Sequence[Thing]]
    start: Spot


def style_names() -> tuple[str, ...]:
    """Return the names of all styles."""
    return tuple(STYLES)


def draw_plan(style: str, *, seed: int) -> str:
    """Draw a building and return its world file; an even seed gives a large one.

    Raises:
        ConfigError: There is no such style.
    """
    if style not in STYLES:
        raise ConfigError(f"There is no style {style!r}.", hint=f"Name one of {', '.join(STYLES)}.")
    remark = (
        f"Drawn by `python -m tools.worldgen {style} --seed {seed}`."
        " A copy under another name may be edited."
    )
    for plan in _draw(STYLES[style], seed):
        text = write_plan(plan, remark=remark)
        if not any(find_faults(parse_world(text, name=style))):
            return text
    message = f"No {style} of seed {seed} keeps the laws."
    raise AssertionError(message)


def _draw(style: Style, seed: int) -> Iterator[Furnished]:
    n_furnished = 0
    for attempt in range(N_LAYOUTS):
        dice = Dice(seed, attempt)
        building = _lay_out(style, dice, is_large=seed % 2 == 0)
        if building is None:
            continue
        things = _furnish(building, dice)
        if things is not None:
            yield _finish(style, building, things)
            n_furnished += 1
        if n_furnished == N_FURNISHINGS:
            return


def _lay_out(style: Style, dice: Dice, *, is_large: bool) -> Building | None:
    with suppress(ValueError):
        building = style.lay_out(dice, is_large)
        if building.is_complete and _has_clear_sizes(building.layout.spaces):
            return building
    return None


def _has_clear_sizes(spaces: list[Space]) -> bool:
    areas = sorted(space.area_m2 for space in spaces if space.room_class is RoomClass.ROOM)
    return areas[1] >= AREA_RATIO * areas[0] and areas[-1] >= AREA_RATIO * areas[-2]


def _furnish(building: Building, dice: Dice) -> dict[str, list[Thing]] | None:
    things: dict[str, list[Thing]] = {}
    for space in building.layout.spaces:
        placed = furnish(
            building.layout,
            space,
            dice,
            wall_thickness_m=building.wall_thickness_m,
            first=(DOCK,) if space is building.start else (),
        )
        if placed is None:
            return None
        things[space.name] = placed
    return things


def _finish(style: Style, building: Building, things: dict[str, list[Thing]]) -> Furnished:
    dock = things[building.start.name][0].spot
    bounds = [space.bounds for space in building.layout.spaces]
    width_m = max(each.right for each in bounds) - min(each.left for each in bounds)
    height_m = max(each.top for each in bounds) - min(each.bottom for each in bounds)
    n_rooms = sum(each.room_class is RoomClass.ROOM for each in building.layout.spaces)
    return Furnished(
        title=f"{style.title}, {width_m:.0f} x {height_m:.0f} m, with {n_rooms} rooms.",
        building=building,
        things=things,
        start=Spot(at=dock.place(START_M, 0.0), yaw_deg=dock.yaw_deg),
    )


def write_plan(plan: Furnished, *, remark: str) -> str:
    """Return the text of the world file.

    Args:
        plan: What to write.
        remark: What stands above it, as a comment.
    """
    return "\n".join([f"# {remark}", *_lines(plan), ""])


def _lines(plan: Furnished) -> Iterator[str]:
    building, layout = plan.building, plan.building.layout
    names = _name_spaces(layout.spaces)
    yield f"title: {plan.title}"
    yield f"wall_height_m: {building.wall_height_m}"
    yield f"wall_thickness_m: {building.wall_thickness_m}"
    yield f"start: {{at: {_point(plan.start.at)}, yaw_deg: {_yaw(plan.start)}}}"
    yield from ("", "walls:")
    yield from (f"  - line: [{_point(start)}, {_point(end)}]" for start, end in layout.walls())
    yield from ("", "doors:")
    door_names = _number([f"{names[door.spaces[0]]} door" for door in layout.doors])
    for name, door in zip(door_names, layout.doors, strict=True):
        yield f"  - {{name: {name}, at: {_point(door.at)}, width_m: {door.width_m}}}"
    yield from ("", "rooms:")
    for space in layout.spaces:
        outline = ", ".join(_point(corner) for corner in space.outline)
        yield f"  - name: {names[space.name]}"
        yield f"    class: {space.room_class}"
        yield f"    outline: [{outline}]"
    yield from ("", "objects:")
    labels = iter(
        _number([thing.label for space in layout.spaces for thing in plan.things[space.name]])
    )
    for space in layout.spaces:
        yield f"  # {names[space.name]}"
        for thing in plan.things[space.name]:
            at = f"at: {_point(thing.spot.at)}, yaw_deg: {_yaw(thing.spot)}"
            yield f"  - {{name: {next(labels)}, kind: {thing.kind}, {at}}}"


def _name_spaces(spaces: Sequence[Space]) -> dict[str, str]:
    plain = [space.name.split("#")[0] for space in spaces]
    return dict(zip((space.name for space in spaces), _number(plain), strict=True))


def _number(names: Iterable[str]) -> list[str]:
    """Add numbers to names that come more than once."""
    all_names = list(names)
    total = Counter(all_names)
    seen: Counter[str] = Counter()
    numbered = []
    for name in all_names:
        seen[name] += 1
        numbered.append(name if total[name] == 1 else f"{name} {seen[name]}")
    return numbered


def _point(at: Corner) -> str:
    return f"[{at[0]:g}, {at[1]:g}]"


def _yaw(spot: Spot) -> int:
    turned = spot.yaw_deg % 360
    return turned - 360 if turned > 180 else turned
