"""Maps in words: regions, what is odd about a file, and why a frontier is worth a drive."""

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise

from mapspeak.robot import NavigationLook, NavigationPart
from mapspeak.server.text.wording import say_count
from mapspeak.spatial.frontiers import (
    Frontier,
    FrontierMerit,
    FrontierReport,
    FrontierVerdict,
    RefusalReason,
    RefusedFrontier,
)
from mapspeak.spatial.mapfiles import MapFileWarning, MapOddity
from mapspeak.spatial.rooms import Door, Region, RoomClass


def say_size(region: Region) -> str:
    """Say how large a region is, and how many doors it has: why it is of its kind."""
    doors = say_count(len(region.door_ids), "door")
    size = f"{region.length_m:.1f} x {region.width_m:.1f} m, {doors}"
    if region.room_class is RoomClass.OPEN_SPACE:
        return f"{size}, {2 * region.clearance_m:.2g} m wide at the widest"
    return size


def say_map_warning(warning: MapFileWarning) -> str:
    """Say what is odd about a map's files, and what to change."""
    match warning.oddity:
        case MapOddity.UNKNOWN_IS_FREE:
            return (
                f"{warning.n_cells:,} cells ({warning.share_ratio:.0%}) have the grey 205 that "
                "map_saver writes for unknown, but load as free: free_thresh is "
                f"{warning.free_thresh:g}. If nobody has seen those places, set "
                "free_thresh: 0.196."
            )
        case MapOddity.CROSSED_THRESHOLDS:
            return (
                f"free_thresh {warning.free_thresh:g} is not below occupied_thresh "
                f"{warning.occupied_thresh:g}. The usual values are free_thresh: 0.196 and "
                "occupied_thresh: 0.65."
            )
        case MapOddity.PICTURE_BESIDE:
            return f"The picture that it names is not there; {warning.picture} beside it was read."
        case MapOddity.NOTHING_FREE:
            return (
                "No cell of the map is free. Check negate and the thresholds: with negate: 0 "
                "white is free."
            )


def say_ranks(names: Sequence[str], *, is_of_all: bool, has_unsure: bool, so_far: str = "") -> str:
    """Say which of some rooms is the smallest and which the largest.

    Args:
        names: Of the rooms, smallest first.
        is_of_all: They are all the rooms there are.
        has_unsure: There are others that may be parts of rooms.
        so_far: " so far" where more may come.
    """
    among, kind = (so_far if is_of_all else " of these"), ("sure room" if has_unsure else "room")
    match names:
        case []:
            nothing = "No room is known yet." if is_of_all else "No room is among these."
            return "No room is sure yet." if has_unsure else nothing
        case [only]:
            return f"The only {kind}{among}: {only}."
        case [smallest, largest]:
            return f"The smaller {kind}{among} is {smallest}, the larger {largest}."
        case [smallest, second, *_, largest]:
            n_rooms = len(names)
            counted = f"{n_rooms} {kind}s{so_far}" if is_of_all else f"these {n_rooms} {kind}s"
            return (
                f"Of {counted} the smallest is {smallest}, then {second}; the largest is {largest}."
            )
        case _:
            raise AssertionError(names)


def say_doubtful_door(region: Region, door: Door) -> str:
    """Say what a region may be part of."""
    one, other = door.region_ids
    share = "maybe" if door.is_likely else "probably"
    return f"{share} part of {other if one == region.id else one}: {door.id}"


def say_unsure(sized: Sequence[tuple[str, Door]]) -> list[str]:
    """Say which rooms may be parts of others, and apart, which probably are.

    Args:
        sized: The rooms in words, each with its doubtful door.
    """
    maybe = [words for words, door in sized if door.is_likely]
    probably = [words for words, door in sized if not door.is_likely]
    titled = (("Maybe parts of others", maybe), ("Probably parts of others", probably))
    return [f"{title}: {', '.join(words)}." for title, words in titled if words]


MOST_SIGNS = 59
LEAST_DETOUR_M = 2.0
"""A round that grows by less is as short as another."""

MERITS = {
    FrontierMerit.BEST: "best",
    FrontierMerit.MOST_PER_METRE: "most to see per metre",
    FrontierMerit.MOST_TO_SEE: "most to see",
    FrontierMerit.NEAREST: "nearest",
}
REFUSED = {
    RefusalReason.LOOKED_ALREADY: "visited already",
    RefusalReason.NOTHING_TO_SEE: "with little to see",
    RefusalReason.NO_WAY: "behind walls",
    RefusalReason.TOO_NARROW: "too narrow for the robot",
    RefusalReason.PROVED_NARROW: "behind gaps that it did not pass",
    RefusalReason.DRIVE_FAILED: "where a drive failed",
}
"""Of reasons that are equally frequent, the first is told first."""


def say_merits(frontier: Frontier) -> str:
    """Say why a frontier stands where it stands in the ranking.

    Where it gets too long, clauses before the last make way.
    """
    if FrontierMerit.ONLY in frontier.merits:
        return "the only one"
    clauses, last = [MERITS[merit] for merit in frontier.merits], _say_detour(frontier.detour_m)
    while clauses and len(", ".join([*clauses, last])) > MOST_SIGNS:
        clauses.pop()
    return ", ".join([*clauses, last])


def _say_detour(detour_m: float | None) -> str:
    if detour_m is None:
        return "little to see per metre"
    if detour_m < LEAST_DETOUR_M:
        return "on the way"
    return f"a detour of {detour_m:.0f} m"


REFUSALS = {
    RefusalReason.NO_WAY: "behind a wall: no way over known floor",
    RefusalReason.LOOKED_ALREADY: "visited already, nothing new came into view",
    RefusalReason.DRIVE_FAILED: "a drive there failed, and the map has not changed there since",
    RefusalReason.CLOSED_OFF: "behind what is closed: no way while it is",
}


def say_refusal(border: RefusedFrontier) -> str:
    """Say why a border with the unknown is no place to go."""
    match border.reason:
        case RefusalReason.TOO_NARROW:
            needed_m = border.needed_width_m
            return f"gap of {border.gap_width_m:.1f} m, the robot needs {needed_m:.2f} m"
        case RefusalReason.PROVED_NARROW:
            gap = border.gap_at
            where = "" if gap is None else f" at {gap.x:.2f}, {gap.y:.2f}"
            return (
                f"behind the gap{where}, {border.gap_width_m:.2f} m wide by the map: a drive found "
                "no way through it"
            )
        case RefusalReason.NOTHING_TO_SEE:
            # Without its own gain, so that a list of borders says it once.
            return f"less than {border.least_gain_m2:.2f} m2 to see"
    return REFUSALS[border.reason]


def say_verdict(report: FrontierReport) -> str:
    """Say what is left to explore."""
    match report.verdict:
        case FrontierVerdict.NOTHING_KNOWN:
            return "No free floor is known yet."
        case FrontierVerdict.NONE_LEFT:
            return "No frontier is left: all known floor ends at walls."
        case FrontierVerdict.NONE_REACHABLE:
            return "No frontier can be reached: no free floor with room for the robot is near it."
        case FrontierVerdict.ALL_REFUSED:
            others = _count_refused(report) or "specks too short to be more than noise"
            return f"No frontier is left to go to; not offered: {others}."
        case FrontierVerdict.SOME_LEFT:
            others = f"; not offered: {_count_refused(report)}" if report.refused else ""
            return f"{say_count(len(report.frontiers), 'frontier')}{others}."


def _count_refused(report: FrontierReport) -> str:
    by_reason = Counter(border.reason for border in report.refused)
    most_first = sorted(REFUSED, key=lambda reason: -by_reason[reason])
    return ", ".join(
        f"{by_reason[reason]} {REFUSED[reason]}" for reason in most_first if by_reason[reason]
    )


NAVIGATION_PARTS = {
    NavigationPart.PLAN: "planned path",
    NavigationPart.FOOTPRINT: "footprint",
    NavigationPart.GLOBAL_COSTMAP: "global costmap",
    NavigationPart.LOCAL_COSTMAP: "local costmap",
}


def say_navigation(looks: Sequence[NavigationLook]) -> str:
    """Return what the robot's navigation tells of itself, a phrase a part, with its age."""
    told = {look.part: look for look in looks}
    silent = [name for part, name in NAVIGATION_PARTS.items() if part not in told]
    said = [f"{NAVIGATION_PARTS[look.part]} {say_navigation_part(look)}" for look in looks]
    said += [f"it publishes no {', no '.join(silent)}"] if silent else []
    return f"The robot's navigation: {'; '.join(said)}."


def say_navigation_part(look: NavigationLook) -> str:
    """Return what one part tells now."""
    if look.age_s is None:
        return "has told nothing yet"
    if look.unplaced_frame:
        return f"is told in the frame {look.unplaced_frame!r}, which TF does not join to the map"
    what = ""
    if look.part is NavigationPart.PLAN and look.lines:
        points = look.lines[0]
        length_m = sum(one.distance_to(other) for one, other in pairwise(points))
        end = points[-1]
        what = f"{length_m:.1f} m long, ends at x {end.x:.2f}, y {end.y:.2f}, "
    return f"{what}{look.age_s:.1f} s old"
