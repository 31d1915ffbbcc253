"""What answers claim of places, memory and ways out, computed anew as `statements` does."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from goldens.statements import NUMBER, ROUNDING, Checks, Fact, Statements, read_tables
from mapspeak.spatial.rooms import Door, Region
from mapspeak.worldmodel.model import WorldModel

Report = Mapping[str, Any]
RANKS = {"": 1, "second-": 2, "third-": 3, "fourth-": 4, "fifth-": 5}
TITLE = re.compile(
    rf"the (?P<rank>\w+-)?(?P<end>smallest|largest|nearest|farthest) "
    rf"(?:of (?P<n>\d+) )?(?P<kind>room|corridor|door|frontier)s?\b"
    rf"(?: of (?P<reached>\d+) that can be reached)?(?: so far)?,? (?P<value>{NUMBER})?"
)
CODED = re.compile(r"\bshowing (\d+) (?:to (\d+) )?of (\d+)")
PERCENT = re.compile(
    rf"^Explored: ({NUMBER}) m2 of free floor, (\d+) %: about ({NUMBER}) m2 more are expected"
)


def check_place(told: Statements, world: WorldModel, _text: str, report: Report) -> Iterator[Fact]:
    """Check what a phrase was taken for: the smallest, the nearest, the farthest."""
    said = str(report.get("reason", "")) or str(report.get("place", ""))
    found = TITLE.search(said)
    if found is None or ("verdict" in report and not re.fullmatch(r"[RCOD]\d+", report["place"])):
        return
    name, kind, end = report.get("place", "").partition(":")[0], found["kind"], found["end"]
    rank = RANKS.get(found["rank"] or "", 0)
    if not re.fullmatch(r"[RCODF]\d+", name) or not rank:
        return
    if end in ("smallest", "largest") and kind in ("room", "corridor"):
        yield from _check_size_rank(world, name, kind, end, rank, found["n"])
    elif kind == "door":
        yield from _check_door_rank(told, world, name, end, rank)


def _check_size_rank(
    world: WorldModel, name: str, kind: str, end: str, rank: int, n_told: str | None
) -> Iterator[Fact]:
    letters = "C" if kind == "corridor" else "RO"
    sure = [each for each in _regions(world, letters) if not world.rooms.find_doubtful_door(each)]
    regions = sure or _regions(world, letters)
    ordered = sorted(regions, key=lambda each: each.floor_area_m2, reverse=end == "largest")
    yield f"{name} is the {rank}. {end} {kind}", ordered[rank - 1].id == name
    if n_told:
        yield f"{n_told} {kind}s, not {len(ordered)}", int(n_told) == len(ordered)


def _regions(world: WorldModel, letters: str) -> list[Region]:
    return [each for each in world.rooms.regions if each.id[0] in letters]


def _check_door_rank(
    told: Statements, world: WorldModel, name: str, end: str, rank: int
) -> Iterator[Fact]:
    """Check a rank by ways; equally far ones within the grid may stand for each other."""
    try:
        ways = {door.id: _way_through_m(told, world, door) for door in world.rooms.doors}
    except LookupError:
        return
    reached = sorted(way for way in ways.values() if way is not None)
    order = reached if end == "nearest" else reached[::-1]
    own = ways.get(name)
    yield f"a way to {name}", own is not None
    if own is not None:
        slack_m = 4 * world.grid.resolution_m + 0.05 * own
        yield (
            f"{name} is the {rank}. {end} door: {own:.1f} m of {order[:3]}",
            abs(own - order[rank - 1]) <= slack_m,
        )


def _way_through_m(told: Statements, world: WorldModel, door: Door) -> float | None:
    point = world.find_crossing(door)
    here = (world.robot.x, world.robot.y)
    return None if point is None else told.way_m(world, here, (point.x, point.y))


def check_found(told: Statements, world: WorldModel, text: str, report: Report) -> Iterator[Fact]:
    """Check what was found: ways, rooms, counts, and which is called the nearest."""
    things = {each.id: each for each in world.things}
    places = {each.id for each in world.places}
    here = (world.robot.x, world.robot.y)
    candidates = report["candidates"]
    yield (
        f"{report['n_searched']} searched",
        report["n_searched"] <= len(things) + len(places),
    )
    yield "no more fit than are there", report["n_fitting"] <= report["n_searched"]
    for each in candidates:
        yield f"{each['id']} is remembered", each["id"] in things or each["id"] in places
        if each["path_m"] is not None and each["stand_at"] is not None:
            at = (each["stand_at"]["x"], each["stand_at"]["y"])
            yield (
                f"path to {each['id']}: {each['path_m']}",
                told.is_way(world, here, at, str(each["path_m"])),
            )
        yield f"{each['id']} was seen from where it says", set(each["seen_from"]) <= places
        if each["id"] in things and each["position"] is not None:
            at_told = things[each["id"]].thing.position
            yield (
                f"{each['id']} is where it says",
                at_told is not None
                and math.dist(each["position"], (at_told.x, at_told.y)) <= 2 * ROUNDING,
            )
    yield from _check_nearest_found(text, candidates)


def _check_nearest_found(text: str, candidates: Sequence[Report]) -> Iterator[Fact]:
    found = re.search(
        r"(\w+) (?:\"[^\"]*\" )?\(?(?:is |, )?(?:of (\d+) )?the nearest by path", text
    )
    ways = {each["id"]: each["path_m"] for each in candidates if each["path_m"] is not None}
    if found and found[1] in ways:
        alike = [each for each in candidates if each["score"] >= candidates[0]["score"] - 1e-6]
        least_m = min(ways[each["id"]] for each in alike if each["id"] in ways)
        yield f"{found[1]} is the nearest", ways[found[1]] <= least_m + ROUNDING


def check_blocked(
    told: Statements, world: WorldModel, text: str, _report: Report
) -> Iterator[Fact]:
    """Check that what is named as blocked is, and that nothing else is."""
    sections = {
        head.strip(): lines.splitlines()
        for head, _, lines in (part.partition("\n") for part in text.split("\n## ")[1:])
    }
    here = (world.robot.x, world.robot.y)
    named = {line.partition(" ")[0].rstrip(":") for each in sections.values() for line in each}
    is_cut = any("more" in line for each in sections.values() for line in each)
    for place in world.places:
        try:
            pose = place.waypoint.pose
            metres = told.way_m(world, here, (pose.x, pose.y))
        except LookupError:
            return
        yield (
            f"{place.id} has a way, or is named",
            is_cut or (metres is None) == (place.id in named),
        )
    for region in world.rooms.regions:
        if region.id in named or is_cut:
            continue
        yield f"{region.id} has a way", _can_enter(told, world, region)


def _can_enter(told: Statements, world: WorldModel, region: Region) -> bool:
    """Return True where a way leads to some cell of a region."""
    here = (world.robot.x, world.robot.y)
    rows, cols = (world.rooms.labels == region.index).nonzero()
    points = world.grid.points_at(rows, cols)
    return any(told.way_m(world, here, (x, y)) is not None for x, y in points.tolist())


def check_memory_size(
    _told: Statements, world: WorldModel, _text: str, report: Report
) -> Iterator[Fact]:
    """Check how many places are told to be remembered, and each by its id."""
    known = {each.id: each.waypoint for each in world.places}
    yield f"{report['n_places']} places, not {len(known)}", report["n_places"] == len(known)
    for each in report.get("waypoints", ()):
        at, told_at = known[each["id"]].pose, each["pose"]
        yield (
            f"{each['id']} stands where it says",
            math.dist((at.x, at.y), (told_at["x"], told_at["y"])) <= 0.01,
        )


def check_search(told: Statements, world: WorldModel, _text: str, report: Report) -> Iterator[Fact]:
    """Check how far from the robot each place is that it could look at next."""
    here = (world.robot.x, world.robot.y)
    for line in (*report["next"], report["looks_at"]):
        found = re.match(rf"\(({NUMBER}), ({NUMBER})\).* ({NUMBER}) m away", line)
        if found is None:
            continue
        straight_m = math.dist(here, (float(found[1]), float(found[2])))
        yield f"no shorter than straight: {line}", float(found[3]) >= straight_m - 3 * ROUNDING
        try:
            metres = told.way_m(world, here, (float(found[1]), float(found[2])))
        except LookupError:
            continue
        if metres is not None:
            yield f"as far as the way: {line}", abs(float(found[3]) - metres) <= 0.4


def check_route(
    _told: Statements, _world: WorldModel, _text: str, report: Report
) -> Iterator[Fact]:
    """Check that a route's metres add up, and that every stop is counted once."""
    if report["total_m"] is not None:
        total_m = sum(report["legs_m"])
        yield (
            f"{report['total_m']} m in all",
            abs(report["total_m"] - total_m) <= 0.06 * (1 + len(report["legs_m"])),
        )
    stops = [*report["done"], *report["skipped"], report["next"], *report["remaining"]]
    n_stops = len([each for each in stops if each])
    yield "a leg for every stop", n_stops == len(report["legs_m"])


def check_counts(
    _told: Statements, world: WorldModel, text: str, _report: Report
) -> Iterator[Fact]:
    """Check 'k of n' of every table, and the explored share."""
    for heading, rows in read_tables(text).items():
        found = CODED.search(heading)
        if found:
            n_shown = int(found[1]) if found[2] is None else int(found[2]) - int(found[1]) + 1
            yield f"{heading}: {len(rows)} shown", n_shown == len(rows)
            yield f"{heading}: fewer than all", n_shown <= int(found[3])
        if heading.startswith("Frontiers") and found and "Shown and listed" not in text:
            n_all = len(world.frontiers.frontiers)
            yield f"{heading}: of {n_all}", int(found[3]) == n_all
    share = next(filter(None, map(PERCENT.match, text.splitlines())), None)
    if share:
        known_m2, promised_m2 = float(share[1]), float(share[3])
        percent = 100 * known_m2 / (known_m2 + promised_m2)
        yield f"{share[2]} % explored, not {percent:.1f}", abs(int(share[2]) - percent) <= 1.5
        most_m2 = max(each.gain_m2 for each in world.frontiers.frontiers)
        yield (
            f"{share[3]} m2 expected, one promises {most_m2:.1f}",
            promised_m2 >= 0.75 * most_m2 - 0.1,
        )
    unnoted = re.search(r"^Rooms without a note: (.*)\.$", text, re.MULTILINE)
    if unnoted or "Every room has a note." in text:
        noted = {world.find_room_id(each.waypoint.pose.point) for each in world.places}
        left = {each.id for each in _regions(world, "RO")} - noted
        named = set(re.findall(r"\b[RO]\d+\b", unnoted[1])) if unnoted else set()
        is_whole = named == left or (" more" in text and named < left)
        yield f"no note of {sorted(left)}", is_whole
    reachable = re.search(r"^Of those with a way for the robot the smallest is (\w+) ", text)
    if reachable:
        yield (
            f"{reachable[1]} is there",
            any(each.id == reachable[1] for each in world.rooms.regions),
        )


CLAIMS: Mapping[str, Checks] = {
    "look_at_map": check_counts,
    "check_goal": check_place,
    "find_place": check_found,
    "what_is_blocked": check_blocked,
    "write_semantic_data": check_memory_size,
    "get_semantic_data": check_memory_size,
    "search_for": check_search,
    "follow_route": check_route,
}
