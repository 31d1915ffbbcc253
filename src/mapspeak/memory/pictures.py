"""The pictures that were taken lately: where from, and which way each column of them looks."""

import hashlib
import math
from collections import OrderedDict
from dataclasses import dataclass, replace
from datetime import datetime

from mapspeak.errors import SemanticMapError
from mapspeak.geometry import Pose, wrap_angle
from mapspeak.memory.laserfan import LaserRing
from mapspeak.spatial.viewing import HALF_VIEW_RAD, CameraView

MOST_PICTURES = 500
"""How many pictures can be spoken of; older ones are forgotten here, whoever keeps them."""
BESIDE_RAD = math.radians(10.0)
"""The middle of a thing that the edge cuts lies beside the picture, and is read off roughly."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureReading:
    """How far the robot's own sensors measured something in a picture to be.

    Attributes:
        bearing_rad: From the heading the picture was taken along, left positive.
    """

    label: str
    bearing_rad: float
    range_m: float
    source: str


@dataclass(frozen=True, slots=True, kw_only=True)
class TakenPicture:
    """What is known of a picture besides what it shows.

    Attributes:
        id: How a reader speaks of it: P12.
        name: Its relative name, unlike that of any other picture of any run: P12-5d0c21f7.jpg.
        pose: Where the robot stood, in the map frame; the camera looks along its heading.
        reported: Labels of all that the robot's detector reports in it; None where none read it.
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

    def shows(self, bearing_rad: float) -> bool:
        """Return True for a direction from the heading in the picture, or just beside it."""
        if self.horizontal_fov_rad is None:
            return True
        return abs(wrap_angle(bearing_rad)) <= self.horizontal_fov_rad / 2 + BESIDE_RAD

    @property
    def view(self) -> CameraView:
        """Where it was taken, and how wide it is or probably is."""
        if self.horizontal_fov_rad is None:
            return CameraView(self.pose)
        return CameraView(self.pose, self.horizontal_fov_rad / 2)

    def bearing_of(self, column_px: float) -> float:
        """Return the direction of a column from the heading, left positive, in radians.

        The lens is a pinhole, as the simulated camera's and that of a ROS CameraInfo: columns are
        evenly spaced on a plane, not on a circle.

        Args:
            column_px: From the left edge; the middle of the picture is half its width.

        Raises:
            SemanticMapError: The picture has no such column, or nobody knows how wide it looks.
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
    """Names the pictures of one run in their order."""

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
        """All that can be spoken of, the oldest first."""
        return tuple(self._taken.values())

    @property
    def half_view_rad(self) -> float:
        """Half the opening of the camera by its latest picture, or of a common one."""
        return self._views[-1].half_view_rad if self._views else HALF_VIEW_RAD

    @property
    def views(self) -> tuple[CameraView, ...]:
        """Where pictures of this map were taken, the oldest first, forgotten ones among them."""
        return tuple(self._views)

    def add(self, picture: TakenPicture, data: bytes, *, media_type: str) -> TakenPicture:
        """Return a picture that was just taken with its id, and a name where no folder gave one."""
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
        """Let nobody speak of earlier pictures any more; return whether there were any."""
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
