"""Clearance, shortest paths, reachability and the distance to everything."""

from mapspeak.spatial.paths.distances import DistanceField, distances_from
from mapspeak.spatial.paths.lattice import clearance_m, known_clearance_m
from mapspeak.spatial.paths.route import Path, find_path

__all__ = [
    "DistanceField",
    "Path",
    "clearance_m",
    "distances_from",
    "find_path",
    "known_clearance_m",
]
