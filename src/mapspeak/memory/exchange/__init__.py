"""The memory for other programs and people: GeoJSON, CSV, osmAG text, and two files as one."""

from mapspeak.memory.exchange.as_csv import from_csv, to_csv
from mapspeak.memory.exchange.as_geojson import from_geojson, to_geojson
from mapspeak.memory.exchange.as_osm import from_osm, to_osm
from mapspeak.memory.exchange.files import (
    ExchangeFormat,
    export_text,
    import_text,
    merge_files,
    merge_into,
)
from mapspeak.memory.exchange.records import facts_of, place_of
from mapspeak.memory.exchange.uniting import Union, unite

__all__ = [
    "ExchangeFormat",
    "Union",
    "export_text",
    "facts_of",
    "from_csv",
    "from_geojson",
    "from_osm",
    "import_text",
    "merge_files",
    "merge_into",
    "place_of",
    "to_csv",
    "to_geojson",
    "to_osm",
    "unite",
]
