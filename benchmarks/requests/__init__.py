"""How many things are found that people ask for in plain and in abstract words, and how fast.

`python -m benchmarks.requests` shows the figures by kind; with `--tuning`, those of the requests
that settings may be chosen with.
"""

from benchmarks.requests.measuring import measure

__all__ = ["measure"]
