"""Maps in words: what a region is, and what is odd about a map's files."""

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
