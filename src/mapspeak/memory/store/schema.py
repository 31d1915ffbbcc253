"""What one record of the semantic map file must say; turned into a waypoint, and back."""

import difflib
import math
from collections.abc import Iterator
from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    FiniteFloat,
    ValidationError,
)
from pydantic_core import PydanticCustomError

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose, wrap_angle
from mapspeak.memory.laserfan import LaserFan
from mapspeak.memory.quoting import clean_line, quote_name, tell_name
from mapspeak.memory.store.tree import Data, ListNode, MappingNode, Node, TextError
from mapspeak.memory.waypoint import Confidence, Landmark, Waypoint

FILE_VERSION = 1

_Words = Annotated[str, Field(pattern=r"\S")]


def _nothing_as_empty(value: object) -> object:
    return [] if value is None else value


def _label_alone(value: object) -> object:
    return {"label": value} if isinstance(value, str) else value


def _time_with_zone(value: object) -> datetime | None:
    time = datetime.fromisoformat(value) if isinstance(value, str) else None
    if value is not None and (time is None or time.tzinfo is None):
        message = "is not a date and time with a time zone"
        raise ValueError(message)
    return time


Time = Annotated[datetime | None, BeforeValidator(_time_with_zone)]


def _laser_fan(value: object) -> LaserFan | None:
    if value is None:
        return None
    if not isinstance(value, str):
        raise PydanticCustomError("laser", "It is no line of text")
    try:
        return LaserFan.read(value)
    except SemanticMapError as error:
        raise PydanticCustomError("laser", "{reason}", {"reason": error.message[:-1]}) from error


_Laser = Annotated[LaserFan | None, BeforeValidator(_laser_fan)]


def _nothing_as_false(value: object) -> object:
    return False if value is None else value


def _nothing_as_zero(value: object) -> object:
    return 0 if value is None else value


_Flag = Annotated[bool, BeforeValidator(_nothing_as_false)]


def _line_or_none(text: str | None) -> str | None:
    return clean_line(text or "") or None


class PoseEntry(BaseModel):
    """A pose of a file, strictly: an overlooked `yaw` would turn the robot the wrong way."""

    model_config = ConfigDict(extra="forbid")

    x: FiniteFloat
    y: FiniteFloat
    yaw_deg: FiniteFloat

    def to_pose(self) -> Pose:
        """Return it in radians."""
        return Pose(self.x, self.y, wrap_angle(math.radians(self.yaw_deg)))


class _LandmarkEntry(BaseModel):
    """A landmark; a bare label counts as one."""

    label: _Words
    purpose: str | None = None
    bearing_deg: FiniteFloat | None = None
    range_m: Annotated[FiniteFloat, Field(ge=0)] | None = None
    range_from: str | None = None
    confidence: Confidence | None = None
    note: str | None = None
    picture: str | None = None
    stamp_s: FiniteFloat | None = None
    recorded_at: Time = None
    seen_from: PoseEntry | None = None
    laser: _Laser = None
    missed: Annotated[int, Field(ge=0), BeforeValidator(_nothing_as_zero)] = 0
    gone: _Flag = False

    def to_landmark(self) -> Landmark:
        said = dict(vars(self))
        bearing_deg, seen_from = said.pop("bearing_deg"), said.pop("seen_from")
        bearing_rad = None if bearing_deg is None else math.radians(bearing_deg)
        pose = None if seen_from is None else seen_from.to_pose()
        n_missed, is_gone = said.pop("missed"), said.pop("gone")
        return Landmark(
            **said, bearing_rad=bearing_rad, pose=pose, n_missed=n_missed, is_gone=is_gone
        )


_Landmarks = Annotated[
    list[Annotated[_LandmarkEntry, BeforeValidator(_label_alone)]],
    BeforeValidator(_nothing_as_empty),
]


class _WaypointEntry(BaseModel):
    """One item of the list `waypoints`; other keys are people's own notes."""

    name: _Words
    description: str | None = None
    pose: PoseEntry
    safety_landmarks: _Landmarks = []
    functional_landmarks: _Landmarks = []
    geometric_features: Annotated[list[_Words], BeforeValidator(_nothing_as_empty)] = []
    stamp_s: FiniteFloat | None = None
    recorded_at: Time = None
    room_id: str | None = None
    picture: str | None = None
    frame: str | None = None
    gone: _Flag = False

    def to_waypoint(self, map_id: str | None) -> Waypoint:
        # Not dict(self), which takes half as long as reading the whole record.
        said = vars(self) | {
            "description": self.description or "",
            "pose": self.pose.to_pose(),
            "safety_landmarks": tuple(entry.to_landmark() for entry in self.safety_landmarks),
            "functional_landmarks": tuple(each.to_landmark() for each in self.functional_landmarks),
            "geometric_features": tuple(self.geometric_features),
        }
        is_gone = said.pop("gone")
        return Waypoint(**said, map_id=map_id, is_gone=is_gone)


class _FileEntry(BaseModel):
    """What stands beside the records; other keys are people's own notes."""

    version: Literal["1"] | None = None
    map: Annotated[str | None, AfterValidator(_line_or_none)] = None
    waypoints: Annotated[list[Any], BeforeValidator(_nothing_as_empty)] = []


_FILE_KEYS = frozenset(_FileEntry.model_fields) | {"events", "frames", "snapshot"}
_WAYPOINT_KEYS = frozenset(_WaypointEntry.model_fields)
_LANDMARK_KEYS = frozenset(_LandmarkEntry.model_fields)

_EXAMPLES = {
    "version": "version: 1",
    "map": "map: warehouse",
    "waypoints": "waypoints: []",
    "name": "name: dock corner",
    "description": "description: A corner beside the loading dock.",
    "pose": "pose: {x: 1.20, y: -3.40, yaw_deg: 90.0}",
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
    "seen_from": "seen_from: {x: 1.20, y: -3.40, yaw_deg: 90.0}",
    "laser": "laser: from -4.0 to 4.0 deg at 2.2 2.1 - >20 3.4 m",
}
_EXPECTED = {
    "missing": "is missing",
    "extra_forbidden": "is not a key that belongs here",
    "float_parsing": "is not a number",
    "float_type": "is not a number",
    "finite_number": "is not a finite number",
    "greater_than_equal": "is below zero",
    "string_type": "is not text",
    "bool_parsing": "is not true or false",
    "int_parsing": "is not a whole number",
    "string_pattern_mismatch": "is empty",
    "enum": f"is none of {', '.join(Confidence)}",
    "literal_error": "is not a version that this mapspeak reads",
    "list_type": "is not a list",
    "model_type": "is not a mapping of keys to values",
    "value_error": "is not a date and time with a time zone",
}


def waypoint_from(data: Data, *, map_id: str | None) -> Waypoint:
    """Return the waypoint that a record describes.

    Raises:
        ValidationError: The record does not say what it must (see `fault_in`).
    """
    return _WaypointEntry.model_validate(data).to_waypoint(map_id)


def map_id_from(data: Data) -> str | None:
    """Return the map that a file says it belongs to, if any.

    Raises:
        ValidationError: The file's own keys do not say what they must (see `fault_in`).
    """
    return _FileEntry.model_validate(data).map


def record_data(waypoint: Waypoint) -> dict[str, Data]:
    """Return what a record says of a waypoint: millimetres and hundredths of a degree."""
    pose = _pose_data(waypoint.pose)
    safety, functional = waypoint.safety_landmarks, waypoint.functional_landmarks
    return {
        "name": waypoint.name,
        "description": waypoint.description,
        "pose": pose,
        "safety_landmarks": [_landmark_data(thing, pose) for thing in safety],
        "functional_landmarks": [_landmark_data(thing, pose) for thing in functional],
        "geometric_features": list(waypoint.geometric_features),
        "stamp_s": _length_if_any(waypoint.stamp_s),
        "recorded_at": time_text(waypoint.recorded_at),
        "room_id": waypoint.room_id,
        "picture": waypoint.picture,
        "frame": waypoint.frame,
        "gone": "true" if waypoint.is_gone else None,
    }


def find_misspelt_keys(data: Data) -> Iterator[tuple[str, str]]:
    """Return unknown keys that look like known ones, each with the known one."""
    if not isinstance(data, dict):
        return
    yield from _lookalikes(data, _WAYPOINT_KEYS)
    for key in ("safety_landmarks", "functional_landmarks"):
        landmarks = data.get(key)
        for landmark in landmarks if isinstance(landmarks, list) else []:
            yield from _lookalikes(landmark, _LANDMARK_KEYS)


def find_misspelt_keys_of_file(data: Data) -> Iterator[tuple[str, str]]:
    """Return unknown keys beside the records that look like known ones."""
    yield from _lookalikes(data, _FILE_KEYS)


def fault_in(node: Node, error: ValidationError) -> TextError:
    """Return the first thing that is wrong with a record, and where it stands."""
    # A key that is none is more often the misspelling of one that is missing than one too many.
    first, *others = sorted(error.errors(), key=lambda each: each["type"] != "extra_forbidden")
    place, path = _locate(node, first["loc"])
    shown = f", {quote_name(first['input'])}," if isinstance(first["input"], str) else ""
    expected = _EXPECTED.get(first["type"], f"is wrong: {first['msg']}")
    n_more = "1 more fault follows" if len(others) == 1 else f"{len(others)} more faults follow"
    more = f" {n_more} in this record." if others else ""
    example = next(
        (_EXAMPLES[k] for k in reversed(first["loc"]) if k in _EXAMPLES), _EXAMPLES["name"]
    )
    return TextError(
        f"{path}{shown} {expected}.{more}", hint=f"Write it like `{example}`.", offset=place.start
    )


def _locate(node: Node, location: tuple[int | str, ...]) -> tuple[Node, str]:
    path = "The record"
    for step in location:
        said = tell_name(str(step))
        path = said if path == "The record" else f"{path}.{said}"
        if isinstance(node, MappingNode):
            node = node.find_value(str(step)) or node
        elif isinstance(node, ListNode) and isinstance(step, int):
            node = node.items[step]
    return node, path


def _lookalikes(data: Data, known_keys: frozenset[str]) -> Iterator[tuple[str, str]]:
    if not isinstance(data, dict) or data.keys() <= known_keys:
        return
    for key in data:
        if key not in known_keys:
            for known in difflib.get_close_matches(key, sorted(known_keys), n=1, cutoff=0.7):
                yield key, known


def _pose_data(pose: Pose) -> dict[str, Data]:
    return {"x": length_text(pose.x), "y": length_text(pose.y), "yaw_deg": _angle(pose.yaw_rad)}


def _landmark_data(landmark: Landmark, pose: dict[str, Data]) -> Data:
    seen_from = None if landmark.pose is None else _pose_data(landmark.pose)
    entries: dict[str, Data] = {
        "label": landmark.label,
        "bearing_deg": None if landmark.bearing_rad is None else _angle(landmark.bearing_rad),
        "range_m": _length_if_any(landmark.range_m),
        "range_from": landmark.range_from,
        "purpose": landmark.purpose,
        "confidence": landmark.confidence and str(landmark.confidence),
        "note": landmark.note,
        "picture": landmark.picture,
        "stamp_s": _length_if_any(landmark.stamp_s),
        "recorded_at": time_text(landmark.recorded_at),
        "seen_from": None if seen_from == pose else seen_from,
        "laser": None if landmark.laser is None else landmark.laser.text,
        "missed": str(landmark.n_missed) if landmark.n_missed else None,
        "gone": "true" if landmark.is_gone else None,
    }
    said = [key for key, value in entries.items() if value is not None]
    return landmark.label if said == ["label"] else {key: entries[key] for key in said}


def time_text(time: datetime | None) -> str | None:
    """Return a time as the file says it, to the second."""
    return None if time is None else time.isoformat(timespec="seconds")


def _length_if_any(value: float | None) -> str | None:
    return None if value is None else length_text(value)


def length_text(value: float) -> str:
    """Return metres, or seconds, to the thousandth."""
    return _decimals(value, 3)


def _angle(angle_rad: float) -> str:
    degrees = round(math.degrees(wrap_angle(angle_rad)), 2)
    return _decimals(180.0 if degrees == -180.0 else degrees, 2)


def _decimals(value: float, n_decimals: int) -> str:
    """Return a number with one decimal less where that one is a zero: 1.20, 1.205, 90.0."""
    # Adding zero turns -0.0 into 0.0.
    text = f"{round(value, n_decimals) + 0.0:.{n_decimals}f}"
    return text.removesuffix("0")
