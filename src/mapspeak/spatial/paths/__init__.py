"""Clearance, shortest paths, reachability and the distance to everything."""

from mapspeak.spatial.paths.clearance import clearance_m, known_clearance_m
from mapspeak.spatial.paths.distances import DistanceField, distances_from
from mapspeak.spatial.paths.path import Path
from mapspeak.spatial.paths.search import find_path
from mapspeak.spatial.paths.sight import cells_on_line

__all__ = [
    "DistanceField",
    "Path",
    "cells_on_line",
    "clearance_m",
    "distances_from",
    "find_path",
    "known_clearance_m",
]
