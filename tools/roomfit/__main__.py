"""`python -m tools.roomfit MAPS` prints how well rooms are found in buildings left out.

MAPS holds folders of maps, each a folder with map.png, rooms.png and meta.json, as
`./run bench rooms` reads them; buildings are drawn besides, and all are made worse in four ways.
With `--write` the judge that mapspeak uses is replaced by the one fitted on all.
"""

import argparse
from pathlib import Path

from tools.roomfit.fitting import fit

JUDGED_BY = Path("src/mapspeak/spatial/rooms/data/joining.json")


def main() -> None:
    """Fit on what the command line names."""
    parser = argparse.ArgumentParser(prog="python -m tools.roomfit", description=__doc__)
    parser.add_argument("maps", type=Path)
    parser.add_argument("--parts", type=int, default=6)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--write", action="store_true", help=f"Write {JUDGED_BY}.")
    asked = parser.parse_args()
    text = fit(asked.maps, n_parts=asked.parts, n_rounds=asked.rounds)
    if asked.write:
        JUDGED_BY.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
