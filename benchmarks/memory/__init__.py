"""How well a memory of places is turned into things: where they are, and what is answered.

A scripted observer stands in simulated buildings and writes down what it sees: directions off by
10 degrees (standard deviation), one view in five wrong (another label, or any direction), one thing
in three never. The memory gets these records and the map that an ideal LiDAR would make, and is
asked as `find_place` asks it; what is true serves for judging alone. Buildings that were at hand
when the memory was made are told apart from those held out. `python -m benchmarks.memory` shows
every building, with `--wrong` every wrong answer.
"""

from benchmarks.memory.measuring import measure

__all__ = ["measure"]
