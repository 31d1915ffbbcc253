"""`python -m mapspeak.simulator.plans STYLE --seed N` writes a world file to standard output."""

import argparse
import sys

from mapspeak.simulator.plans.drawing import draw_plan, style_names


def main() -> None:
    """Draws the building that the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m mapspeak.simulator.plans", description=__doc__)
    parser.add_argument("style", choices=style_names())
    parser.add_argument("--seed", type=int, required=True, help="An even one draws a large one.")
    asked = parser.parse_args()
    sys.stdout.write(draw_plan(asked.style, seed=asked.seed))


if __name__ == "__main__":
    main()
