"""How well a memory of places is turned into things: where they are, and what is answered.

A scripted observer stands in simulated buildings and writes down what it sees: directions off by
10 degrees (standard deviation), one view in five wrong (another label, or any direction), one thing
in three never. The memory gets these records and the map that an ideal LiDAR would make; what is
true is asked for judging alone. `python -m benchmarks.memory` shows every building.
"""

from benchmarks.memory.measuring import measure

__all__ = ["measure"]
