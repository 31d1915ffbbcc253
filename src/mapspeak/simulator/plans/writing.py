"""Writes a furnished building as a world file, as a person would write it."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from mapspeak.simulator.plans.furnishing import Spot, Thing
from mapspeak.simulator.plans.layout import Corner, Space
from mapspeak.simulator.plans.styles import Building

__all__ = ["Furnished", "write_plan"]


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


def write_plan(plan: Furnished, *, remark: str) -> str:
    """Gives the text of the world file.

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
    """Numbers names that come more than once."""
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
