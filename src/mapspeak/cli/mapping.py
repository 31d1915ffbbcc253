"""`mapspeak map`: map files without a robot."""

import math
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from mapspeak.cli.guarding import usual_modes
from mapspeak.cli.options import FILE
from mapspeak.errors import MapError

if TYPE_CHECKING:
    from mapspeak.cli.mapjobs import MapJob


@click.command("map")
@click.argument("files", nargs=-1, required=True, type=FILE)
@click.option(
    "--resolution",
    "resolution_m",
    type=click.FloatRange(min=0, min_open=True),
    help="Metres per pixel, for bare pictures: 0 occupied, 205 unknown, 254 free.",
)
@click.option("--out", "picture", type=FILE, help="The annotated PNG.")
@click.option("--json", "facts", type=FILE, help="All facts as JSON.")
@click.option("--rooms", "labels", type=FILE, help="16-bit label picture.")
@click.option("--graph", type=FILE, help="The area graph as JSON.")
@click.option("--geojson", type=FILE, help="The area graph as GeoJSON.")
@click.option("--osm", type=FILE, help="The area graph as osmAG, for JOSM.")
@click.option(
    "--anchor",
    type=(float, float, float),
    metavar="LAT LON YAW",
    help="Where on Earth the map's (0, 0) lies, and its x axis from east, in degrees.",
)
def map_command(
    files: tuple[Path, ...],
    resolution_m: float | None,
    anchor: tuple[float, float, float] | None,
    picture: Path | None,
    facts: Path | None,
    labels: Path | None,
    graph: Path | None,
    geojson: Path | None,
    osm: Path | None,
) -> None:
    """Show map_server maps, or bare pictures, as a robot's map is shown; no robot is needed.

    FILES are .yaml files, pictures, folders of them, or quoted patterns such as
    "maps/**/map.yaml". With several maps, --out, --json, --rooms, --graph, --geojson and --osm
    name folders.
    """
    from mapspeak.cli.mapjobs import Output, find_maps, plan_jobs  # noqa: PLC0415
    from mapspeak.spatial.areagraph import MapAnchor  # noqa: PLC0415

    wanted = {
        Output.PICTURE: picture,
        Output.FACTS: facts,
        Output.LABELS: labels,
        Output.GRAPH: graph,
        Output.GEOJSON: geojson,
        Output.OSM: osm,
    }
    place = None
    if anchor is not None:
        lat_deg, lon_deg, yaw_deg = anchor
        place = MapAnchor(lat_deg=lat_deg, lon_deg=lon_deg, yaw_rad=math.radians(yaw_deg))
    jobs = plan_jobs(
        find_maps(files),
        resolution_m=resolution_m,
        anchor=place,
        outputs={output: path for output, path in wanted.items() if path is not None},
    )
    with usual_modes():
        n_failed = _show_maps(jobs)
    if n_failed and len(jobs) > 1:
        click.echo(f"{n_failed} of {len(jobs)} maps could not be read.", err=True)
    sys.exit(1 if n_failed else 0)


def _show_maps(jobs: "list[MapJob]") -> int:
    """Show one map after the other, and return how many could not be."""
    from mapspeak.cli.mapshowing import show_map  # noqa: PLC0415 - heavy; help must be quick

    n_failed = 0
    tell = _tell_watcher if len(jobs) > 1 and sys.stderr.isatty() else _tell_nobody
    for number, job in enumerate(jobs, start=1):
        tell(f"{number} of {len(jobs)}: {job.file}")
        try:
            said, is_error = show_map(job), False
            if job.outputs:
                said += f"\nWritten: {', '.join(map(str, job.outputs.values()))}"
        except MapError as error:
            said, is_error = f"mapspeak: {job.file}: {error}", True
        tell("")
        click.echo(said, err=is_error)
        n_failed += is_error
    return n_failed


def _tell_watcher(text: str) -> None:
    """Show a line in place of the one before it."""
    width = shutil.get_terminal_size().columns - 1
    click.echo(f"\r\x1b[2K{text[:width]}", nl=False, err=True)


def _tell_nobody(_text: str) -> None:
    """Leave a log or a pipe as it is."""
