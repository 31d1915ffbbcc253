"""Maps in words: what a region is, what is odd about a map's files, how one map lies on another."""

import math
from collections.abc import Awaitable

from mapspeak.errors import SemanticMapError
from mapspeak.memory.alignment.fitting import (
    LEAST_SHARED_M,
    Certainty,
    MapFit,
)
from mapspeak.memory.alignment.keeping import (
    MapComparison,
    MapRelation,
    RealignReceipt,
)
from mapspeak.memory.alignment.surfaces import (
    MapAgreement,
)
from mapspeak.server.text.offered import lead
from mapspeak.spatial.mapfiles import MapFileWarning, MapOddity
from mapspeak.spatial.rooms import Region, RoomClass


def say_size(region: Region) -> str:
    """Say how large a region is, and how many doors it has: why it is of its kind."""
    n_doors = len(region.door_ids)
    doors = "1 door" if n_doors == 1 else f"{n_doors} doors"
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
        case MapOddity.NOTHING_FREE:
            return (
                "No cell of the map is free. Check negate and the thresholds: with negate: 0 "
                "white is free."
            )


async def say_moved(comparing: Awaitable[MapComparison | None]) -> str:
    """Say what to do where the memory belongs to another map; empty where all is well."""
    try:
        comparison = await comparing
    except SemanticMapError as error:
        return str(error)
    if comparison is None or comparison.relation is MapRelation.SAME:
        return ""
    todo = lead(AFTER_MOVE.get(comparison.relation, UNSURE))
    return f"{say_comparison(comparison)} {todo}"


AFTER_MOVE = {
    MapRelation.MOVED: "Remembered poses are off by as much. {realign_memory} moves them.",
    MapRelation.OTHER: "Remembered poses mean nothing here: another memory belongs to it.",
}
UNSURE = "Remembered poses may be off. Let the robot see more, then call {realign_memory}."


def say_receipt(receipt: RealignReceipt) -> str:
    """Say what was moved, how the maps go together and how sure that is.

    Raises:
        SemanticMapError: Nothing was moved, since the maps do not tell surely enough how.
    """
    said, motion = say_comparison(receipt.comparison), receipt.motion
    if receipt.comparison.relation in (MapRelation.OTHER, MapRelation.UNKNOWN):
        raise SemanticMapError(
            f"The records stay where they are. {said}",
            hint="Let the robot see more of the building and try again, or use another file "
            "for this map.",
        )
    if motion is None or receipt.certainty is None:
        return f"Nothing had to be moved. {said}"
    turn_deg = math.degrees(motion.yaw_rad)
    return (
        f"{receipt.n_waypoints} waypoints, {receipt.n_events} events and "
        f"{receipt.n_observations} observations were moved: turned by {turn_deg:.1f} degrees "
        f"about the old map's origin, which lies at ({motion.x:.2f}, {motion.y:.2f}) now. {said} "
        f"The file as it was: {receipt.undo_path}. Certainty: {receipt.certainty}."
    )


def say_comparison(comparison: MapComparison) -> str:
    """Say how the records' map and the robot's go together, with figures."""
    relation, fit = comparison.relation, comparison.fit
    figures = _say_agreement(comparison.as_it_lies)
    if fit is None and relation is MapRelation.SAME:
        return f"The map is the one that the records belong to: {figures}."
    if fit is None and relation is MapRelation.UNKNOWN:
        return (
            f"Whether this is the map that the records belong to cannot be told yet: one of the "
            f"two maps shows {comparison.shortest_m:.0f} m of walls, and {LEAST_SHARED_M:.0f} m "
            "are needed."
        )
    said = f"{_RELATIONS[relation]} As they lie, {figures}."
    return said if fit is None else f"{said} {_say_fit(fit)}"


_RELATIONS = {
    MapRelation.SAME: "The map is the one that the records belong to, with changes in it.",
    MapRelation.MOVED: "The building is the one that the records belong to, but its map has moved.",
    MapRelation.OTHER: "This map shows another building than the one that the records belong to, "
    "or another part of it.",
    MapRelation.UNKNOWN: "Whether this is the map that the records belong to cannot be told.",
}
_CERTAINTIES = {
    Certainty.SURE: "This is sure.",
    Certainty.LIKELY: "This is likely right.",
    Certainty.AMBIGUOUS: "The building looks alike in both places: which one is right cannot be "
    "told from its walls.",
    Certainty.UNSURE: "This is not enough to rely on.",
}


def _say_agreement(quality: MapAgreement) -> str:
    return (
        f"{quality.agreement_ratio:.0%} of the walls that both maps show agree "
        f"({quality.shared_m:.0f} m, {quality.overlap_ratio:.0%} of the smaller map)"
    )


def _say_fit(fit: MapFit) -> str:
    turn = f"turned by {math.degrees(fit.new_from_old.yaw_rad):.1f} degrees"
    said = (
        f"Laid on the new map {turn} and shifted so that its middle moves {fit.off_m:.2f} m, "
        f"{_say_placing(fit.quality)}"
    )
    rival = "no other place comes near"
    if fit.rival is not None:
        rival = f"in the next best place, {_say_placing(fit.rival)}"
    return f"{said}; {rival}. {_CERTAINTIES[fit.certainty]}"


def _say_placing(quality: MapAgreement) -> str:
    return (
        f"{quality.agreement_ratio:.0%} of the walls agree, of {quality.shared_m:.0f} m that both "
        f"maps show ({quality.overlap_ratio:.0%} of the smaller map)"
    )
