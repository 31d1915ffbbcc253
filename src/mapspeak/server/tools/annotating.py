"""The arguments of `write_semantic_data`, sorted into accepted and refused things."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, RootModel

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Point, Pose, wrap_angle
from mapspeak.memory import (
    LEFT_OUT,
    SAME_SPOT_M,
    SAME_VIEW_RAD,
    Concern,
    Confidence,
    Landmark,
    LaserFan,
    LaserRing,
    PictureBook,
    TakenPicture,
    Waypoint,
    find_concern,
    find_passing,
    is_purpose,
    noted_at,
    tells_what_to_do,
)
from mapspeak.memory.things.labels import name_the_same
from mapspeak.places.naming import is_taken_name
from mapspeak.server.text.offered import lead
from mapspeak.server.tools.sightings import find_reading

SAME_RANGE_M = 0.1
"""A told range this close to a measured one was read off it."""

FARTHEST_SEEN_M = 100.0
"""A robot's camera does not identify things from farther away."""

FULL_TURN_DEG = 360.0
READ_OFF = "picture"
"""What a direction was measured in that is told as a column."""

Label = Annotated[str, Field(min_length=1, max_length=120)]


class LandmarkInput(BaseModel):
    """A landmark with what is known of it."""

    model_config = ConfigDict(extra="forbid")

    label: str = Field(min_length=1, max_length=120)
    purpose: str | None = Field(default=None, max_length=200)
    bearing_deg: float | None = Field(
        default=None, description="from the heading, left positive", allow_inf_nan=False
    )
    image_column_px: float | None = Field(
        default=None, description="or its middle in the picture", ge=0, allow_inf_nan=False
    )
    range_m: float | None = Field(default=None, ge=0, allow_inf_nan=False)
    confidence: Confidence | None = None
    note: str | None = Field(default=None, max_length=300)
    picture: str | None = Field(default=None, description="e.g. P3; else from here", max_length=80)


class Landmarks(RootModel[list[Label | LandmarkInput]]):
    """Landmarks as labels, or with more."""

    root: list[Label | LandmarkInput] = Field(max_length=50)


Name = Annotated[
    str,
    Field(description="as people say", min_length=1, max_length=120),
]
Feature = Annotated[str, Field(max_length=300)]
Description = Annotated[str, Field(description="in two sentences", max_length=2000)]
Safety = Annotated[Landmarks | None, Field(description="fixed safety equipment")]
Functional = Annotated[Landmarks | None, Field(description="fixed things tasks need")]
Features = Annotated[
    list[Feature] | None,
    Field(max_length=50, description="layout: walls, openings"),
]
SeenIn = Annotated[
    str | None, Field(description="that shows it, e.g. P3; else from here", max_length=80)
]


class PlaceInput(BaseModel):
    """A place as it is described, from a picture or from where the robot stands."""

    model_config = ConfigDict(extra="forbid")

    name: Name
    description: Description
    picture: SeenIn = None
    safety_landmarks: Safety = None
    functional_landmarks: Functional = None
    geometric_features: Features = None

    @property
    def shows_things(self) -> bool:
        """True where more than words is told of it: by a picture, by things or by its layout."""
        things = self.safety_landmarks or self.functional_landmarks
        return bool(self.picture or things or self.geometric_features)


@dataclass(slots=True, kw_only=True)
class Annotator:
    """Turns the description of a place into landmarks as seen from one pose.

    Attributes:
        pictures: The pictures that can be spoken of.
        described: The one that the place is described from.
        laser: The present ranges of the robot's laser; None where not asked for, or without one.
        earlier: Pictures that landmarks name and that the book holds no more, by what they name.
        refused: What stays out, each with its reason; filled as landmarks are taken.
        remarks: What is remembered without a direction, each with its reason; filled likewise.
    """

    pictures: PictureBook
    described: TakenPicture | None = None
    laser: LaserRing | None = None
    earlier: Mapping[str, TakenPicture] = field(default_factory=dict)
    refused: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)

    def find_origin(
        self, safety: Landmarks | None, functional: Landmarks | None
    ) -> TakenPicture | None:
        """Return the picture that is described, else that of most safety things, of most, the last.

        None where one thing was seen from here.
        """
        if self.described is not None:
            return self.described
        seen = [(thing, self._find_picture(thing)) for thing in _things((safety, functional))]
        if any(thing.bearing_deg is not None and picture is None for thing, picture in seen):
            return None
        n_safety = Counter(filter(None, map(self._find_picture, _things([safety]))))
        n_all = Counter(picture for _, picture in seen if picture is not None)
        return max(
            n_all, key=lambda each: (n_safety[each], n_all[each], each.stamp_s), default=None
        )

    def find_picture_from(self, pose: Pose) -> TakenPicture | None:
        """Return the picture that shows what is seen from a pose: the described or last one."""
        latest = self.described or self.pictures.latest
        if latest is None:
            return None
        is_same = latest.pose.is_near(pose, off_m=SAME_SPOT_M, turn_rad=SAME_VIEW_RAD)
        return latest if is_same else None

    def wants_laser(
        self, *given: Landmarks | None, pose: Pose, picture: TakenPicture | None
    ) -> bool:
        """Return True when no picture from the direction's pose has a laser's ranges."""
        return any(
            thing.bearing_deg is not None
            and self._find_picture(thing) is None
            and _find_fan(pose, math.radians(thing.bearing_deg), picture) is None
            for thing in _things(given)
        )

    def take(
        self, given: Landmarks | None, *, pose: Pose, picture: TakenPicture | None
    ) -> tuple[Landmark, ...]:
        """Return the landmarks that may be remembered, as seen from a pose.

        Args:
            given: What was said.
            pose: Where the waypoint is observed from.
            picture: The waypoint's; landmarks do not repeat it.
        """
        taken: list[Landmark] = []
        for thing in _things([given]):
            if self._is_against_policy(thing.label):
                continue
            try:
                taken.append(self._landmark(thing, pose=pose, picture=picture))
            except SemanticMapError as error:
                self.refused.append(f"{thing.label!r}: {error}")
        return tuple(taken)

    def take_features(self, given: Iterable[str]) -> tuple[str, ...]:
        """Return the layout features that may be remembered."""
        return tuple(feature for feature in given if not self._is_against_policy(feature))

    def take_description(self, text: str) -> str:
        """Return the description; none where it gives orders."""
        if not tells_what_to_do(text):
            return text
        self.refused.append(f"the description: {LEFT_OUT[Concern.ORDERS]}")
        return ""

    def require_content(self, waypoint: Waypoint) -> None:
        """Refuse a place of which nothing is left.

        Raises:
            SemanticMapError: All that was said of it is refused.
        """
        said = waypoint.description
        passing = find_passing(said)
        says = waypoint.landmarks or waypoint.geometric_features
        if not says and passing is not None:
            self.refused.append(f"{said!r}: {LEFT_OUT[passing]}")
        if not says and self.refused and (passing is not None or not said):
            raise SemanticMapError(
                f"Nothing of {waypoint.name!r} can be remembered, so nothing was written. "
                f"{' '.join(self.refused)}",
                hint="Give a description, or a landmark that lasts.",
            )

    def _is_against_policy(self, text: str) -> bool:
        concern = find_concern(text)
        if concern is not None:
            self.refused.append(f"{text!r}: {LEFT_OUT[concern]}")
        return concern is not None

    def _landmark(
        self, thing: LandmarkInput, *, pose: Pose, picture: TakenPicture | None
    ) -> Landmark:
        own = self._find_picture(thing)
        if thing.picture is not None and own is None:
            raise self._no_such_picture(thing.picture)
        _require_possible(thing, own)
        # The waypoint's picture also holds for the landmark.
        other = None if own == picture else own
        bearing_rad = _bearing_rad(thing, own)
        bearing_from = None if thing.image_column_px is None else READ_OFF
        stood = pose if own is None else own.pose
        range_m, range_from = thing.range_m, None
        shown = own or picture
        if bearing_rad is None and shown is not None:
            self._remark_several(thing.label, shown)
        measured = _find_measured(thing, bearing_rad, stood, shown)
        if measured is not None:
            point, range_from = measured
            range_m = stood.point.distance_to(point)
            if bearing_from is None:
                bearing_rad = wrap_angle(stood.point.bearing_to(point) - stood.yaw_rad)
                bearing_from = range_from
        landmark = Landmark(
            label=thing.label,
            purpose=self._told(thing, "purpose", is_purpose),
            bearing_rad=bearing_rad,
            range_m=range_m,
            range_from=range_from,
            bearing_from=bearing_from,
            confidence=thing.confidence,
            note=self._told(thing, "note", lambda said: not tells_what_to_do(said)),
            picture=None if other is None else other.name,
            stamp_s=None if other is None else other.stamp_s,
            recorded_at=None if other is None else other.recorded_at,
            laser=self._laser_around(stood, bearing_rad, shown),
        )
        return landmark if own is None else noted_at(landmark, own.pose, pose)

    def _remark_several(self, label: str, shown: TakenPicture) -> None:
        """Remark that a picture does not tell which of several things of a name is meant."""
        n_called = sum(name_the_same(each.label, label) for each in shown.readings)
        if n_called > 1:
            self.remarks.append(
                f"{shown.id} shows {n_called} called {label!r}: give bearing_deg of the one that "
                "is meant; it is noted without a direction."
            )

    def _laser_around(
        self, stood: Pose, bearing_rad: float | None, picture: TakenPicture | None
    ) -> LaserFan | None:
        """Return what was met around a direction when it was seen, or is met now."""
        if bearing_rad is None:
            return None
        fan = _find_fan(stood, bearing_rad, picture)
        if fan is not None or self.laser is None:
            return fan
        return self.laser.find_fan(stood, bearing_rad)

    def _told(
        self, thing: LandmarkInput, name: str, is_allowed: Callable[[str], bool]
    ) -> str | None:
        text: str | None = getattr(thing, name)
        if text is None or is_allowed(text):
            return text
        self.refused.append(f"the {name} of {thing.label!r}: {LEFT_OUT[Concern.ORDERS]}")
        return None

    def _find_picture(self, thing: LandmarkInput) -> TakenPicture | None:
        if thing.picture is not None:
            return self.pictures.find(thing.picture) or self.earlier.get(thing.picture)
        return None if thing.image_column_px is None else self.described or self.pictures.latest

    def _no_such_picture(self, said: str) -> SemanticMapError:
        latest = self.pictures.latest
        known = "none was taken yet" if latest is None else f"the last one is {latest.id}"
        return SemanticMapError(
            f"There is no picture {said!r}; {known}.", hint=lead("Call {look_through_camera}.")
        )


def check_name(name: str) -> None:
    """Check that a place may be called so.

    Raises:
        SemanticMapError: It gives orders, or reads like something else.
    """
    fault = f"is no name: {LEFT_OUT[Concern.ORDERS]}" if tells_what_to_do(name) else ""
    if is_taken_name(name):
        fault = "reads like an id, coordinates or the robot itself."
    if fault:
        hint = "Give a name in words, such as 'dock corner'."
        raise SemanticMapError(f"{name[:80]!r} {fault}", hint=hint)


def list_pictures_named(*given: Landmarks | None) -> set[str]:
    """Return what landmarks call the pictures that show them."""
    return {thing.picture for thing in _things(given) if thing.picture is not None}


def _things(given: Iterable[Landmarks | None]) -> Iterator[LandmarkInput]:
    for landmarks in given:
        for thing in landmarks.root if landmarks is not None else ():
            yield LandmarkInput(label=thing) if isinstance(thing, str) else thing


def _bearing_rad(thing: LandmarkInput, picture: TakenPicture | None) -> float | None:
    if thing.image_column_px is None:
        return None if thing.bearing_deg is None else math.radians(thing.bearing_deg)
    if thing.bearing_deg is not None:
        raise SemanticMapError(
            "Both bearing_deg and image_column_px are given.", hint="Give one of them."
        )
    if picture is None:
        raise SemanticMapError(
            "No picture was taken that image_column_px could be a column of.",
            hint=lead("Give bearing_deg. {look_through_camera} takes a picture."),
        )
    return picture.bearing_of(thing.image_column_px)


def _find_fan(stood: Pose, bearing_rad: float, picture: TakenPicture | None) -> LaserFan | None:
    if picture is None or picture.laser is None:
        return None
    return picture.laser.find_fan(stood, bearing_rad)


def _find_measured(
    thing: LandmarkInput, bearing_rad: float | None, stood: Pose, picture: TakenPicture | None
) -> tuple[Point, str] | None:
    """Return where the robot measured a landmark, and by what; None where it did not.

    It is what was measured along the line to it, of something called so; without a direction, of
    the only thing in the picture that is called so.

    Args:
        thing: What was said of it.
        bearing_rad: Its direction from the pose; None where that was not said.
        stood: The pose it was seen from.
        picture: The one it was seen in.
    """
    if picture is None:
        return None
    reading = find_reading(thing.label, stood, bearing_rad, picture)
    if reading is None or reading.range_m is None:
        return None
    point = picture.pose.point_at(reading.bearing_rad, reading.range_m)
    measured_m = stood.point.distance_to(point)
    if thing.range_m is not None and abs(thing.range_m - measured_m) > SAME_RANGE_M:
        return None
    return point, reading.source


def _require_possible(thing: LandmarkInput, picture: TakenPicture | None) -> None:
    """Refuse numbers that no look can give."""
    if thing.range_m is not None and thing.range_m > FARTHEST_SEEN_M:
        raise SemanticMapError(
            f"{thing.range_m:g} m is farther than anything is seen from, {FARTHEST_SEEN_M:g} m.",
            hint="Give range_m in metres, or leave it out.",
        )
    if thing.bearing_deg is not None and abs(thing.bearing_deg) > FULL_TURN_DEG:
        raise SemanticMapError(
            f"{thing.bearing_deg:g} deg is more than a full turn.",
            hint="Give bearing_deg between -180 and 180, left positive.",
        )
    if thing.bearing_deg is None or picture is None:
        return
    if not picture.shows(math.radians(thing.bearing_deg)):
        half_deg = math.degrees(picture.horizontal_fov_rad or 0.0) / 2
        raise SemanticMapError(
            f"{thing.bearing_deg:g} deg lies outside {picture.id}, which shows {half_deg:.0f} deg "
            "to either side of the heading it was taken along.",
            hint="Give the bearing from the picture's heading, or image_column_px.",
        )
