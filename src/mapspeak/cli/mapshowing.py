"""One map read, divided, written in the forms that were asked for, and told in a few lines."""

import io
import warnings
from pathlib import Path

import numpy as np
from PIL import Image

from mapspeak.cli.mapjobs import MapJob, Output, is_description
from mapspeak.errors import ConfigError
from mapspeak.server.mapview.facts import MapFacts, RegionFacts
from mapspeak.server.text.maps import say_size
from mapspeak.spatial.areagraph import (
    AreaGraph,
    MapAnchor,
    build_area_graph,
    to_geojson,
    to_json,
    to_osm,
)
from mapspeak.spatial.mapfiles import LoadedMap, load_map, load_picture
from mapspeak.spatial.rooms import RoomMap, find_rooms


def show_map(job: MapJob) -> str:
    """Write what was asked for, and return a map's facts in a few lines.

    Raises:
        MapError: The map cannot be read, or cannot be written in the form asked for.
        ConfigError: A result cannot be written where it should go.
    """
    loaded = _load(job.file, job.resolution_m)
    rooms = find_rooms(loaded.grid)
    texts = {region.id: say_size(region) for region in rooms.regions}
    graph = build_area_graph(rooms, name=job.name, texts=texts)
    facts = MapFacts.of(loaded, graph)
    contents = {output: _content(output, rooms, graph, facts, job.anchor) for output in job.outputs}
    for output, content in contents.items():
        _write(job.outputs[output], content)
    return _summary(facts)


def _content(
    output: Output, rooms: RoomMap, graph: AreaGraph, facts: MapFacts, anchor: MapAnchor | None
) -> bytes:
    match output:
        case Output.PICTURE:
            from mapspeak.server.mapview.drawing import draw_rooms  # noqa: PLC0415 - heavy

            return draw_rooms(rooms).png
        case Output.FACTS:
            return (facts.model_dump_json(indent=2) + "\n").encode()
        case Output.LABELS:
            return _label_picture(rooms)
        case Output.GRAPH:
            return to_json(graph).encode()
        case Output.GEOJSON:
            return to_geojson(graph, anchor=anchor).encode()
        case Output.OSM:
            return to_osm(graph, anchor=anchor).encode()


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


def _summary(facts: MapFacts) -> str:
    cells = f"{facts.n_cols} x {facts.n_rows} cells of {facts.resolution_m:g} m"
    size = f"{facts.width_m:.1f} x {facts.height_m:.1f} m"
    seen = f"{facts.free_area_m2:.1f} m2 free, {100 * facts.unknown_ratio:.0f} % unknown"
    return "\n".join(
        [
            f"{facts.name}: {cells}, {size}, {seen}.",
            *(f"  warning: {warning}" for warning in facts.warnings),
            *(_region_line(region) for region in facts.regions),
        ]
    )


def _region_line(region: RegionFacts) -> str:
    return (
        f"  {region.id:4} {region.kind:10} {region.floor_area_m2:7.1f} m2  "
        f"{region.length_m:.1f} x {region.width_m:.1f} m  at {region.centre.x:.2f}, "
        f"{region.centre.y:.2f}  doors {' '.join(region.doors) or 'none'}"
    )
