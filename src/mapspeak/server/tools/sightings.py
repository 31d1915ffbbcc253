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
        text: Where it was taken, and the reports of the robot's own detector in it.
        picture: The picture.
        detections: The same reports as values; none where the robot has no detector.
    """

    text: str
    picture: CameraPicture
    detections: tuple[Detection, ...]

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
    which = f", camera {name!r}" if camera else ""
    lines = [_say_picture(f"{taken.id}{which}", picture)]
    lines += [say_pose_doubt(picture.pose_doubt)] if picture.pose_doubt else []
    lines += [] if detector is None else _say_detections(detector, detections)
    lines += [kept.fault] if kept.fault else []
    return CameraSighting(text="\n".join(lines), picture=picture, detections=detections)


def _read(detector: str | None, detections: tuple[Detection, ...]) -> Iterator[PictureReading]:
    """Return the measurements for records that may be made of the picture."""
    for seen in detections:
        if detector is not None and seen.range_m is not None:
            yield PictureReading(
                label=seen.label,
                bearing_rad=seen.bearing_rad,
                range_m=seen.range_m,
                source=detector,
            )


def _say_picture(picture_id: str, picture: CameraPicture) -> str:
    fov_rad = picture.horizontal_fov_rad
    width = "" if fov_rad is None else f", {math.degrees(fov_rad):.0f} deg wide"
    return (
        f"Picture {picture_id}: {picture.width_px} x {picture.height_px} px{width}, "
        f"taken at {say_pose(picture.pose)}."
    )


def _say_detections(detector: str, detections: tuple[Detection, ...]) -> list[str]:
    if not detections:
        return [f"The robot's {detector} reports nothing."]
    return [f"The robot's {detector} reports (bearing, left positive; range; confidence):"] + [
        f"- {seen.label}, {math.degrees(seen.bearing_rad):+.0f} deg, "
        f"{_say_range(seen.range_m)}, {seen.confidence_ratio:.2f}"
        for seen in detections
    ]


def _say_range(range_m: float | None) -> str:
    return "range unknown" if range_m is None else f"{range_m:.1f} m"
