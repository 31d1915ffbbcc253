"""`mapspeak memory export`, `import` and `merge`: a memory for other programs and people."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from mapspeak.cli.memory.files import (
    MEMORY_OPTION,
    find_memory,
    open_memory,
    read_places,
    write_out,
)
from mapspeak.cli.options import FILE
from mapspeak.errors import ConfigError, say_cause

if TYPE_CHECKING:
    from mapspeak.semantic.exchange import ExchangeFormat, Union

FORMATS = ("geojson", "csv", "osm")


@click.command()
@click.option(
    "--format", "form", type=click.Choice(FORMATS), help="Follows from --out if left away."
)
@click.option("--out", type=FILE, help="The file; stdout without.")
@click.option(
    "--anchor",
    type=(float, float, float),
    metavar="LAT LON YAW",
    help="Where on Earth the map's (0, 0) lies, and its x axis from east, in degrees.",
)
@MEMORY_OPTION
def export(
    form: str | None,
    out: Path | None,
    anchor: tuple[float, float, float] | None,
    semantic_map: Path | None,
) -> None:
    """Writes the places as GeoJSON, CSV, or osmAG for JOSM."""
    from mapspeak.semantic.exchange import export_text  # noqa: PLC0415 - heavy; help must be quick
    from mapspeak.spatial.areagraph import MapAnchor  # noqa: PLC0415

    wanted = _format(form, out, "--out")
    place = None
    if anchor is not None:
        lat_deg, lon_deg, yaw_deg = anchor
        place = MapAnchor(lat_deg=lat_deg, lon_deg=lon_deg, yaw_rad=math.radians(yaw_deg))
    places = read_places(open_memory(semantic_map))
    write_out(export_text(places, wanted, anchor=place), out)
    if out is not None:
        click.echo(f"{len(places.waypoints)} places written to {out}.")


@click.command("import")
@click.argument("file", type=FILE)
@click.option(
    "--format", "form", type=click.Choice(FORMATS), help="Follows from FILE if left away."
)
@MEMORY_OPTION
def import_(file: Path, form: str | None, semantic_map: Path | None) -> None:
    """Joins what was exported, and perhaps edited, into the semantic map file: all or nothing."""
    from mapspeak.semantic import SemanticMapStore  # noqa: PLC0415 - heavy; help must be quick
    from mapspeak.semantic.exchange import import_text, merge_into  # noqa: PLC0415

    wanted = _format(form, file, "FILE")
    try:
        # Line ends within a cell of CSV are the cell's own.
        text = file.read_bytes().decode("utf-8-sig")
    except (OSError, UnicodeError) as error:
        raise ConfigError(
            f"{file} cannot be read: {say_cause(error)}.", hint="Check its path."
        ) from error
    store = SemanticMapStore(find_memory(semantic_map))
    _tell(merge_into(store, import_text(text, wanted)), store.path)


@click.command()
@click.argument("first", type=FILE)
@click.argument("second", type=FILE)
@click.option("--out", type=FILE, required=True, help="The new file; must not be there yet.")
def merge(first: Path, second: Path, out: Path) -> None:
    """Joins two semantic map files of one map, and their observations, into a new one."""
    from mapspeak.semantic.exchange import merge_files  # noqa: PLC0415 - heavy; help must be quick

    union, came = merge_files(first, second, out=out)
    _tell(union, out)
    click.echo(f"{came.n_observations} observations and {came.n_pictures} pictures came along.")


def _format(given: str | None, file: Path | None, what: str) -> "ExchangeFormat":
    from mapspeak.semantic.exchange import ExchangeFormat  # noqa: PLC0415 - heavy

    name = given or (file.suffix.lower().removeprefix(".") if file else "")
    if name not in FORMATS:
        raise ConfigError(
            f"{what} does not say the format.", hint=f"Add --format {', '.join(FORMATS)}."
        )
    return ExchangeFormat(name)


def _tell(union: "Union", path: Path) -> None:
    for finding in union.findings:
        click.echo(finding)
    n_changed, n_all = len(union.changed), len(union.places.waypoints)
    click.echo(f"{n_changed} places new or changed, {n_all} in {path}.")
