"""The present views of camera and laser: the picture with its caption, rings for records."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import anyio
from mcp.server.mcpserver import Image
from pydantic import Field

from mapspeak.errors import LinkError
from mapspeak.memory import LaserRing, PictureReading, TakenPicture, build_ring
from mapspeak.robot import SCAN_PATIENCE_S, CameraPicture, Detection, Robot
from mapspeak.server.text.wording import say_pose, say_pose_doubt
from mapspeak.session import Session

LEGEND = " (bearing, left positive; range; confidence)"
Camera = Annotated[str | None, Field(description="by name; else front", max_length=60)]


async def fetch_ring(robot: Robot) -> LaserRing | None:
    """Return the laser's ring of ranges; None without a laser, or without its answer in time.

    A picture or a write does not fail without it, nor wait longer than `SCAN_PATIENCE_S` for it.
    """
    if not robot.description.has_laser:
        return None
    scan = None
    with anyio.move_on_after(SCAN_PATIENCE_S):
        try:
            scan = await robot.fetch_scan()
        except LinkError:
            return None
    if scan is None:
        return None
    return build_ring(
        scan.pose, angles_rad=scan.angles_rad, ranges_m=scan.ranges_m, reach_m=scan.reach_m
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraSighting:
    """A picture of a camera, and its caption.

    Attributes:
        title: Its id, and its camera if that was asked for.
        picture: The picture.
        detector: What reports things in it; None where nothing does.
        detections: Its reports.
        remarks: What is doubtful about its pose, and why it was not kept.
    """

    title: str
    picture: CameraPicture
    detector: str | None
    detections: tuple[Detection, ...]
    remarks: tuple[str, ...]

    @property
    def text(self) -> str:
        """The whole caption."""
        return self._say(f"{self.title}: {self.say_size()}, ", LEGEND)

    @property
    def brief(self) -> str:
        """The caption for a reader of one of this size by the same camera."""
        return self._say(f"{self.title}, ", "")

    def say_size(self) -> str:
        """Say how large and how wide the picture is."""
        fov_rad = self.picture.horizontal_fov_rad
        width = "" if fov_rad is None else f", {math.degrees(fov_rad):.0f} deg wide"
        return f"{self.picture.width_px} x {self.picture.height_px} px{width}"

    def _say(self, title: str, legend: str) -> str:
        lines = [f"{title}taken at {say_pose(self.picture.pose)}.", *self.remarks]
        if self.detector is not None and not self.detections:
            lines.append(f"The robot's {self.detector} reports nothing.")
        elif self.detector is not None:
            lines.append(f"The robot's {self.detector} reports{legend}:")
            lines += [_say_detection(seen) for seen in self.detections]
        return "\n".join(lines)

    @property
    def image(self) -> Image:
        """The picture as a tool gives it."""
        return Image(data=self.picture.data, format=self.picture.media_type.partition("/")[2])


async def look_ahead(session: Session, camera: str | None = None) -> CameraSighting:
    """Take a picture with a camera, name it, and keep it as an episode.

    Args:
        camera: By its name; None for the one that looks ahead, through which the detector looks.

    Raises:
        LinkError: There is no such camera, or it cannot be reached.
    """
    robot = session.robot
    picture = await robot.fetch_picture(camera)
    cameras = robot.description.cameras
    name = robot.description.find_camera(camera) if camera else next(iter(cameras), "")
    is_ahead = not camera or name == cameras[0]
    detector = robot.description.detector if is_ahead else None
    detections: tuple[Detection, ...] = ()
    if detector is not None:
        detections = await robot.fetch_detections()
    # Asked at once: the robot may drive on while the picture is kept.
    laser = await fetch_ring(robot)
    labels = tuple(seen.label for seen in detections)
    kept = await session.keep_picture(picture, labels=labels)
    taken = TakenPicture(
        pose=picture.pose,
        stamp_s=picture.stamp_s,
        width_px=picture.width_px,
        horizontal_fov_rad=picture.horizontal_fov_rad,
        name=kept.picture or "",
        recorded_at=session.find_wall_time(),
        readings=tuple(_read(detector, detections)),
        laser=laser,
        reported=None if detector is None else labels,
        is_ahead=is_ahead,
    )
    taken = session.pictures.add(taken, picture.data, media_type=picture.media_type)
    doubt = say_pose_doubt(picture.pose_doubt) if picture.pose_doubt else ""
    return CameraSighting(
        title=f"Picture {taken.id}" + (f", camera {name!r}" if camera else ""),
        picture=picture,
        detector=detector,
        detections=detections,
        remarks=tuple(filter(None, (doubt, kept.fault))),
    )


def _read(detector: str | None, detections: tuple[Detection, ...]) -> Iterator[PictureReading]:
    """Return what a detector reports of the picture."""
    for seen in detections:
        if detector is not None:
            yield PictureReading(
                label=seen.label,
                bearing_rad=seen.bearing_rad,
                range_m=seen.range_m,
                source=detector,
            )


def _say_detection(seen: Detection) -> str:
    return (
        f"- {seen.label}, {math.degrees(seen.bearing_rad):+.0f} deg, "
        f"{_say_range(seen.range_m)}, {seen.confidence_ratio:.2f}"
    )


def _say_range(range_m: float | None) -> str:
    return "range unknown" if range_m is None else f"{range_m:.1f} m"
