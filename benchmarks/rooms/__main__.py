"""`python -m benchmarks.rooms MAPS` shows the scores of maps that people have divided."""

from pathlib import Path

import click
import cv2

from benchmarks.rooms.drawn import show_worlds
from benchmarks.rooms.people import show_maps


@click.command()
@click.argument("maps", type=click.Path(exists=True, file_okay=False, path_type=Path), nargs=-1)
@click.option("--json", "as_json", is_flag=True, help="The scores of every map as JSON.")
@click.option("--drawn", is_flag=True, help="Simulated buildings too, and what is wrong in each.")
def main(maps: tuple[Path, ...], *, as_json: bool, drawn: bool) -> None:
    """Score the division of every map in MAPS that people have divided."""
    cv2.setNumThreads(1)
    for folder in maps:
        show_maps(folder, as_json=as_json)
    if drawn:
        show_worlds()


if __name__ == "__main__":
    main()
