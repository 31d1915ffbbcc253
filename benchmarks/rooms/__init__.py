"""How long it takes to divide a map into rooms, in one thread, and how well that agrees with truth.

The truth is that of people, and that of the plans of simulated buildings. People's maps are those
of the folder that the environment variable MAPSPEAK_LABELLED_MAPS names, else of `../shared/maps`
beside the checkout; where there is neither, they are left out. `python -m benchmarks.rooms MAPS`
shows people's maps as a table, beside published methods, and `python -m benchmarks.rooms --drawn`
what is wrong in each simulated building.
"""

from benchmarks.rooms.measuring import measure
from benchmarks.rooms.people import find_labelled_maps, list_labelled_maps

__all__ = ["find_labelled_maps", "list_labelled_maps", "measure"]
