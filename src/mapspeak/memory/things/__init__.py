"""Things, joined out of what was seen of them from several places, and where they stand."""

from mapspeak.memory.things.approach import (
    find_approach,
    find_fronts,
    find_least_path_m,
    measure_faced,
)
from mapspeak.memory.things.finding import Things, find_things
from mapspeak.memory.things.sight import SightMap, build_sight_map
from mapspeak.memory.things.thing import NOISE, Category, NoiseModel, Thing, View, name_the_same

__all__ = [
    "NOISE",
    "Category",
    "NoiseModel",
    "SightMap",
    "Thing",
    "Things",
    "View",
    "build_sight_map",
    "find_approach",
    "find_fronts",
    "find_least_path_m",
    "find_things",
    "measure_faced",
    "name_the_same",
]
