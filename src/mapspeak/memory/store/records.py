"""Format of a memory's records: one table defines how each key is read, written and explained.

A record is data (`yamltext.Data`): text under the paper's keys, in metres and degrees. The semantic
map file, the rows of a database and GeoJSON hold the same records.
"""

import difflib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

from pydantic_core import CoreSchema, SchemaValidator, ValidationError, core_schema

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point, Pose
from mapspeak.memory.events import Effect, Event, Every
from mapspeak.memory.frames import MapFrame
from mapspeak.memory.quoting import clean_line, name_key, quote_name, tell_name
from mapspeak.memory.store import forms
from mapspeak.memory.store.forms import Form
from mapspeak.memory.store.yamltext import Data
from mapspeak.memory.waypoint import Confidence, Landmark, Waypoint

FILE_VERSION = 1
LANDMARK_KEYS = ("safety_landmarks", "functional_landmarks")

_POSE_EXAMPLE = "{x: 1.20, y: -3.40, yaw_deg: 90.0}"
_EVENT_EXAMPLE = (
    "- {text: the floor is wet, place: C1, effect: closed, until: 2026-11-22T14:00:00+01:00}"
)
_FRAME_EXAMPLE = "- {id: F2, map: house, pose: {x: 1.20, y: -3.40, yaw_deg: 90.0}}"
_EXAMPLES: Mapping[object, str] = {
    "version": "version: 1",
    "map": "map: warehouse",
    "waypoints": "waypoints: []",
    "events": _EVENT_EXAMPLE,
    "frames": _FRAME_EXAMPLE,
    "snapshot": "snapshot: map.yaml",
    "name": "name: dock corner",
    "description": "description: A corner beside the loading dock.",
    "pose": f"pose: {_POSE_EXAMPLE}",
    "safety_landmarks": "safety_landmarks: [exit sign, {label: fire hose, range_m: 3.5}]",
    "functional_landmarks": "functional_landmarks: [{label: tap, purpose: water, bearing_deg: 20}]",
    "geometric_features": "geometric_features: [corner of two walls]",
    "stamp_s": "stamp_s: 12.5",
    "recorded_at": "recorded_at: 2026-11-02T10:30:00+00:00",
    "room_id": "room_id: R3",
    "picture": "picture: P12.jpg",
    "frame": "frame: F2",
    "missed": "missed: 2",
    "gone": "gone: true",
    "confidence": "confidence: likely",
    "seen_from": f"seen_from: {_POSE_EXAMPLE}",
    "laser": "laser: from -4.0 to 4.0 deg at 2.2 2.1 - >20 3.4 m",
}


class WrongRecordError(SemanticMapError):
    """A record lacks a required value, or has a wrong one.

    Attributes:
        path: The keys and numbers of items that lead to the first fault.
    """

    def __init__(self, error: ValidationError, example: str) -> None:
        # An unknown key is more often the misspelling of a missing one than a superfluous one.
        faults = error.errors(include_url=False)
        first, *others = sorted(faults, key=lambda each: each["type"] != "extra_forbidden")
        self.path = first["loc"]
        told = ".".join(tell_name(str(step)) for step in self.path) or "The record"
        value = first["input"]
        shown = f", {quote_name(value)}," if isinstance(value, str) else ""
        expected = forms.EXPECTED[first["type"].partition("_")[0]].format(**first.get("ctx", {}))
        n_more = "1 more fault follows" if len(others) == 1 else f"{len(others)} more faults follow"
        more = f" {n_more} in this record." if others else ""
        known = (_EXAMPLES[step] for step in reversed(self.path) if step in _EXAMPLES)
        example = example or next(known, _EXAMPLES["name"])
        super().__init__(f"{told}{shown} {expected}.{more}", hint=f"Write it like `{example}`.")


@dataclass(frozen=True, slots=True)
class Key:
    """One key of a record, and the field that it becomes; of the same name where none is given."""

    name: str
    form: Form
    field_name: str = ""
    is_required: bool = False

    @property
    def field(self) -> str:
        """The field of the value."""
        return self.field_name or self.name


@dataclass(frozen=True)
class RecordKind:
    """One kind of record, or of a mapping within one.

    Attributes:
        keys: In the order in which they are written.
        is_strict: Other keys are faults; else they are people's own notes.
        example: Of the whole; empty where each key has one.
    """

    make: Callable[..., Any]
    keys: tuple[Key, ...]
    is_strict: bool = False
    example: str = ""

    @cached_property
    def by_name(self) -> dict[str, Key]:
        """Each key under its name."""
        return {key.name: key for key in self.keys}

    @cached_property
    def form(self) -> Form:
        """The form of a mapping of this kind within a record; it says nothing that is empty."""
        schema = core_schema.no_info_after_validator_function(self._made, self._schema)
        return Form(schema, lambda value: None if value is None else _said(self.write(value)))

    def read(self, data: Data, **more: object) -> Any:  # noqa: ANN401 - what it makes
        """Return the value that a record describes.

        Raises:
            WrongRecordError: It does not say what it must.
            SemanticMapError: The value refuses what it says.
        """
        try:
            fields = self._validator.validate_python(data)
        except ValidationError as error:
            raise WrongRecordError(error, self.example) from None
        return self._made(fields, **more)

    def write(self, value: object) -> dict[str, Data]:
        """Return the record of a value; None under keys without content."""
        return {key.name: key.form.write(getattr(value, key.field)) for key in self.keys}

    def _made(self, fields: dict[str, object], **more: object) -> object:
        return self.make(**more, **{self.by_name[key].field: said for key, said in fields.items()})

    @cached_property
    def _validator(self) -> SchemaValidator:
        return SchemaValidator(self._schema)

    @cached_property
    def _schema(self) -> CoreSchema:
        fields = {
            key.name: core_schema.typed_dict_field(key.form.schema, required=key.is_required)
            for key in self.keys
        }
        schema = core_schema.typed_dict_schema(
            fields, extra_behavior="forbid" if self.is_strict else "ignore"
        )
        return core_schema.no_info_before_validator_function(self._without_empty, schema)

    def _without_empty(self, data: Data) -> Data:
        """Return a mapping without the optional keys under which nothing stands."""
        if not isinstance(data, dict) or None not in data.values():
            return data
        unsaid = {key.name for key in self.keys if not key.is_required}
        return {name: said for name, said in data.items() if said is not None or name not in unsaid}


def _said(data: dict[str, Data]) -> dict[str, Data]:
    return {name: value for name, value in data.items() if value}


# --- the tables ------------------------------------------------------------------------------

_X, _Y = (Key(axis, forms.NUMBER, is_required=True) for axis in ("x", "y"))
# Strict: an overlooked `yaw` would turn the robot the wrong way.
_POSE, _FINE_POSE = (
    RecordKind(Pose, (_X, _Y, Key("yaw_deg", heading, "yaw_rad", is_required=True)), is_strict=True)
    for heading in (forms.HEADING, forms.FINE_HEADING)
)
_POINT = RecordKind(Point, (_X, _Y), is_strict=True)
_STAMP = Key("stamp_s", forms.NUMBER)
_RECORDED_AT = Key("recorded_at", forms.TIME)
_PICTURE, _NOTE, _FRAME = (Key(name, forms.TEXT) for name in ("picture", "note", "frame"))
_GONE = Key("gone", forms.FLAG, "is_gone")

_LANDMARK = RecordKind(
    Landmark,
    (
        Key("label", forms.WORDS, is_required=True),
        Key("bearing_deg", forms.BEARING, "bearing_rad"),
        Key("range_m", forms.DISTANCE),
        Key("range_from", forms.TEXT),
        Key("bearing_from", forms.TEXT),
        Key("purpose", forms.TEXT),
        Key("confidence", forms.one_of(Confidence)),
        _NOTE,
        _PICTURE,
        _STAMP,
        _RECORDED_AT,
        Key("seen_from", _POSE.form, "pose"),
        Key("laser", forms.LASER),
        Key("missed", forms.COUNT, "n_missed"),
        _GONE,
    ),
)


def _say_landmark(landmark: Landmark) -> Data:
    said = {key: value for key, value in _LANDMARK.write(landmark).items() if value is not None}
    return landmark.label if len(said) == 1 else cast("Data", said)


# A bare label counts as a landmark.
_LANDMARK_SCHEMA = core_schema.no_info_before_validator_function(
    lambda data: {"label": data} if isinstance(data, str) else data, _LANDMARK.form.schema
)
PLACE = RecordKind(
    Waypoint,
    (
        Key("name", forms.WORDS, is_required=True),
        Key("description", forms.TEXT),
        Key("pose", _POSE.form, is_required=True),
        *(
            Key(name, forms.list_of(Form(_LANDMARK_SCHEMA, _say_landmark)))
            for name in LANDMARK_KEYS
        ),
        Key("geometric_features", forms.list_of(forms.WORDS)),
        _STAMP,
        _RECORDED_AT,
        Key("room_id", forms.TEXT),
        _PICTURE,
        _FRAME,
        _GONE,
    ),
)
# Strict: with an overlooked `untill` it would never end.
EVENT = RecordKind(
    Event,
    (
        Key("id", forms.ID),
        Key("text", forms.WORDS, is_required=True),
        Key("place", forms.TEXT),
        Key("effect", forms.one_of(Effect)),
        Key("at", _POINT.form),
        Key("outline", forms.OUTLINES, "outlines"),
        Key("from", forms.TIME, "begins"),
        Key("until", forms.TIME),
        Key("every", forms.one_of(Every, unsaid=Every.ONCE)),
        Key("source", forms.TEXT),
        _RECORDED_AT,
        _FRAME,
    ),
    is_strict=True,
    example=_EVENT_EXAMPLE,
)
# Strict: with an overlooked `pos` it would lie nowhere.
FRAME = RecordKind(
    MapFrame,
    (
        Key("id", forms.NEEDED_ID, is_required=True),
        Key("map", forms.TEXT, "map_id"),
        Key("robot", forms.TEXT),
        Key("walls", forms.TEXT),
        Key("pose", _FINE_POSE.form),
        Key("in", forms.TEXT, "reference"),
    ),
    is_strict=True,
    example=_FRAME_EXAMPLE,
)


Record = Waypoint | Event | MapFrame
LISTS: Mapping[str, RecordKind] = {"waypoints": PLACE, "events": EVENT, "frames": FRAME}
"""The kinds of records, by the key of the file that lists them."""


def _read_version(value: Data) -> object:
    if value != str(FILE_VERSION):
        raise ValueError("is not a version that this mapspeak reads")
    return value


_ANY = Form(core_schema.any_schema(), lambda value: value)
_VERSION = Form(core_schema.no_info_plain_validator_function(_read_version), _ANY.write)
_LIST_SCHEMA = forms.list_of(_ANY).schema
_RECORDS = Form(
    core_schema.no_info_before_validator_function(lambda said: said or [], _LIST_SCHEMA), _ANY.write
)
FILE = RecordKind(
    dict,
    (
        Key("version", _VERSION),
        Key("map", forms.TEXT),
        *(Key(name, _RECORDS) for name in LISTS),
        Key("snapshot", _ANY),
    ),
)
"""Keys beside the records; unknown keys are people's own notes."""


# --- reading and writing ---------------------------------------------------------------------


def list_key_of(record: Record) -> str:
    """Return the key of the file under which a record is listed."""
    return next(key for key, kind in LISTS.items() if isinstance(record, cast("type", kind.make)))


def key_of(record: Record) -> str:
    """Return the key that identifies a record among those of its kind."""
    return name_key(record.name) if isinstance(record, Waypoint) else record.id


def read_record(list_key: str, data: Data, map_id: str | None) -> Record:
    """Return the value that a record describes.

    Args:
        map_id: The map that a place of this memory is on.

    Raises:
        SemanticMapError: The record does not say what it must.
    """
    more = {"map_id": map_id} if list_key == "waypoints" else {}
    return cast("Record", LISTS[list_key].read(data, **more))


def data_of(record: Record) -> dict[str, Data]:
    """Return the record of a value, rounded to millimetres and hundredths of a degree.

    The record of a place has all its keys.
    """
    data = LISTS[list_key_of(record)].write(record)
    if not isinstance(record, Waypoint):
        return _said(data)
    for key in LANDMARK_KEYS:
        data[key] = [_without_pose(each, data["pose"]) for each in cast("list[Data]", data[key])]
    return data


def _without_pose(landmark: Data, pose: Data) -> Data:
    """Return the record of a landmark, without a pose equal to the place's own."""
    if not isinstance(landmark, dict) or landmark.get("seen_from") != pose:
        return landmark
    said = {key: value for key, value in landmark.items() if key != "seen_from"}
    return said if len(said) > 1 else landmark["label"]


def read_map_id(data: dict[str, Data]) -> str | None:
    """Return the map that a file says it belongs to, if any.

    Raises:
        SemanticMapError: The file's own keys do not say what they must.
    """
    return clean_line(FILE.read(data).get("map") or "") or None


def find_misspelt_keys(data: Data, kind: RecordKind = PLACE) -> Iterator[tuple[str, str]]:
    """Return unknown keys that look like known ones, each with the known one."""
    if not isinstance(data, dict):
        return
    for key in data if not data.keys() <= kind.by_name.keys() else ():
        if key not in kind.by_name:
            for known in difflib.get_close_matches(key, sorted(kind.by_name), n=1, cutoff=0.7):
                yield key, known
    for name in LANDMARK_KEYS if kind is PLACE else ():
        landmarks = data.get(name)
        for landmark in landmarks if isinstance(landmarks, list) else ():
            yield from find_misspelt_keys(landmark, _LANDMARK)
