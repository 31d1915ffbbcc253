"""What answers state, computed anew from the map as the robot has it, by other means.

Distances are relaxed cell by cell, clearances measured point by point, ranks sorted from the rows
that were told: nothing here calls what made the answers but for the map itself, its rooms' cells
and the robot's pose.
"""

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from mapspeak.session import Session
from mapspeak.worldmodel.model import WorldModel
from mapspeak.worldmodel.revision import MapRevision

ROUNDING = 0.051
"""Of what is told with one digit."""
NUMBER = r"-?\d+(?:\.\d+)?"
FREE_BELOW = 50
CLOSED_MARGIN_M = 0.15
"""Ways keep this far from a closed area, beside the robot's radius."""
COARSE_CELLS = 500_000
"""From so many cells on the product measures ways over cells of twice the size."""
STEPS = tuple((row, col) for row in (-1, 0, 1) for col in (-1, 0, 1) if row or col)
Field = NDArray[np.float64]


@dataclass
class Statements:
    """Checks answers as they come, and keeps what was false.

    Args:
        session: Whose map it is.
        checks: By the names of tools; one tool may have several.
    """

    session: Session
    checks: Sequence[Mapping[str, "Checks"]]
    n_checked: int = 0
    false: list[str] = field(default_factory=list)
    _fields: dict[tuple[MapRevision, float, float], Field] = field(default_factory=dict)
    _explored: dict[str, Any] = field(default_factory=dict)

    def check(self, number: int, tool: str, text: str, structured: object) -> None:
        """Check all that an answer states, as far as it can be computed."""
        world = self.session.world
        if world is None or text.startswith("! "):
            return
        report = structured if isinstance(structured, Mapping) else {}
        for check in (each[tool] for each in self.checks if tool in each):
            for what, is_true in check(self, world, text, report):
                self.n_checked += 1
                if not is_true:
                    self.false.append(f"[{number}] {tool}: {what}")

    def say(self) -> list[str]:
        """Return how many statements were checked, and which were false."""
        return [f"{self.n_checked} checked, {len(self.false)} false", *self.false]

    def way_m(
        self, world: WorldModel, start: tuple[float, float], end: tuple[float, float]
    ) -> float | None:
        """Return the shortest way over free cells with room for the robot; None for no way.

        Raises:
            LookupError: A way from there cannot be computed here.
        """
        key = (world.map, *start)
        if key not in self._fields:
            self._fields = {key: _relax(world, start)}
        row, col = _cell(world, end)
        metres = float(self._fields[key][row, col]) * world.grid.resolution_m
        return metres if math.isfinite(metres) else None

    def is_way(
        self,
        world: WorldModel,
        start: tuple[float, float],
        end: tuple[float, float],
        told: str,
    ) -> bool:
        """Return True where the told length is that of the shortest way, or cannot be judged."""
        try:
            metres = self.way_m(world, start, end)
        except LookupError:
            return True
        if told.startswith("no way"):
            return metres is None
        if metres is None:
            return False
        slack_m = ROUNDING + 2 * world.grid.resolution_m
        if world.grid.cells.size >= COARSE_CELLS:
            slack_m += 0.05 * metres
        straight_m = math.dist(start, end)
        return abs(float(told) - max(metres, straight_m)) <= slack_m

    def explored(self, report: Mapping[str, Any]) -> Mapping[str, Any]:
        """Return what was told before of the same exploration; empty for a new one."""
        before = self._explored
        is_same = bool(before) and before["n_goals"] <= report["n_goals"]
        is_same = is_same and before["elapsed_s"] <= report["elapsed_s"]
        self._explored = dict(report)
        return before if is_same else {}


Fact = tuple[str, bool]


def _relax(world: WorldModel, start: tuple[float, float]) -> Field:
    """Return the cells of way to every cell, by relaxing all cells until none gets nearer."""
    if world.map.hindrances:
        raise LookupError("ways round what is to be avoided")
    grid = world.grid
    is_open = (grid.cells >= 0) & (grid.cells < FREE_BELOW)
    is_open &= ~_near_walls(grid.cells >= FREE_BELOW, world.radius_m / grid.resolution_m)
    if world.map.areas:
        closed_m = world.radius_m + CLOSED_MARGIN_M
        is_open &= ~_near_walls(_closed_cells(world), closed_m / grid.resolution_m)
    row, col = _cell(world, start)
    if not is_open[row, col]:
        raise LookupError("the robot stands where its map says it cannot")
    away: Field = np.full(grid.cells.shape, np.inf)
    away[row, col] = 0.0
    may_move = {step: _moves_into(is_open, *step) for step in STEPS}
    while True:
        nearer = away
        for step, may in may_move.items():
            moved = np.where(may, _shifted(away, *step, np.inf), np.inf)
            nearer = np.minimum(nearer, moved + math.hypot(*step))
        if np.array_equal(nearer, away):
            return away
        away = nearer


def _closed_cells(world: WorldModel) -> NDArray[np.bool_]:
    """Return the cells whose middle lies within an odd number of outlines of an area."""
    grid = world.grid
    rows, cols = (each.ravel() for each in np.indices(grid.cells.shape))
    x, y = grid.points_at(rows, cols).T
    closed = np.zeros(x.shape, dtype=bool)
    for area in world.map.areas:
        inside = np.zeros(x.shape, dtype=bool)
        for outline in area.outlines:
            for one, other in pairwise((*outline, outline[0])):
                crosses = (one.y > y) != (other.y > y)
                rise = (other.y - one.y) or math.inf
                inside ^= crosses & (x < one.x + (y - one.y) / rise * (other.x - one.x))
        closed |= inside
    return closed.reshape(grid.cells.shape)


def _moves_into(is_open: NDArray[np.bool_], down: int, across: int) -> NDArray[np.bool_]:
    """Return the cells that may be entered from that neighbour: not past the corner of a wall."""
    between = _shifted(is_open, down, 0, fill=0) & _shifted(is_open, 0, across, fill=0)
    return is_open & _shifted(is_open, down, across, fill=0) & between


Cells = TypeVar("Cells", bound=np.generic)


def _shifted(cells: NDArray[Cells], down: int, across: int, fill: float) -> NDArray[Cells]:
    """Return for each cell what its neighbour has."""
    n_rows, n_cols = cells.shape
    padded = np.full((n_rows + 2, n_cols + 2), fill, dtype=cells.dtype)
    padded[1:-1, 1:-1] = cells
    return padded[1 + down : 1 + down + n_rows, 1 + across : 1 + across + n_cols]


def _near_walls(wall: NDArray[np.bool_], reach: float) -> NDArray[np.bool_]:
    """Return where a wall is less than so many cells away."""
    near = np.zeros_like(wall)
    rows, cols = wall.shape
    whole = math.ceil(reach)
    for down in range(-whole, whole + 1):
        for across in range(-whole, whole + 1):
            if math.hypot(down, across) >= reach - 1e-6:
                continue
            into = np.s_[max(down, 0) : rows + min(down, 0), max(across, 0) : cols + min(across, 0)]
            out = np.s_[
                max(-down, 0) : rows + min(-down, 0), max(-across, 0) : cols + min(-across, 0)
            ]
            near[into] |= wall[out]
    return near


def _cell(world: WorldModel, at: tuple[float, float]) -> tuple[int, int]:
    grid = world.grid
    dx, dy = at[0] - grid.origin.x, at[1] - grid.origin.y
    yaw = grid.origin.yaw_rad
    along = math.cos(yaw) * dx + math.sin(yaw) * dy
    across = math.cos(yaw) * dy - math.sin(yaw) * dx
    row = min(max(int(across / grid.resolution_m), 0), grid.n_rows - 1)
    return row, min(max(int(along / grid.resolution_m), 0), grid.n_cols - 1)


def _robot(world: WorldModel) -> tuple[float, float]:
    return world.robot.x, world.robot.y


Row = dict[str, str]


def read_tables(text: str) -> dict[str, list[Row]]:
    """Return the rows of each table by its heading."""
    tables: dict[str, list[Row]] = {}
    for block in re.split(r"^## ", text, flags=re.MULTILINE)[1:]:
        heading, *lines = block.splitlines()
        lines = [line for line in lines if " | " in line]
        columns = [each.strip() for each in lines[0].split(" | ")] if lines else []
        tables[heading] = [
            dict(zip(columns, line.split(" | "), strict=False)) for line in lines[1:]
        ]
    return tables


def _number(text: str) -> float:
    found = re.match(NUMBER, text.strip())
    return math.inf if found is None else float(found[0])


def _point(text: str) -> tuple[float, float]:
    x, y = re.findall(NUMBER, text)[:2]
    return float(x), float(y)


def _is_rising(values: Sequence[float]) -> bool:
    return all(a <= b + ROUNDING for a, b in pairwise(values))


def _check_look(
    told: Statements, world: WorldModel, text: str, _report: Mapping[str, Any]
) -> Iterator[Fact]:
    cells, cell_m2 = world.grid.cells, world.grid.resolution_m**2
    if found := re.search(rf"^Robot: x ({NUMBER}), y ({NUMBER})", text, re.MULTILINE):
        at = float(found[1]), float(found[2])
        yield "the robot's pose", math.dist(at, _robot(world)) <= 2 * ROUNDING
    if found := re.search(rf"^Explored: ({NUMBER}) (?:m2|of)", text, re.MULTILINE):
        free_m2 = int(((cells >= 0) & (cells < FREE_BELOW)).sum()) * cell_m2
        yield f"explored {found[1]} m2, not {free_m2:.1f}", abs(float(found[1]) - free_m2) < 0.06
    tables = read_tables(text)
    yield from _check_frontiers(told, world, text, tables)
    yield from _check_rooms(told, world, text, tables)
    yield from _check_doors(world, tables)
    yield from _check_places(told, world, tables)


def _named(tables: Mapping[str, list[Row]], word: str) -> tuple[str, list[Row]]:
    return next(((head, rows) for head, rows in tables.items() if head.startswith(word)), ("", []))


def _check_frontiers(
    told: Statements, world: WorldModel, text: str, tables: Mapping[str, list[Row]]
) -> Iterator[Fact]:
    heading, rows = _named(tables, "Frontiers")
    known = {each.id: each for each in world.frontiers.frontiers}
    for row in rows:
        name, at = row["id"], _point(row["go to x, y"])
        yield f"{name} is a frontier", name in known
        yield (
            f"path to {name}: {row['path m']}",
            told.is_way(world, _robot(world), at, row["path m"]),
        )
    counted = re.search(r"(\d+) frontiers?[.;]", text)
    if counted and "Shown and listed" not in text and rows:
        part = re.search(r"showing \d+ of (\d+)", heading)
        n_rows = int(part[1]) if part else len(rows)
        yield f"{counted[1]} frontiers, {n_rows} in the table", int(counted[1]) == n_rows
    nearest = min(known.values(), key=lambda each: each.distance_m, default=None)
    for row in rows:
        is_nearest = nearest is not None and row["id"] == nearest.id
        if "nearest" in row["why"]:
            yield f"{row['id']} is the nearest", is_nearest
    if found := re.search(r"^Of all \d+: the nearest is (F\d+)", text, re.MULTILINE):
        yield f"{found[1]} is the nearest of all", nearest is not None and found[1] == nearest.id
    if found := re.search(r"most to see is from (F\d+)", text):
        gains = {name: each.gain_m2 for name, each in known.items()}
        yield f"{found[1]} shows most", gains[found[1]] == max(gains.values())


def _check_rooms(
    told: Statements, world: WorldModel, text: str, tables: Mapping[str, list[Row]]
) -> Iterator[Fact]:
    cells, labels = world.grid.cells, world.rooms.labels
    cell_m2 = world.grid.resolution_m**2
    is_free = (cells >= 0) & (cells < FREE_BELOW)
    indices = {region.id: region.index for region in world.rooms.regions}
    for heading, rows in tables.items():
        if not heading.startswith(("Rooms", "Corridors")):
            continue
        for row in rows:
            name = row["id"]
            yield f"{name} is there", name in indices
            inside = labels == indices.get(name, -1)
            free_m2 = int((inside & is_free).sum()) * cell_m2
            yield (
                f"free floor of {name}: {row['free m2']}, not {free_m2:.1f}",
                abs(_number(row["free m2"]) - free_m2) <= ROUNDING + 0.01,
            )
            yield (
                f"floor of {name} with what stands on it",
                (_number(row["floor m2"]) >= _number(row["free m2"]) - ROUNDING),
            )
            at = _point(row["stand at x, y"])
            yield (
                f"path to {name}: {row['path m']}",
                told.is_way(world, _robot(world), at, row["path m"]),
            )
            yield (
                f"doors of {name}",
                _are_doors_of(world, name, row["doors"]),
            )
        if "smallest first" in heading:
            yield heading, _is_rising([_number(row["floor m2"]) for row in rows])
    yield from _check_ranks(world, text)


def _doors_of(world: WorldModel, region_id: str) -> set[str]:
    return {door.id for door in world.rooms.doors if region_id in door.region_ids}


def _are_doors_of(world: WorldModel, region_id: str, told: str) -> bool:
    """Return True where all doors of a region are told, or so many more are said to be."""
    named, more = set(re.findall(r"D\d+", told)), re.search(r"(\d+) more", told)
    own = _doors_of(world, region_id)
    return named <= own and len(named) + (int(more[1]) if more else 0) == len(own)


def _check_ranks(world: WorldModel, text: str) -> Iterator[Fact]:
    """Check which room is called the smallest and which the largest, over the whole map."""
    found = re.search(
        r"^Of (\d+) (?:sure )?rooms(?: so far)? the smallest is (\w+) .*?, then (\w+) .*?; "
        r"the largest is (\w+) ",
        text,
        re.MULTILINE,
    )
    if found is None:
        return
    unsure_line = re.search(r"(?:Maybe|Probably) parts of others: (.*)\.$", text, re.MULTILINE)
    # "R2 (51.9+ m2, larger than R3)" is of R2.
    unsure = set(re.findall(r"\b([RO]\d+) \(", unsure_line[1])) if unsure_line else set()
    sizes = {
        region.id: region.floor_area_m2
        for region in world.rooms.regions
        if region.id[0] != "C" and region.id not in unsure
    }
    order = sorted(sizes, key=lambda each: sizes[each])
    yield f"{found[1]} rooms, not {len(order)}", int(found[1]) == len(order)
    yield f"{found[2]} is the smallest", found[2] == order[0]
    yield f"{found[3]} is the second-smallest", found[3] == order[1]
    yield f"{found[4]} is the largest", found[4] == order[-1]


def _check_doors(world: WorldModel, tables: Mapping[str, list[Row]]) -> Iterator[Fact]:
    heading, rows = _named(tables, "Doors")
    known = {door.id: door for door in world.rooms.doors}
    for row in rows:
        door = known.get(row["id"])
        yield f"{row['id']} is a door", door is not None
        if door is not None:
            yield (
                f"{door.id} joins {row['joins']}",
                set(row["joins"].split()) == set(door.region_ids),
            )
            beyond = world.robot.point.distance_to(door.place) - door.width_m / 2 - world.radius_m
            is_possible = _number(row["path m"]) >= beyond - 3 * world.grid.resolution_m - ROUNDING
            yield f"path to {door.id} is no shorter than straight", is_possible
    if rows:
        yield heading, _is_rising([_number(row["path m"]) for row in rows])


def _check_places(
    told: Statements, world: WorldModel, tables: Mapping[str, list[Row]]
) -> Iterator[Fact]:
    heading, rows = _named(tables, "Places")
    for row in rows:
        at = _point(row["at x, y, yaw"])
        yield (
            f"path to {row['id']}: {row['path m']}",
            told.is_way(world, _robot(world), at, row["path m"]),
        )
    if rows:
        yield heading, _is_rising([_number(row["path m"]) for row in rows])


def _check_measure(
    told: Statements, world: WorldModel, text: str, _report: Mapping[str, Any]
) -> Iterator[Fact]:
    tables = read_tables(text)
    heading, rows = _named(tables, "Ways from")
    start = _point(heading[heading.index("(") :])
    things = {each.id: each.thing.position for each in world.things}
    begin = things.get(heading.split()[2])
    for row in rows:
        end = _point(row["stand at x, y"])
        at = things.get(row["to"])
        # Of a thing that is meant by words no id is told here.
        if at is not None or re.fullmatch(r"[RCODFW]\d+|\(.*\)", row["to"]):
            straight_m = math.dist(
                start if begin is None else (begin.x, begin.y),
                end if at is None else (at.x, at.y),
            )
            yield (
                f"straight to {row['to']}",
                abs(_number(row["straight m"]) - straight_m) <= ROUNDING + 0.015,
            )
        yield (
            f"path to {row['to']} from {start}: {row['path m']}",
            told.is_way(world, start, end, row["path m"]),
        )
    yield "ways, nearest first", _is_rising([_number(row["path m"]) for row in rows])
    _, sizes = _named(tables, "Sizes")
    areas = [_number(row["floor m2"]) for row in sizes]
    yield "sizes, smallest first", _is_rising(areas)
    for row, area in zip(sizes, areas, strict=True):
        times = _number(row["times the smallest"])
        low, high = (
            (area - ROUNDING) / (areas[0] + ROUNDING),
            (area + ROUNDING) / (areas[0] - ROUNDING),
        )
        yield f"{row['id']} is {times} times the smallest", low - 0.01 <= times <= high + 0.01


def _check_goal(
    told: Statements, world: WorldModel, _text: str, report: Mapping[str, Any]
) -> Iterator[Fact]:
    pose = (report["pose"]["x"], report["pose"]["y"])
    if report["path_m"] is not None:
        yield (
            f"path to {report['place']}: {report['path_m']}",
            told.is_way(world, _robot(world), pose, str(report["path_m"])),
        )
    if report["clearance_m"] is not None:
        clear_m = _clearance_m(world, pose)
        near = abs(report["clearance_m"] - clear_m) <= 1.5 * world.grid.resolution_m
        yield f"clearance at {report['place']}: {report['clearance_m']}, not {clear_m:.2f}", near
    if report["room"] is not None:
        index = int(world.rooms.labels[_cell(world, pose)])
        names = {region.index: region.id for region in world.rooms.regions}
        yield f"{report['place']} is in {report['room']}", names.get(index) == report["room"]
    if report["verdict"] == "ok" and report["clearance_m"] is not None:
        yield (
            f"room for the robot at {report['place']}",
            (report["clearance_m"] >= world.radius_m - 0.011),
        )


def _clearance_m(world: WorldModel, at: tuple[float, float]) -> float:
    rows, cols = np.nonzero(world.grid.cells >= FREE_BELOW)
    if not rows.size:
        return math.inf
    row, col = _cell(world, at)
    return float(np.hypot(rows - row, cols - col).min()) * world.grid.resolution_m


def _check_description(
    _told: Statements, world: WorldModel, text: str, _report: Mapping[str, Any]
) -> Iterator[Fact]:
    for found in re.finditer(r"number (\d+) of (\d+) (room|corridor|open space)s", text):
        region = re.match(r"(\w+) is a ", text)
        if region is None:
            continue
        kind = {"room": "R", "corridor": "C", "open space": "O"}[found[3]]
        same = [each for each in world.rooms.regions if each.id[0] == kind]
        order = sorted(same, key=lambda each: each.floor_area_m2)
        ranks = {each.id: rank for rank, each in enumerate(order, 1)}
        yield f"{region[1]} is number {found[1]}", ranks[region[1]] == int(found[1])
        yield f"{found[2]} {found[3]}s", len(same) == int(found[2])
    for found in re.finditer(rf"Door (D\d+) to (\w+): ({NUMBER}) m wide", text):
        door = next(each for each in world.rooms.doors if each.id == found[1])
        yield f"{found[1]} leads to {found[2]}", found[2] in door.region_ids


def _check_drive(
    told: Statements, world: WorldModel, _text: str, report: Mapping[str, Any]
) -> Iterator[Fact]:
    del world
    latest = told.session.drives.latest
    at = (report["robot"]["x"], report["robot"]["y"])
    if report["state"] == "arrived":
        if latest is None or latest.goal_id != report["goal_id"]:
            return
        drive = latest
        off_m = math.dist(at, (drive.goal.x, drive.goal.y))
        yield f"{off_m:.2f} m from the goal", abs(report["distance_left_m"] - off_m) <= 0.02
    elif report["distance_left_m"] is not None and report["goal"] is not None:
        straight_m = math.dist(at, (report["goal"]["x"], report["goal"]["y"]))
        yield (
            "what is left is no shorter than straight",
            (report["distance_left_m"] >= straight_m - 0.3),
        )
    yield "time passes", report["elapsed_s"] >= 0.0


def _check_exploration(
    told: Statements, world: WorldModel, _text: str, report: Mapping[str, Any]
) -> Iterator[Fact]:
    ended = sum(report[name] for name in ("n_arrived", "n_seen", "n_blocked"))
    under_way = report["n_goals"] - ended
    yield f"{report['n_goals']} goals, {ended} ended", 0 <= under_way <= 1
    before = told.explored(report)
    for name in ("n_goals", "n_arrived", "n_seen", "n_blocked", "driven_m", "known_percent"):
        if before:
            yield f"{name} fell from {before[name]} to {report[name]}", before[name] <= report[name]
    cells = world.grid.cells
    free_m2 = int(((cells >= 0) & (cells < FREE_BELOW)).sum()) * world.grid.resolution_m**2
    yield (
        f"known {report['known_area_m2']}, not {free_m2:.1f}",
        (abs(report["known_area_m2"] - free_m2) <= ROUNDING + 0.01),
    )
    yield "frontiers are counted", report["n_frontiers"] == len(world.frontiers.frontiers)


Checks = Callable[[Statements, WorldModel, str, Mapping[str, Any]], Iterator[Fact]]
CHECKS: dict[str, Checks] = {
    "look_at_map": _check_look,
    "measure": _check_measure,
    "check_goal": _check_goal,
    "describe_place": _check_description,
    "navigate_to": _check_drive,
    "wait_for_goal": _check_drive,
    "explore": _check_exploration,
}
