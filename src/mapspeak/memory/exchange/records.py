"""Records as other formats hold them: plain values under the names of the semantic map file.

What the file's own schema says is what is exchanged, so that a key that is new there is in every
format at once. Lengths are in metres to the millimetre, angles in degrees to the hundredth.
"""

from collections.abc import Iterable, Mapping

from pydantic import ValidationError

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point
from mapspeak.installation import shell_command
from mapspeak.memory.mapfile.schema import record_data, waypoint_from
from mapspeak.memory.waypoint import SemanticMap, Waypoint, name_key

FILE_VERSION = 1

Facts = dict[str, object]

_PLACE_DECIMALS = 3
_NUMBERS = ("_m", "_s", "_deg")
_COORDINATES = ("x", "y")


def facts_of(waypoint: Waypoint) -> Facts:
    """Return what is said of a waypoint besides x and y; what is not said is left out."""
    said: Facts = dict(record_data(waypoint))
    pose = said.pop("pose")
    assert isinstance(pose, dict)  # noqa: S101 - a record has a pose
    facts = {"name": said.pop("name"), "yaw_deg": pose["yaw_deg"]} | said
    return {key: _plain(key, value) for key, value in facts.items() if value not in (None, "", [])}


def place_of(waypoint: Waypoint) -> Point:
    """Return where a waypoint is, in the map frame, as files say it: to the millimetre."""
    pose = waypoint.pose
    return Point(round(pose.x, _PLACE_DECIMALS) + 0.0, round(pose.y, _PLACE_DECIMALS) + 0.0)


def map_from(
    records: Iterable[tuple[Point, Mapping[str, object]]], *, map_id: str | None, form: str
) -> SemanticMap:
    """Return the places that a file describes.

    Args:
        records: Where each is in the map frame, and its facts.
        map_id: Which map they belong to.
        form: How messages call the format.

    Raises:
        SemanticMapError: A record does not say what it must, or two have one name.
    """
    places: dict[str, Waypoint] = {}
    for number, (place, facts) in enumerate(records, start=1):
        said = {key: value for key, value in facts.items() if key != "yaw_deg"}
        pose = {"x": place.x, "y": place.y, "yaw_deg": facts.get("yaw_deg")}
        try:
            waypoint = waypoint_from({**said, "pose": pose}, map_id=map_id)  # type: ignore[dict-item]
        except ValidationError as error:
            raise refusal_of(error, form, f"record {number} ({facts.get('name')!s})") from error
        if places.setdefault(name_key(waypoint.name), waypoint) is not waypoint:
            raise SemanticMapError(
                f"This is no memory as {form}: two records are called '{waypoint.name}'.",
                hint="Rename one of them; case and spaces make no difference.",
            )
    return SemanticMap(map_id=map_id, waypoints=tuple(places.values()))


def refusal_of(error: ValidationError, form: str, what: str) -> SemanticMapError:
    """Return the first fault that was found, with its place."""
    first = error.errors()[0]
    place = ".".join(map(str, first["loc"])) or "the whole of it"
    return SemanticMapError(
        f"This is no memory as {form}: {what}: at {place!a}: {first['msg']}.",
        hint=f"Mend that place, or write the file anew with `{shell_command('memory export')}`.",
    )


def _plain(key: str, value: object) -> object:
    """Return numbers as numbers; the file's schema has them as the text that is to be written."""
    if isinstance(value, list):
        return [_plain("", item) for item in value]
    if isinstance(value, dict):
        return {name: _plain(name, item) for name, item in value.items()}
    is_number = key.endswith(_NUMBERS) or key in _COORDINATES
    return float(value) if isinstance(value, str) and is_number else value
