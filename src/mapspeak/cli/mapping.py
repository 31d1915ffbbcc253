"""`mapspeak map`: map files without a robot, written in the forms asked for and told in lines."""

import io
import shutil
import sys
import warnings
from pathlib import Path

import click
import numpy as np
from PIL import Image

from mapspeak.cli.mapjobs import MapJob, Output, find_maps, is_description, plan_jobs
from mapspeak.cli.options import ANCHOR_OPTION, FILE, usual_modes
from mapspeak.errors import ConfigError, MapError
from mapspeak.server.text.maps import say_map_warning, say_size
from mapspeak.spatial.areagraph import MapAnchor, build_area_graph
from mapspeak.spatial.coverage import measure_known_area
from mapspeak.spatial.mapfiles import LoadedMap, load_map, load_picture
from mapspeak.spatial.rooms import Region, RoomMap, find_rooms


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
@ANCHOR_OPTION
def map_command(
    files: tuple[Path, ...],
    resolution_m: float | None,
    anchor: MapAnchor | None,
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
    wanted = {
        Output.PICTURE: picture,
        Output.FACTS: facts,
        Output.LABELS: labels,
        Output.GRAPH: graph,
        Output.GEOJSON: geojson,
        Output.OSM: osm,
    }
    jobs = plan_jobs(
        find_maps(files),
        resolution_m=resolution_m,
        anchor=anchor,
        outputs={output: path for output, path in wanted.items() if path is not None},
    )
    with usual_modes():
        n_failed = _show_maps(jobs)
    if n_failed and len(jobs) > 1:
        click.echo(f"{n_failed} of {len(jobs)} maps could not be read.", err=True)
    sys.exit(1 if n_failed else 0)


def _show_maps(jobs: list[MapJob]) -> int:
    """Show one map after the other, and return how many could not be."""
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


def show_map(job: MapJob) -> str:
    """Write what was asked for, and return a map's facts in a few lines.

    Raises:
        MapError: The map cannot be read, or cannot be written in the form asked for.
        ConfigError: A result cannot be written where it should go.
    """
    loaded = _load(job.file, job.resolution_m)
    rooms = find_rooms(loaded.grid)
    contents = {output: _content(output, job, loaded, rooms) for output in job.outputs}
    for output, content in contents.items():
        _write(job.outputs[output], content)
    return _summary(job.name, loaded, rooms)


def _content(output: Output, job: MapJob, loaded: LoadedMap, rooms: RoomMap) -> bytes:
    # Each form is imported where it is wanted: a map is to be told at once.
    match output:
        case Output.PICTURE:
            from mapspeak.server.mapview.drawing import draw_rooms  # noqa: PLC0415

            return draw_rooms(rooms).png
        case Output.LABELS:
            return _label_picture(rooms)
    texts = {region.id: say_size(region) for region in rooms.regions}
    graph = build_area_graph(rooms, name=job.name, texts=texts)
    match output:
        case Output.FACTS:
            from mapspeak.server.reports.maps import MapFacts  # noqa: PLC0415

            text = MapFacts.of(loaded, graph).model_dump_json(indent=2) + "\n"
        case Output.GRAPH:
            from mapspeak.spatial.areagraph.files import to_json  # noqa: PLC0415

            text = to_json(graph)
        case Output.GEOJSON:
            from mapspeak.spatial.areagraph.files import to_geojson  # noqa: PLC0415

            text = to_geojson(graph, anchor=job.anchor)
        case Output.OSM:
            from mapspeak.spatial.areagraph.files import to_osm  # noqa: PLC0415

            text = to_osm(graph, anchor=job.anchor)
    return text.encode()


def _label_picture(rooms: RoomMap) -> bytes:
    """Return the labels with the highest row on top, as in the map file."""
    content = io.BytesIO()
    Image.fromarray(np.flipud(rooms.labels).astype(np.uint16)).save(content, format="PNG")
    return content.getvalue()


def _load(file: Path, resolution_m: float | None) -> LoadedMap:
    with warnings.catch_warnings():
        # How large a map may be is said in an error of our own.
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)
        if is_description(file) or resolution_m is None:
            return load_map(file)
        return load_picture(file, resolution_m=resolution_m)


def _write(path: Path, content: bytes) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    except OSError as error:
        raise ConfigError(
            f"{path} cannot be written: {error.strerror}.", hint="Choose another place for it."
        ) from error


def _summary(name: str, loaded: LoadedMap, rooms: RoomMap) -> str:
    grid, known = loaded.grid, measure_known_area(loaded.grid)
    cells = f"{grid.n_cols} x {grid.n_rows} cells of {grid.resolution_m:g} m"
    size = f"{grid.width_m:.1f} x {grid.height_m:.1f} m"
    unknown = f"{100 * (1 - known.known_ratio):.0f} % unknown"
    by_size = sorted(rooms.regions, key=lambda region: region.floor_area_m2)
    return "\n".join(
        [
            f"{name}: {cells}, {size}, {known.free_area_m2:.1f} m2 free, {unknown}.",
            *(f"  warning: {say_map_warning(warning)}" for warning in loaded.warnings),
            *map(_region_line, by_size),
        ]
    )


def _region_line(region: Region) -> str:
    at = region.widest
    return (
        f"  {region.id:4} {region.room_class:10} {region.floor_area_m2:7.1f} m2  "
        f"{region.length_m:.1f} x {region.width_m:.1f} m  at {at.x + 0.0:.2f}, {at.y + 0.0:.2f}  "
        f"doors {' '.join(region.door_ids) or 'none'}"
    )
