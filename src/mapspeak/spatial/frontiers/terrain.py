"""What all borders are judged by, computed once for the whole map."""

from dataclasses import dataclass

from mapspeak.spatial.grid import Mask, OccupancyGrid
from mapspeak.spatial.paths.distances import DistanceField
from mapspeak.spatial.paths.lattice import Clearance

__all__ = ["Terrain", "build_terrain"]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Terrain:
    """A map with what matters for looking over its borders.

    Attributes:
        distances: From the robot, by path.
        free: Where floor is known.
        reachable: Where the robot can get to.
        clearances_m: From every cell to the nearest obstacle.
    """

    distances: DistanceField
    free: Mask
    reachable: Mask
    clearances_m: Clearance

    @property
    def grid(self) -> OccupancyGrid:
        """The map."""
        return self.distances.lattice.grid

    @property
    def radius_m(self) -> float:
        """The robot's."""
        return self.distances.radius_m


def build_terrain(distances: DistanceField) -> Terrain:
    """Builds the terrain of the map that the distances belong to."""
    grid = distances.lattice.grid
    return Terrain(
        distances=distances,
        free=grid.free,
        reachable=distances.build_reachable_mask(),
        clearances_m=distances.lattice.fine_clearance_m,
    )
