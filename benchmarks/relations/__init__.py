"""How many goals named by relations are right, by truth that does not come from the code.

`python -m benchmarks.relations` lists those that are not. A goal is right when the pose can be
reached and stands as the words say, within bounds; also when nothing fits, with a margin, and the
answer is a refusal. It is wrong when an answer was given that does not fit.
"""

from benchmarks.relations.measuring import measure

__all__ = ["measure"]
