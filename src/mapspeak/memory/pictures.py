"""Recent pictures: their poses, and the direction of each of their columns."""

import hashlib
import math
from collections import OrderedDict
from dataclasses import dataclass, replace
from datetime import datetime

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose, wrap_angle
from mapspeak.memory.laserfan import LaserRing
from mapspeak.spatial.fieldofview import HALF_VIEW_RAD, CameraView, find_half_view_rad

MOST_PICTURES = 2000
"""Number of pictures that can be referred to; older ones are forgotten here, kept or not."""
BESIDE_RAD = math.radians(10.0)
"""Margin for things cut by the edge: their middle is beside the picture, and estimated."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureReading:
    """What the robot's detector reports in a picture: what, where in it, and how far if measured.

    Attributes:
        bearing_rad: From the heading of the picture, left positive.
        source: The detector.
    """

    label: str
    bearing_rad: float
    range_m: float | None
    source: str


@dataclass(frozen=True, slots=True, kw_only=True)
class TakenPicture:
    """Metadata of a picture.

    Attributes:
        id: Short id for readers: P12.
        name: Relative file name, unique among all runs: P12-5d0c21f7.jpg.
        pose: In the map frame: of the robot, with the heading in which the camera looked.
        is_ahead: Taken by the camera that a robot turns to what it is to look at.
        reported: Labels of everything the robot's detector reports in it; None without a detector.
    """

    pose: Pose
    stamp_s: float
    width_px: int
    horizontal_fov_rad: float | None
    id: str = ""
    name: str = ""
    recorded_at: datetime | None = None
    readings: tuple[PictureReading, ...] = ()
    laser: LaserRing | None = None
    reported: tuple[str, ...] | None = None
    is_ahead: bool = True

    def shows(self, bearing_rad: float) -> bool:
        """Return True if a direction, from the heading, is in the picture or just beside it."""
        if self.horizontal_fov_rad is None:
            return True
        return abs(wrap_angle(bearing_rad)) <= self.horizontal_fov_rad / 2 + BESIDE_RAD

    @property
    def view(self) -> CameraView:
        """Its pose and its known or assumed field of view."""
        fov_rad = self.horizontal_fov_rad
        half_rad = HALF_VIEW_RAD if fov_rad is None else fov_rad / 2
        return CameraView(self.pose, half_rad, self.is_ahead)

    def bearing_of(self, column_px: float) -> float:
        """Return the direction of a column from the heading, left positive, in radians.

        The lens is a pinhole, as the simulated camera's and that of a ROS CameraInfo: columns are
        evenly spaced on a plane, not on a circle.

        Args:
            column_px: From the left edge; the middle of the picture is half its width.

        Raises:
            SemanticMapError: The picture has no such column, or its field of view is unknown.
        """
        if not 0 <= column_px <= self.width_px:
            raise SemanticMapError(
                f"Column {column_px:g} lies outside {self.id}, which is {self.width_px} px wide.",
                hint="Count from the left edge of the picture at its full size.",
            )
        if self.horizontal_fov_rad is None:
            raise SemanticMapError(
                "The robot does not say how wide its camera looks.",
                hint="Give bearing_deg instead.",
            )
        half_px = self.width_px / 2
        focal_px = half_px / math.tan(self.horizontal_fov_rad / 2)
        return math.atan2(half_px - column_px, focal_px)


class PictureBook:
    """Numbers the pictures of one run."""

    def __init__(self) -> None:
        self._taken: OrderedDict[str, TakenPicture] = OrderedDict()
        self._n_taken = 0
        self._views: list[CameraView] = []

    @property
    def latest(self) -> TakenPicture | None:
        """The picture that was taken last."""
        return next(reversed(self._taken.values()), None)

    @property
    def taken(self) -> tuple[TakenPicture, ...]:
        """All pictures that can be referred to, the oldest first."""
        return tuple(self._taken.values())

    @property
    def short_ids(self) -> dict[str, str]:
        """The short ids of those, by their names."""
        return {each.name: each.id for each in self._taken.values()}

    @property
    def half_view_rad(self) -> float:
        """Half the field of view of the camera that looks ahead, or of a common camera."""
        return find_half_view_rad(self._views)

    @property
    def views(self) -> tuple[CameraView, ...]:
        """Where pictures of this map were taken, the oldest first, forgotten ones among them."""
        return tuple(self._views)

    def add(self, picture: TakenPicture, data: bytes, *, media_type: str) -> TakenPicture:
        """Return a new picture with its id, and a name unless a folder named it."""
        self._n_taken += 1
        picture_id = f"P{self._n_taken}"
        ending = media_type.partition("/")[2].replace("jpeg", "jpg")
        content = data + repr((picture.pose, picture.stamp_s)).encode()
        name = f"{picture_id}-{hashlib.sha256(content).hexdigest()[:8]}.{ending}"
        taken = replace(picture, id=picture_id, name=picture.name or name)
        self._taken[picture_id] = taken
        self._views.append(taken.view)
        while len(self._taken) > MOST_PICTURES:
            self._taken.popitem(last=False)
        return taken

    def forget(self) -> bool:
        """Forget all earlier pictures; return whether there were any."""
        had_any = bool(self._taken)
        self._taken.clear()
        self._views.clear()
        return had_any

    def find(self, said: str) -> TakenPicture | None:
        """Return the picture of that id ("P12", "picture p12") or name, or None."""
        key = said.strip().casefold().removeprefix("picture").strip()
        taken = self._taken.values()
        return next(
            (each for each in taken if key in (each.id.casefold(), each.name.casefold())), None
        )
