"""The memory as CSV, for spreadsheets: a row for each place, and for each thing seen from it.

The column `place` says which place a row belongs to, `kind` what it is: the place itself
("waypoint") or an item of one of its lists. A cell without a value is empty. What the format cannot
hold are comments, people's own keys, and the map of a memory without a place.

No text is a formula to a spreadsheet (OWASP, CSV injection): `=1` is written as `'=1`, also behind
what some spreadsheets take for the end of a cell, and loses that sign again when it is read.
"""

import csv
import io
import re
from collections.abc import Iterator

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point
from mapspeak.installation import shell_command
from mapspeak.memory.exchange.records import Facts, facts_of, map_from, place_of
from mapspeak.memory.waypoint import SemanticMap, Waypoint, name_key

_FIRST_COLUMNS = ("place", "kind", "label", "x_m", "y_m", "yaw_deg", "bearing_deg", "range_m")
_PLACE = "waypoint"
_FORMULA = r"'*[=+@\uff1d\uff0b\uff20\uff0d-]"
_BARE = re.compile(rf"(^|[;,|\t\r\n])({_FORMULA})")
_DISARMED = re.compile(rf"(^|[;,|\t\r\n])'({_FORMULA})")


def to_csv(places: SemanticMap) -> str:
    """Return the memory as CSV with a header; x and y are metres in the map frame."""
    rows = [row for place in places.waypoints for row in _rows(place, places.map_id)]
    columns = dict.fromkeys((*_FIRST_COLUMNS, *(key for row in rows for key in row), "map"))
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, list(columns), lineterminator="\n")
    writer.writeheader()
    writer.writerows({key: _disarmed(cell) for key, cell in row.items()} for row in rows)
    return text.getvalue()


def from_csv(text: str) -> SemanticMap:
    """Read the memory that `to_csv` wrote; the order of rows and columns makes no difference.

    Raises:
        SemanticMapError: It is not CSV, or no memory.
    """
    reader = csv.DictReader(io.StringIO(text, newline=""), strict=True)
    try:
        rows = [
            (reader.line_num, {key: _as_said(cell) for key, cell in row.items() if key and cell})
            for row in reader
        ]
    except csv.Error as error:
        raise _refusal(reader.line_num, f"{error}") from error
    if not {"place", "kind"} <= set(reader.fieldnames or ()):
        raise _refusal(1, "the columns 'place' and 'kind' are missing")
    records: dict[str, tuple[Point, Facts]] = {}
    map_ids = set()
    for line, row in rows:
        if row.get("kind") == _PLACE:
            map_ids.add(row.pop("map", None))
            key = name_key(row.get("place", ""))
            if key in records:
                raise _refusal(line, f"a second place is called '{row.get('place')}'")
            records[key] = (_point(line, row), _without_frame(row) | {"name": row.get("place")})
    if len(map_ids) > 1:
        raise SemanticMapError(
            f"The places are of {len(map_ids)} maps.", hint="Make one file for each map."
        )
    for line, row in rows:
        if row.get("kind") != _PLACE:
            _add_item(records, line, row)
    map_id = map_ids.pop() if map_ids else None
    return map_from(records.values(), map_id=map_id, form="CSV")


def _rows(place: Waypoint, map_id: str | None) -> Iterator[Facts]:
    facts, point = facts_of(place), place_of(place)
    del facts["name"]
    lists = {key: value for key, value in facts.items() if isinstance(value, list)}
    head: Facts = {"place": place.name, "kind": _PLACE, "x_m": point.x, "y_m": point.y}
    said = {key: value for key, value in facts.items() if key not in lists}
    yield head | said | ({} if map_id is None else {"map": map_id})
    for kind, items in lists.items():
        for item in items:
            entries = item if isinstance(item, dict) else {"label": item}
            yield {"place": place.name, "kind": kind} | _flat(entries)


def _disarmed(cell: object) -> object:
    """Return a text that no spreadsheet computes; a number is one as it is."""
    return _BARE.sub(r"\1'\2", cell) if isinstance(cell, str) else cell


def _as_said(cell: str) -> str:
    return _DISARMED.sub(r"\1\2", cell)


def _flat(entries: Facts) -> Facts:
    """Return a cell for each value: `seen_from:x` where the file has one mapping in another."""
    cells: Facts = {}
    for key, value in entries.items():
        parts = value if isinstance(value, dict) else {"": value}
        cells |= {f"{key}:{name}" if name else key: part for name, part in parts.items()}
    return cells


def _nested(cells: Facts) -> Facts:
    entries: Facts = {}
    for name, cell in cells.items():
        key, _, part = name.partition(":")
        branch = entries.setdefault(key, {}) if part else None
        if isinstance(branch, dict):
            branch[part] = cell
        else:
            entries[key] = cell
    return entries


def _add_item(records: dict[str, tuple[Point, Facts]], line: int, row: dict[str, str]) -> None:
    record = records.get(name_key(row.get("place", "")))
    if record is None:
        raise _refusal(line, f"no row of kind '{_PLACE}' is for the place '{row.get('place')}'")
    said = _nested(_without_frame(row))
    items = record[1].setdefault(row.get("kind", ""), [])
    if not isinstance(items, list):
        raise _refusal(line, f"'{row.get('kind')}' is no list of a place")
    items.append(said["label"] if said.keys() == {"label"} else said)


def _without_frame(row: dict[str, str]) -> Facts:
    return {key: cell for key, cell in row.items() if key not in ("place", "kind", "x_m", "y_m")}


def _point(line: int, row: dict[str, str]) -> Point:
    try:
        return Point(float(row["x_m"]), float(row["y_m"]))
    except (KeyError, ValueError) as error:
        raise _refusal(line, "x_m and y_m are not two numbers") from error


def _refusal(line: int, said: str) -> SemanticMapError:
    return SemanticMapError(
        f"This is no memory as CSV: line {line}: {said}.",
        hint="Mend that line, or write the file anew with "
        f"`{shell_command('memory export --format csv')}`.",
    )
