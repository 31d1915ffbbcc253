"""Area graphs in files."""

from collections.abc import Callable
from pathlib import Path

from mapspeak.errors import MapError
from mapspeak.spatial.areagraph.as_geojson import from_geojson
from mapspeak.spatial.areagraph.as_json import from_json
from mapspeak.spatial.areagraph.as_osm import from_osm
from mapspeak.spatial.areagraph.graph import AreaGraph

READERS: dict[str, Callable[[str], AreaGraph]] = {
    ".geojson": from_geojson,
    ".json": from_json,
    ".osm": from_osm,
}


def read_area_graph(path: Path) -> AreaGraph:
    """Reads an area graph from a .json, .geojson or .osm file that mapspeak wrote.

    Raises:
        MapError: The file is missing, damaged or something else.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise MapError(
            f"{path.name} is no file of an area graph.",
            hint=f"Give one that ends in {', '.join(READERS)}.",
        )
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise MapError(
            f"{path} cannot be read: {error.strerror or error}.", hint="Check its path."
        ) from error
    except UnicodeError as error:
        raise MapError(f"{path.name} is not UTF-8 text.", hint="Save it as UTF-8.") from error
    return reader(text)
