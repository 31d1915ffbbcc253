"""The map as geometry: plain functions over occupancy grids, numpy inside, values out."""

from mapspeak.spatial.grid import FREE_MAX, UNKNOWN, Cell, OccupancyGrid

__all__ = ["FREE_MAX", "UNKNOWN", "Cell", "OccupancyGrid"]
