"""One thing that was observed: when, from where, in which picture and in which words."""

import hashlib
import math
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from enum import StrEnum

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose
from mapspeak.semantic.waypoint import clean_line, clean_text

__all__ = ["Observation", "ObservationKind", "microseconds_of"]

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_ID_BYTES = 6


class ObservationKind(StrEnum):
    """What an observation came from."""

    PICTURE = "picture"
    RECORD = "record"
    NOTE = "note"


@dataclass(frozen=True, slots=True, kw_only=True)
class Observation:
    """What was observed at one moment from one place.

    Attributes:
        recorded_at: When, by the calendar, with its time zone.
        pose: Where the robot stood, in the map frame.
        kind: A picture, a record of a place, or words alone.
        text: What was seen, in words; may be empty for a picture.
        labels: The things seen, each in a few words.
        picture: Name of the picture in the memory's folder; None without one, or after it was
            thinned.
        stamp_s: Robot time of the observation.
        map_id: Which map the pose belongs to.
        room_id: The room or corridor it was observed from, by the id that it had then.
        id: The same for the same content, so that writing twice is writing once; made from the
            content unless given.

    Raises:
        SemanticMapError: The time has no zone, or a number is not finite.
    """

    recorded_at: datetime
    pose: Pose
    kind: ObservationKind
    text: str = ""
    labels: tuple[str, ...] = ()
    picture: str | None = None
    stamp_s: float | None = None
    map_id: str | None = None
    room_id: str | None = None
    id: str = ""

    def __post_init__(self) -> None:
        is_timed = self.recorded_at.tzinfo is not None
        _require(is_timed, "The time of an observation", "a time with its zone")
        _require(self.pose.is_finite(), "The pose of an observation", "three finite numbers")
        is_stamped = self.stamp_s is None or math.isfinite(self.stamp_s)
        _require(is_stamped, "The stamp of an observation", "a finite number of seconds")
        labels = dict.fromkeys(filter(None, map(clean_line, self.labels)))
        object.__setattr__(self, "text", clean_text(self.text))
        object.__setattr__(self, "labels", tuple(labels))
        for name in ("picture", "map_id", "room_id"):
            object.__setattr__(self, name, clean_line(getattr(self, name) or "") or None)
        object.__setattr__(self, "id", self.id or self._derived_id())

    @property
    def searched_text(self) -> str:
        """The words and the labels, as they are searched."""
        return "\n".join(filter(None, (self.text, "; ".join(self.labels))))

    def _derived_id(self) -> str:
        said = (
            microseconds_of(self.recorded_at),
            (self.pose.x, self.pose.y, self.pose.yaw_rad),
            str(self.kind),
            self.text,
            self.labels,
            self.picture,
            self.stamp_s,
            self.map_id,
            self.room_id,
        )
        return "o" + hashlib.blake2b(repr(said).encode(), digest_size=_ID_BYTES).hexdigest()


def microseconds_of(time: datetime) -> int:
    """Gives the microseconds since 1970, exactly."""
    return (time - _EPOCH) // timedelta(microseconds=1)


def _require(is_right: object, what: str, expected: str) -> None:
    if not is_right:
        message = f"{what} is not {expected}."
        raise SemanticMapError(message, hint=f"Give {expected} and write it again.")
