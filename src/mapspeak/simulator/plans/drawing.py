"""Draws a building of a style from a seed: again and again until it keeps every law."""

from collections.abc import Iterator
from contextlib import suppress

from mapspeak.errors import ConfigError
from mapspeak.simulator.plans.dice import Dice
from mapspeak.simulator.plans.furnishing import Spot, Thing, furnish
from mapspeak.simulator.plans.laws import APART_RATIO, find_faults
from mapspeak.simulator.plans.layout import Space
from mapspeak.simulator.plans.pieces import Piece
from mapspeak.simulator.plans.styles import STYLES, Building, Style
from mapspeak.simulator.plans.writing import Furnished, write_plan
from mapspeak.simulator.worldfiles import parse_world
from mapspeak.spatial.rooms import RoomClass

__all__ = ["draw_plan", "style_names"]

N_LAYOUTS, N_FURNISHINGS = 20_000, 60
START_M = 1.3
"""From the charging dock to where the robot starts."""
DOCK = Piece(label="charging dock", kind="charging_dock", front_m=START_M + 0.4)
AREA_RATIO = APART_RATIO + 0.1
"""Bare rooms differ by more than furnished ones have to."""


def style_names() -> tuple[str, ...]:
    """Gives the names of all styles."""
    return tuple(STYLES)


def draw_plan(style: str, *, seed: int) -> str:
    """Draws a building and gives its world file; an even seed gives a large one.

    Raises:
        ConfigError: There is no such style.
    """
    if style not in STYLES:
        raise ConfigError(f"There is no style {style!r}.", hint=f"Name one of {', '.join(STYLES)}.")
    remark = (
        f"Drawn by `python -m mapspeak.simulator.plans {style} --seed {seed}`."
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
