"""What a laser adds to bearings and ranges: the same looks without it and with it, side by side.

`python -m benchmarks.memory.withlaser --group drawn` looks at buildings for choosing. Each is known
by a fresh map, and by one of its bare walls, as before anybody moved in. Goals are judged by the
map that the robot has, so that on bare walls "faces" knows nothing of furniture in the way.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import click
import cv2
import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.memory.judging import Facing, Judged, Outcome
from benchmarks.memory.lasers import BODY_LIDAR_M, FLAT_LASER_M
from benchmarks.memory.measuring import SEEDS, Trial
from benchmarks.memory.places import PlaceError
from benchmarks.memory.sites import Site, build_drawn, build_fresh, build_newer

__all__ = ["main"]

GROUPS = {"drawn": build_drawn, "fresh": build_fresh, "newer": build_newer}
BANDS = {"without": None, "with laser": BODY_LIDAR_M, "with flat laser": FLAT_LASER_M}
WAY = "words alone"


@dataclass(slots=True)
class _Row:
    """All that came of one kind of observer.

    Attributes:
        errors: Of places of things.
        judged: Answers.
        took_s: Processor time.
        n_waypoints: For so many places.
    """

    errors: list[PlaceError] = field(default_factory=list)
    judged: list[Judged] = field(default_factory=list)
    took_s: float = 0.0
    n_waypoints: int = 0

    def add(self, trial: Trial) -> None:
        """Add a building."""
        self.errors += trial.errors
        self.judged += trial.judged[WAY]
        self.took_s += trial.took_s
        self.n_waypoints += trial.n_waypoints

    def cells(self) -> Iterator[str]:
        """Return the columns of the table."""
        offs = [min(error.ours_m, 99.0) for error in self.errors]
        yield f"{np.median(offs):.2f} / {np.percentile(offs, 90):.2f}"
        yield f"{sum(math.isinf(error.ours_m) for error in self.errors)}"
        made = [error for error in self.errors if math.isfinite(error.ours_m)]
        yield _percent([error.is_held for error in made])
        yield f"{np.median([error.radius_m for error in made]):.2f}"
        yield _percent([each.outcome is not Outcome.WRONG for each in self.judged])
        yield _percent([each.outcome is Outcome.WRONG for each in self.judged])
        yield _percent([each.outcome is Outcome.RIGHT for each in self.judged])
        yield _percent([each.facing is Facing.FACES for each in self.judged if each.facing])
        yield f"{1e3 * self.took_s / self.n_waypoints:.1f}"


COLUMNS = (
    "off m, median / 90 %",
    "no thing",
    "radius holds",
    "radius m",
    "right or honest",
    "wrong",
    "found, right",
    "faces",
    "CPU ms",
)


def measure_sites(
    sites: Sequence[Site], *, seeds: Sequence[int], bands: Sequence[str]
) -> dict[tuple[str, str], _Row]:
    """Return a row for each observer, without a laser and with the named ones."""
    rows: dict[tuple[str, str], _Row] = {}
    for site in sites:
        for seed in seeds:
            for kind in ("bearings", "ranges"):
                for band in bands:
                    trial = Trial(
                        site,
                        seed=seed,
                        has_ranges=kind == "ranges",
                        band_m=BANDS[band],
                        ways=(WAY,),
                    )
                    rows.setdefault((kind, band), _Row()).add(trial)
    return rows


@click.command()
@click.option("--group", type=click.Choice(list(GROUPS)), default="drawn", show_default=True)
@click.option("--map", "maps", type=click.Choice(["fresh", "bare"]), multiple=True)
@click.option("--seed", "seeds", type=int, multiple=True, default=SEEDS, show_default=True)
@click.option("--every", default=1, show_default=True, help="Takes one building of so many.")
@click.option("--flat", "has_flat", is_flag=True, help="Also a laser in one plane near the floor.")
def main(
    *, group: str, maps: Sequence[str], seeds: Sequence[int], every: int, has_flat: bool
) -> None:
    """Show what a laser adds, on fresh maps and on maps of bare walls."""
    cv2.setNumThreads(1)
    console = Console(width=150)
    bands = list(BANDS) if has_flat else list(BANDS)[:2]
    for of_map in maps or ("fresh", "bare"):
        sites = list(GROUPS[group](is_bare=of_map == "bare"))[::every]
        table = Table("observer", "laser", *COLUMNS, title=f"{group}, {of_map} map")
        for (kind, band), row in measure_sites(sites, seeds=seeds, bands=bands).items():
            table.add_row(kind, band, *row.cells())
        console.print(table)


def _percent(values: Sequence[bool]) -> str:
    return f"{100 * sum(values) / max(len(values), 1):.1f}"


if __name__ == "__main__":
    main()
