"""Views of camera and laser: a new picture with its caption, kept ones, rings for records."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated

import anyio
from mcp.server.mcpserver import Image
from PIL import Image as PictureFile
from pydantic import Field

from mapspeak.errors import LinkError, SemanticMapError
from mapspeak.geometry import Pose, wrap_angle
from mapspeak.memory import LaserRing, PictureReading, TakenPicture, build_ring
from mapspeak.memory.episodes.observation import Observation, named_pictures, placed
from mapspeak.memory.things.labels import name_the_same
from mapspeak.places.recall.nearby import in_rooms_of
from mapspeak.places.recall.undescribed import UndescribedPicture, find_undescribed
from mapspeak.robot import SCAN_PATIENCE_S, CameraPicture, Detection, Robot
from mapspeak.server.text.offered import lead
from mapspeak.server.text.recall import say_picture, say_undescribed
from mapspeak.server.text.wording import say_pose, say_pose_doubt
from mapspeak.session import Session

MOST_SHOWN = 8
SAME_BEARING_RAD = math.radians(20.0)
"""A direction read off a picture and one that was measured differ by less 19 times in 20."""
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


def show_picture(picture: CameraPicture) -> Image:
    """Return a picture as an answer holds it."""
    return Image(data=picture.data, format=picture.media_type.partition("/")[2])


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
        return show_picture(self.picture)


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


async def find_taken(session: Session, said: str | None) -> TakenPicture | None:
    """Return the picture of an id, a name, or an observation, also of an earlier run.

    Raises:
        SemanticMapError: There is none, or it was taken on a map that lies apart.
    """
    taken = None if said is None else session.pictures.find(said)
    if said is None or taken is not None:
        return taken
    store = session.episodes.store
    seen = await session.compute(lambda: store.get(said.strip()))
    path = None if seen is None else await session.compute(lambda: store.picture_path(seen))
    match = None if seen is None else placed(seen, session.memory.place_maps())
    if seen is None or path is None or match is None or match.is_elsewhere:
        raise SemanticMapError(
            f"There is no picture {said[:40]!r} of this map.",
            hint=lead("Give the id of one, such as P3. {look_through_camera} takes one."),
        )
    return session.pictures.find(path.name) or TakenPicture(
        id=seen.id,
        name=path.name,
        pose=match.observation.pose,
        stamp_s=seen.stamp_s or 0.0,
        recorded_at=seen.recorded_at,
        width_px=await session.compute(partial(_measure_width_px, path)),
        horizontal_fov_rad=None,
        reported=seen.labels or None,
    )


def find_reading(
    label: str, stood: Pose, bearing_rad: float | None, picture: TakenPicture
) -> PictureReading | None:
    """Return what was measured of a thing of that name, in a direction from a pose or in all."""
    measured = (each for each in picture.readings if each.range_m is not None)
    called = [each for each in measured if name_the_same(each.label, label)]
    if bearing_rad is None:
        return called[0] if len(called) == 1 else None
    way_rad = stood.yaw_rad + bearing_rad - picture.pose.yaw_rad
    found = [
        (off_rad, number)
        for number, reading in enumerate(called)
        if (off_rad := abs(wrap_angle(reading.bearing_rad - way_rad))) <= SAME_BEARING_RAD
    ]
    return called[min(found)[1]] if found else None


def _measure_width_px(path: Path) -> int:
    with PictureFile.open(path) as picture:
        return picture.width


async def find_undescribed_pictures(session: Session) -> tuple[UndescribedPicture, ...]:
    """Return the kept pictures of this map that nothing was written of, the newest first.

    Their rooms are those of the map that was looked at last.
    """
    world = session.world

    def find() -> tuple[UndescribedPicture, ...]:
        named = named_pictures(session.memory.store.read())
        found = find_undescribed(session.find_episodes, session.memory.read(), named=named)
        if world is None:
            return found
        matches = in_rooms_of(world, (each.match for each in found))
        return tuple(replace(each, match=at) for each, at in zip(found, matches, strict=True))

    return await session.compute(find)


async def show_undescribed(session: Session) -> list[str | Image]:
    """Return pictures that nothing was written of, each with what is known of it."""
    shown: list[str | Image] = []
    pictures = await find_undescribed_pictures(session)
    for each in pictures[:MOST_SHOWN]:
        image = await load_picture(session, each.match.observation)
        shown += [] if image is None else [say_picture(each, session.pictures), image]
    said = say_undescribed(pictures, session.pictures, most=0)
    return [*shown, *(said or ["No picture is without words."])]


async def load_picture(session: Session, seen: Observation) -> Image | None:
    """Return the picture of an observation; None where it is not kept (any more)."""
    path = await session.compute(lambda: session.episodes.store.picture_path(seen))
    if path is None:
        return None
    data = await session.compute(path.read_bytes)
    return Image(data=data, format="png" if path.suffix == ".png" else "jpeg")


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
