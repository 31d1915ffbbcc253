"""`python -m tools.worldgen STYLE --seed N` writes a world file to standard output."""

import argparse
import sys

from tools.worldgen.drawing import draw_plan, style_names


def main() -> None:
    """Draw the building that the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m tools.worldgen", description=__doc__)
    parser.add_argument("style", choices=style_names())
    parser.add_argument("--seed", type=int, required=True, help="An even one draws a large one.")
    asked = parser.parse_args()
    sys.stdout.write(draw_plan(asked.style, seed=asked.seed))


if __name__ == "__main__":
    main()
