"""A remembered place, what is seen from it, and all places of one map (paper eq. 8 and 9)."""

from dataclasses import dataclass, replace
from datetime import datetime
from enum import StrEnum

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.memory.frames import NO_FRAMES, FrameId, Frames
from mapspeak.memory.laserfan import LaserFan
from mapspeak.memory.quoting import clean_line, clean_text, name_key


class Confidence(StrEnum):
    """Certainty of an observer, in its own word."""

    CERTAIN = "certain"
    LIKELY = "likely"
    UNSURE = "unsure"


@dataclass(frozen=True, slots=True, kw_only=True)
class Landmark:
    """A thing seen from a waypoint. Only the label is always known.

    Pose, time and picture default to those of its waypoint (`Waypoint.pose_of`, `Waypoint.dated`);
    its map and the room it was seen from are always the waypoint's.

    Attributes:
        bearing_rad: Its direction from the heading of the pose it was seen from, left positive.
        range_m: Its distance from that pose.
        range_from: The sensor that measured it; None if the observer estimated it.
        bearing_from: What its direction was measured in, such as a picture; None where the observer
            judged it.
        picture: The picture it was seen in, by its relative name, if not the waypoint's.
        stamp_s: Robot time it was last seen at, if not the waypoint's.
        recorded_at: The same as calendar time with time zone, if not the waypoint's.
        pose: The pose it was seen from, in the map frame, if not the waypoint's.
        laser: Laser ranges around that direction, from that pose.
        n_missed: Number of later looks from that place that should have shown it.
        is_gone: It is no longer there, or was forgotten; kept so that this can be undone.

    Raises:
        SemanticMapError: The label is empty.
    """

    label: str
    purpose: str | None = None
    bearing_rad: float | None = None
    range_m: float | None = None
    confidence: Confidence | None = None
    note: str | None = None
    picture: str | None = None
    stamp_s: float | None = None
    recorded_at: datetime | None = None
    pose: Pose | None = None
    range_from: str | None = None
    bearing_from: str | None = None
    laser: LaserFan | None = None
    n_missed: int = 0
    is_gone: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "label", _required_line(self.label, "A landmark's label"))
        _clean_lines(self, "purpose", "note", "picture", "range_from", "bearing_from")
        if self.bearing_rad is not None:
            object.__setattr__(self, "bearing_rad", wrap_angle(self.bearing_rad))

    def recorded_point_from(self, pose: Pose) -> Point | None:
        """Return where it was by its range, else by what the laser met in its direction."""
        if self.bearing_rad is None:
            return None
        range_m = self.range_m
        if range_m is None and self.laser is not None:
            range_m = self.laser.find_range_m(self.bearing_rad)
        return None if range_m is None else pose.point_at(self.bearing_rad, range_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class Waypoint:
    """A remembered place (paper eq. 8).

    Attributes:
        name: How people call it; unique in its map, whatever its case (`name_key`).
        pose: From where it was observed, in the map frame.
        geometric_features: Persistent layout, such as "corner of two walls".
        stamp_s: Robot time of the observation.
        map_id: Which map the pose belongs to; None where the store decides.
        room_id: The room or corridor it was observed from, by the id that it had then.
        frame: The frame of that map that its poses are in; None for the memory's own.
        is_gone: It is to be forgotten; kept so that this can be undone.

    Raises:
        SemanticMapError: The name is empty.
    """

    name: str
    pose: Pose
    description: str = ""
    safety_landmarks: tuple[Landmark, ...] = ()
    functional_landmarks: tuple[Landmark, ...] = ()
    geometric_features: tuple[str, ...] = ()
    stamp_s: float | None = None
    recorded_at: datetime | None = None
    map_id: str | None = None
    room_id: str | None = None
    picture: str | None = None
    frame: FrameId = None
    is_gone: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", _required_line(self.name, "A waypoint's name"))
        object.__setattr__(self, "description", clean_text(self.description))
        features = (clean_line(feature) for feature in self.geometric_features)
        object.__setattr__(self, "geometric_features", tuple(filter(None, features)))
        _clean_lines(self, "room_id", "picture", "frame")

    @property
    def landmarks(self) -> tuple[Landmark, ...]:
        """The safety landmarks, then the functional ones."""
        return self.safety_landmarks + self.functional_landmarks

    def present(self) -> "Waypoint":
        """Return it without what is gone: of a forgotten place only where it was is left."""
        if self.is_gone:
            return replace(
                self, safety_landmarks=(), functional_landmarks=(), geometric_features=()
            )
        if not any(each.is_gone for each in self.landmarks):
            return self
        return replace(
            self,
            safety_landmarks=tuple(each for each in self.safety_landmarks if not each.is_gone),
            functional_landmarks=tuple(
                each for each in self.functional_landmarks if not each.is_gone
            ),
        )

    @property
    def standpoints(self) -> tuple["Waypoint", ...]:
        """The place once for each pose it was observed from, with what was seen from there.

        Its own pose comes first, also where nothing was seen from it.
        """
        poses = dict.fromkeys((self.pose, *map(self.pose_of, self.landmarks)))
        if len(poses) == 1:
            return (self,)
        return tuple(
            replace(
                self,
                pose=pose,
                safety_landmarks=self._seen_from(pose, self.safety_landmarks),
                functional_landmarks=self._seen_from(pose, self.functional_landmarks),
            )
            for pose in poses
        )

    def pose_of(self, landmark: Landmark) -> Pose:
        """Return the pose that one of its landmarks was seen from, in the map frame."""
        return landmark.pose or self.pose

    def moved(self, motion: Pose, into: FrameId = None) -> "Waypoint":
        """Return it with all poses moved to another frame, where ids of rooms mean nothing."""
        return replace(
            self,
            frame=into,
            pose=motion @ self.pose,
            room_id=None,
            safety_landmarks=tuple(_moved(each, motion) for each in self.safety_landmarks),
            functional_landmarks=tuple(_moved(each, motion) for each in self.functional_landmarks),
        )

    def _seen_from(self, pose: Pose, landmarks: tuple[Landmark, ...]) -> tuple[Landmark, ...]:
        return tuple(each for each in landmarks if self.pose_of(each) == pose)

    def dated(self, landmark: Landmark) -> Landmark:
        """Return one of its landmarks with its effective time and picture.

        A landmark with a time of its own was last seen in an earlier picture, if in any.
        """
        if landmark.stamp_s is not None or landmark.recorded_at is not None:
            return landmark
        return replace(
            landmark,
            stamp_s=self.stamp_s,
            recorded_at=self.recorded_at,
            picture=landmark.picture or self.picture,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class SemanticMap:
    """All remembered places of one map (paper eq. 9).

    Attributes:
        frames: Those that records name.
        elsewhere: Places of frames of unknown alignment with the robot's map.
        n_events_elsewhere: Number of events left out for the same reason.
        warnings: For the reader: places of another map, a file broken since, a key that looks
            misspelt.
    """

    map_id: str | None = None
    waypoints: tuple[Waypoint, ...] = ()
    frames: Frames = NO_FRAMES
    elsewhere: tuple[Waypoint, ...] = ()
    n_events_elsewhere: int = 0
    warnings: tuple[str, ...] = ()

    def present(self) -> "SemanticMap":
        """Return it without what is gone or forgotten."""
        waypoints = tuple(each.present() for each in self.waypoints if not each.is_gone)
        return replace(self, waypoints=waypoints)

    def find_waypoint(self, name: str) -> Waypoint | None:
        """Return the place of that name, whatever its case, or None."""
        key = name_key(name)
        return next((place for place in self.waypoints if name_key(place.name) == key), None)


def _moved(landmark: Landmark, motion: Pose) -> Landmark:
    return landmark if landmark.pose is None else replace(landmark, pose=motion @ landmark.pose)


def _clean_lines(value: Landmark | Waypoint, *names: str) -> None:
    """Put texts that may be absent on one line, and None where nothing is left of them."""
    for name in names:
        text = getattr(value, name)
        if text is not None:
            object.__setattr__(value, name, clean_line(text) or None)


def _required_line(text: str, what: str) -> str:
    line = clean_line(text)
    if not line:
        message = f"{what} is not at least one visible character."
        hint = "Give at least one visible character and write it again."
        raise SemanticMapError(message, hint=hint)
    return line
