"""What stands beside the paper's pictures: how large they are, and where in the map they lie."""

from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.picture import MapPicture


def say_plain(grid: OccupancyGrid, picture: MapPicture) -> str:
    """Gives the caption of the map in grey levels and nothing else."""
    return (
        f"{_say_placement(grid, picture)} Grey 127 is unknown, 255 free, darker the more surely "
        "occupied. x grows to the right and y upwards."
    )


def say_axes(grid: OccupancyGrid, picture: MapPicture) -> str:
    """Gives the caption of the map with its axes."""
    return (
        f"{_say_placement(grid, picture)} A grid line every {picture.spacing_m:g} m, numbered in "
        "metres of the map frame; x grows to the right and y upwards."
    )


def _say_placement(grid: OccupancyGrid, picture: MapPicture) -> str:
    view = picture.view
    left, bottom = view.area_corners()[3]
    return (
        f"Map picture, {view.width_px} x {view.height_px} px; the map in it has "
        f"{view.pixels_per_m * grid.resolution_m:g} px per cell of {grid.resolution_m:g} m; "
        f"lower left corner at x {left:.3f}, y {bottom:.3f}."
    )
