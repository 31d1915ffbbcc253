"""`mapspeak map`: map files without a robot, written in the forms asked for and told in lines."""

import io
import shutil
import sys
import warnings
from pathlib import Path
from typing import Any

import click
import numpy as np
from PIL import Image

from mapspeak.cli.mapjobs import MapJob, MapOptions, Output, find_maps, is_description, plan_jobs
from mapspeak.cli.shared.options import ANCHOR_OPTION, FILE, require_finite, usual_modes
from mapspeak.errors import ConfigError, MapError
from mapspeak.geometry import Point
from mapspeak.server.text.world.maps import (
    say_doubtful_door,
    say_map_warning,
    say_ranks,
    say_size,
    say_unsure,
)
from mapspeak.spatial.areagraph import build_area_graph
from mapspeak.spatial.coverage import measure_known_area
from mapspeak.spatial.mapfiles import LoadedMap, load_map, load_picture
from mapspeak.spatial.rooms import Door, Region, RoomClass, RoomMap, find_rooms


@click.command("map")
@click.argument("files", nargs=-1, required=True, type=FILE)
@click.option(
    "--resolution",
    "resolution_m",
    type=click.FloatRange(min=0, min_open=True),
    callback=require_finite,
    help="Metres per pixel, for bare pictures: 0 occupied, 205 unknown, 254 free.",
)
@click.option("--out", "picture", type=FILE, help="The annotated PNG.")
@click.option("--json", "facts", type=FILE, help="All facts as JSON.")
@click.option("--rooms", "labels", type=FILE, help="16-bit label picture.")
@click.option("--graph", type=FILE, help="The area graph as JSON.")
@click.option("--geojson", type=FILE, help="The area graph as GeoJSON.")
@click.option("--osm", type=FILE, help="The area graph as osmAG, for JOSM.")
@ANCHOR_OPTION
@click.option(
    "--from",
    "start",
    type=(float, float),
    callback=lambda _context, _option, given: None if given is None else Point(*given),
    metavar="X Y",
    help="Tell the way from here to each region, for a robot 0.4 m wide.",
)
@click.option(
    "--grey-unknown",
    "is_grey_unknown",
    is_flag=True,
    help="Take grey 205 for unknown, whatever free_thresh says.",
)
def map_command(files: tuple[Path, ...], **given: Any) -> None:  # noqa: ANN401 - click's options
    """Show map_server maps, or bare pictures, as a robot's map is shown; no robot is needed.

    FILES are .yaml files, pictures, folders of them, or quoted patterns such as
    "maps/**/map.yaml". With several maps, --out, --json, --rooms, --graph, --geojson and --osm
    name folders.
    """
    paths = {output: given.pop(output.name.lower()) for output in Output}
    outputs = {output: path for output, path in paths.items() if path is not None}
    options = MapOptions(**given)
    jobs = plan_jobs(find_maps(files), options, outputs)
    with usual_modes():
        n_failed = _show_maps(jobs, options)
    if n_failed and len(jobs) > 1:
        click.echo(f"{n_failed} of {len(jobs)} maps could not be read.", err=True)
    sys.exit(1 if n_failed else 0)


def _show_maps(jobs: list[MapJob], options: MapOptions) -> int:
    """Show one map after the other, and return the number that could not be read."""
    n_failed = 0
    tell = _tell_watcher if len(jobs) > 1 and sys.stderr.isatty() else _tell_nobody
    for number, job in enumerate(jobs, start=1):
        tell(f"{number} of {len(jobs)}: {job.file}")
        try:
            said, is_error = show_map(job, options), False
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


def show_map(job: MapJob, options: MapOptions) -> str:
    """Write what was asked for, and return a map's facts in a few lines.

    Raises:
        MapError: The map cannot be read, or cannot be written in the form asked for.
        ConfigError: A result cannot be written where it should go.
    """
    loaded = _load(job, options)
    rooms = find_rooms(loaded.grid)
    contents = {output: _content(output, job, options, loaded, rooms) for output in job.outputs}
    for output, content in contents.items():
        _write(job.outputs[output], content)
    return _summary(job, options.start, loaded, rooms)


def _content(
    output: Output, job: MapJob, options: MapOptions, loaded: LoadedMap, rooms: RoomMap
) -> bytes:
    # Each form is imported when it is wanted, so that a map is described at once.
    match output:
        case Output.PICTURE:
            from mapspeak.server.reports.mappicture import draw_rooms  # noqa: PLC0415

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

            text = to_geojson(graph, anchor=options.anchor)
        case Output.OSM:
            from mapspeak.spatial.areagraph.files import to_osm  # noqa: PLC0415

            text = to_osm(graph, anchor=options.anchor)
    return text.encode()


def _label_picture(rooms: RoomMap) -> bytes:
    """Return the labels with the highest row on top, as in the map file."""
    content = io.BytesIO()
    Image.fromarray(np.flipud(rooms.labels).astype(np.uint16)).save(content, format="PNG")
    return content.getvalue()


def _load(job: MapJob, options: MapOptions) -> LoadedMap:
    with warnings.catch_warnings():
        # How large a map may be is said in an error of our own.
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)
        if is_description(job.file) or options.resolution_m is None:
            return load_map(job.file, is_grey_unknown=options.is_grey_unknown)
        return load_picture(job.file, resolution_m=options.resolution_m)


def _write(path: Path, content: bytes) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    except OSError as error:
        raise ConfigError(
            f"{path} cannot be written: {error.strerror}.", hint="Choose another place for it."
        ) from error


def _summary(job: MapJob, start: Point | None, loaded: LoadedMap, rooms: RoomMap) -> str:
    grid, known = loaded.grid, measure_known_area(loaded.grid)
    cells = f"{grid.n_cols} x {grid.n_rows} cells of {grid.resolution_m:g} m"
    size = f"{grid.width_m:.1f} x {grid.height_m:.1f} m"
    unknown = f"{100 * (1 - known.known_ratio):.0f} % unknown"
    by_size = sorted(rooms.regions, key=lambda region: region.floor_area_m2)
    ways = _find_ways(start, loaded, by_size)
    return "\n".join(
        [
            f"{job.name}: {cells}, {size}, {known.free_area_m2:.1f} m2 free, {unknown}.",
            *(f"  warning: {say_map_warning(warning)}" for warning in loaded.warnings),
            *(f"  {line}" for line in _say_sizes(rooms, by_size)),
            *(_region_line(region, ways.get(region.id, "")) for region in by_size),
            *map(_door_line, rooms.doors),
        ]
    )


def _say_sizes(rooms: RoomMap, by_size: list[Region]) -> list[str]:
    """Say which room is the smallest and the largest, and which are perhaps no rooms."""
    named = [region for region in by_size if region.room_class is not RoomClass.CORRIDOR]
    doubtful = {room.id: door for room in named if (door := rooms.find_doubtful_door(room))}
    sure = [f"{r.id} ({r.floor_area_m2:.1f} m2)" for r in named if r.id not in doubtful]
    unsure = [
        (
            f"{r.id} ({r.floor_area_m2:.1f} m2, {say_doubtful_door(r, doubtful[r.id])})",
            doubtful[r.id],
        )
        for r in named
        if r.id in doubtful
    ]
    return [say_ranks(sure, is_of_all=True, has_unsure=bool(unsure)), *say_unsure(unsure)]


def _find_ways(start: Point | None, loaded: LoadedMap, regions: list[Region]) -> dict[str, str]:
    """Return how far it is to each region, in words; nothing unless asked for."""
    if start is None:
        return {}
    from mapspeak.ros.discovery.profile import USUAL_RADIUS_M  # noqa: PLC0415
    from mapspeak.spatial.paths.distances import distances_from  # noqa: PLC0415

    field = distances_from(loaded.grid, start, radius_m=USUAL_RADIUS_M)
    ways_m = {region.id: field.distance_to(region.widest) for region in regions}
    return {
        name: "  no way" if way_m is None else f"  way {way_m:.1f} m"
        for name, way_m in ways_m.items()
    }


def _region_line(region: Region, way: str) -> str:
    at = region.widest
    return (
        f"  {region.id:4} {region.room_class:10} {region.floor_area_m2:7.1f} m2  "
        f"{region.length_m:.1f} x {region.width_m:.1f} m  at {at.x + 0.0:.2f}, {at.y + 0.0:.2f}  "
        f"doors {' '.join(region.door_ids) or 'none'}{way}"
    )


def _door_line(door: Door) -> str:
    at, (one, other) = door.place, door.region_ids
    return (
        f"  {door.id:4} door       {door.width_m:7.2f} m   at {at.x + 0.0:.2f}, {at.y + 0.0:.2f}  "
        f"joins {one} and {other}"
    )
