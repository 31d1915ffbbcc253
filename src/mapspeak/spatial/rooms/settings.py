"""The lengths, areas and ratios that decide what counts as a wall, a door and a room."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class RoomSettings:
    """One setting for every building; no field needs to change from map to map.

    Attributes:
        cell_size_m: The raster on which rooms are found, whatever the map's resolution.
        wall_length_m: A straight run of occupied cells this long, in a main direction, is wall.
        oblique_length_m: The same for any other direction.
        wall_reach_m: Shorter runs in line with a wall belong to it, up to this far from its ends.
        wall_piece_m: The shortest run that can be such a piece.
        wall_thickness_m: Where an obstacle is this thick, it is no such piece.
        island_size_m: An obstacle that can be walked around is wall only if it is larger.
        block_depth_m: Furniture is at least so deep.
        block_ratio: And with the wall behind it so many times as thick as the map's walls are.
        block_thickness_m: One of its sides is at most so long.
        block_length_m: The floor around it is at most this far, along the walls and square to
            them.
        direction_ratio: A main direction has at least this share of the strongest one's edges.
        pocket_area_m2: Unseen areas up to this size inside a room count as floor.
        smoothing_m: Standard deviation of the smoothing of clearances.
        same_width_ratio: Neighbouring places whose clearances differ less are one place.
        door_width_m: The widest narrow place that can divide two rooms.
        door_ratio: A narrow place in a wall divides if its half width is at most this share of
            the clearance of the narrower side.
        gap_ratio: The same for a narrow place with no wall in line with it.
        least_door_m: A narrower place is a gap beside furniture, or a door that is hardly open.
        leaf_width_m: Doors up to this width divide however wide the places behind them are.
        wide_ratio: A wider one divides if its half width is also at most this share of the
            clearance of the wider side.
        stub_m: The shortest piece of wall that makes an opening wider than a leaf, in line with
            it, a door whatever the clearances.
        tip_m: The thickest such piece.
        frame_m: The length of wall in line with a narrow place that makes it fully a door.
        mouth_width_m: The widest end of a corridor that opens straight into a wider place.
        mouth_ratio: Clearance of such a corridor over that of the wider place, at most.
        mouth_elongation: Area over the square of its width that makes it a corridor.
        mouth_area_m2: The smallest such corridor.
        room_area_m2: Smaller regions belong to their neighbour.
        niche_area_m2: The same for a region whose border has no wall in line with it.
    """

    cell_size_m: float = 0.05
    wall_length_m: float = 1.2
    oblique_length_m: float = 2.4
    wall_reach_m: float = 2.0
    wall_piece_m: float = 0.2
    wall_thickness_m: float = 0.5
    island_size_m: float = 2.0
    block_depth_m: float = 0.35
    block_ratio: float = 2.0
    block_thickness_m: float = 1.3
    block_length_m: float = 3.0
    direction_ratio: float = 0.2
    pocket_area_m2: float = 2.0
    smoothing_m: float = 0.1
    same_width_ratio: float = 0.8
    door_width_m: float = 2.4
    door_ratio: float = 0.8
    gap_ratio: float = 0.5
    least_door_m: float = 0.6
    leaf_width_m: float = 1.0
    wide_ratio: float = 0.6
    stub_m: float = 0.3
    tip_m: float = 0.25
    frame_m: float = 2.5
    mouth_width_m: float = 3.0
    mouth_ratio: float = 0.5
    mouth_elongation: float = 3.0
    mouth_area_m2: float = 4.0
    room_area_m2: float = 1.5
    niche_area_m2: float = 4.0
