"""A robot's map, pose, camera, markers, calls and audit for Foxglove: in a file, or live.

All of it goes as messages of ROS 2 in CDR, so that `ros2 bag` and rosbags read the file too. Needs
the extra foxglove.
"""

import json
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any

import anyio
import foxglove
from foxglove.mcap import MCAPWriteOptions
from foxglove.websocket import ChannelView, Client, ServerListener

from mapspeak.errors import ConfigError, MapspeakError, say_cause
from mapspeak.links.cdr import Codec
from mapspeak.ros.definitions.texts import known_definitions, write_definition
from mapspeak.ros.definitions.types import TypeBook
from mapspeak.ros.messages.fields import Dialect, Message, write_header, write_stamp
from mapspeak.ros.messages.grids import write_grid
from mapspeak.ros.messages.markers import MARKER_ARRAY, Marker, write_markers
from mapspeak.ros.messages.poses import (
    FramedPose,
    FrameTransform,
    write_pose_stamped,
    write_transforms,
)
from mapspeak.server.view.calls import CallFeed
from mapspeak.server.view.document import CallView
from mapspeak.server.view.marking import PERIOD_S, MarkSource, topic_for
from mapspeak.session import Session
from mapspeak.spatial import OccupancyGrid

POSE_S, CAMERA_S = 0.1, 2.0
BASE_FRAME, CAMERA_FRAME = "base_footprint", "camera"
GRID = "nav_msgs/OccupancyGrid"
LATCHED = (GRID, MARKER_ARRAY)
INFO, WARN = 20, 30
"""Levels of rcl_interfaces/Log, which Foxglove shows in a panel of its own."""
MOST_TEXT = 20_000
ROS2 = Dialect.ROS2


class Recorder(ServerListener):
    """Writes messages of ROS 2 to one place; live, repeats the latest latched ones."""

    def __init__(self) -> None:
        self.context = foxglove.Context()
        self._book = TypeBook(known_definitions(ROS2))
        self._codec = Codec(self._book)
        self._channels: dict[str, foxglove.Channel] = {}
        self._latched: dict[str, tuple[bytes, int]] = {}

    def write(self, topic: str, type_name: str, message: Message, *, at_s: float) -> None:
        """Write one message, at a robot time."""
        if topic not in self._channels:
            text = write_definition(self._book.texts, self._book.within(type_name)).encode()
            named = ROS2.type_name(type_name)
            schema = foxglove.Schema(name=named, encoding="ros2msg", data=text)
            self._channels[topic] = foxglove.Channel(
                topic, schema=schema, message_encoding="cdr", context=self.context
            )
        data, at_ns = self._codec.encode(type_name, message), round(max(at_s, 0.0) * 1e9)
        self._channels[topic].log(data, log_time=at_ns)
        if type_name in LATCHED:
            self._latched[topic] = data, at_ns

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        """Send the latched messages again: a late client has missed them."""
        del client
        if channel.topic in self._latched:
            data, at_ns = self._latched[channel.topic]
            self._channels[channel.topic].log(data, log_time=at_ns)


@contextmanager
def record_to(path: Path) -> Iterator[Recorder]:
    """Write an MCAP file while the context lasts.

    Raises:
        ConfigError: It is there already, or cannot be written.
    """
    recorder, options = Recorder(), MCAPWriteOptions(profile="ros2")
    try:
        writer = foxglove.open_mcap(path, context=recorder.context, writer_options=options)
    except OSError as error:
        raise ConfigError(
            f"{path} cannot be recorded to: {say_cause(error)}.",
            hint="Name a file that is not there yet, in a folder that can be written.",
        ) from error
    try:
        yield recorder
    finally:
        writer.close()


@contextmanager
def serve_foxglove(host: str, port: int) -> Iterator[Recorder]:
    """Serve Foxglove while the context lasts.

    Raises:
        ConfigError: The address is taken.
    """
    recorder = Recorder()
    start = partial(foxglove.start_server, name="mapspeak", host=host, port=port)
    try:
        server = start(server_listener=recorder, context=recorder.context)
    except (OSError, RuntimeError) as error:
        raise ConfigError(
            f"{host}:{port} cannot be served on: {error}.",
            hint="Choose another port, or end the program that has this one.",
        ) from error
    try:
        yield recorder
    finally:
        server.stop()


class SessionRecord:
    """Records one session: its repeated looks, and its calls and audit as they happen.

    Args:
        name: Of the robot, where there are several: its topics begin with it.
        calls: Gets the calls.
    """

    def __init__(
        self, session: Session, recorders: Sequence[Recorder], calls: CallFeed, *, name: str = ""
    ) -> None:
        self._session = session
        self._recorders = recorders
        calls.tell = self._note_call
        self._prefix = f"/{name}" if name else ""
        self._markers = topic_for(name)
        self._source = MarkSource(session)
        self._grid: OccupancyGrid | None = None
        self._marks: tuple[Marker, ...] | None = None
        if session.guard is not None:
            session.guard.audit.tell = self._note_audit

    async def run(self) -> None:
        """Look at the robot and record it, until cancelled."""
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(_repeat, self._record_pose, POSE_S)
            tasks.start_soon(_repeat, self._record_map, PERIOD_S)
            tasks.start_soon(_repeat, self._record_markers, PERIOD_S)
            tasks.start_soon(_repeat, self._record_pictures, CAMERA_S)

    def _note_call(self, call: CallView) -> None:
        if call.is_over:
            asked = json.dumps(call.arguments, ensure_ascii=False, default=str)
            self._log("calls", call.tool, f"{asked}\n{call.text}", is_odd=call.is_error)

    def _note_audit(self, line: Mapping[str, Any]) -> None:
        text = json.dumps(line, ensure_ascii=False, default=str)
        is_refused = line["verdict"] not in ("", "allowed")
        self._log("audit", str(line["event"]), text, is_odd=is_refused)

    async def _record_pose(self) -> None:
        here, outer = await self._session.robot.fetch_pose(), self._map_frame
        framed = FramedPose(pose=here.pose, frame_id=outer, stamp_s=here.stamp_s)
        base = FrameTransform(
            parent_from_child=here.pose, parent=outer, child=BASE_FRAME, stamp_s=here.stamp_s
        )
        stamped = write_pose_stamped(framed, dialect=ROS2)
        self._write(f"{self._prefix}/pose", "geometry_msgs/PoseStamped", stamped)
        frames = write_transforms([base], dialect=ROS2)
        self._write(f"{self._prefix}/tf", "tf2_msgs/TFMessage", frames)

    async def _record_map(self) -> None:
        grid = await self._session.robot.fetch_map()
        if grid is not self._grid:
            self._grid, message = grid, write_grid(grid, dialect=ROS2)
            message["header"]["frame_id"] = self._map_frame
            await self._session.compute(partial(self._write, f"{self._prefix}/map", GRID, message))

    async def _record_markers(self) -> None:
        marks = await self._source.fetch()
        if marks != self._marks:
            self._marks = marks
            message = write_markers(marks, frame_id=self._map_frame, dialect=ROS2)
            self._write(self._markers, MARKER_ARRAY, message)

    async def _record_pictures(self) -> None:
        robot = self._session.robot
        for camera in (None, *robot.description.cameras[1:]):
            taken, name = await robot.fetch_picture(camera), camera or CAMERA_FRAME
            header = write_header(name, taken.stamp_s, dialect=ROS2)
            form = taken.media_type.removeprefix("image/")
            message = {"header": header, "format": form, "data": taken.data}
            self._write(f"{self._prefix}/{name}/compressed", "sensor_msgs/CompressedImage", message)

    @property
    def _map_frame(self) -> str:
        return self._session.robot.description.map_frame

    def _log(self, last: str, name: str, text: str, *, is_odd: bool) -> None:
        # Neither half a letter nor a zero goes over a wire of ROS.
        said = text.replace("\x00", " ").encode(errors="replace").decode()[:MOST_TEXT]
        stamp = write_stamp(max(self._session.robot.now_s, 0.0), dialect=ROS2)
        message = {"stamp": stamp, "level": WARN if is_odd else INFO, "name": name, "msg": said}
        self._write(f"/mapspeak{self._prefix}/{last}", "rcl_interfaces/Log", message)

    def _write(self, topic: str, type_name: str, message: Message) -> None:
        for recorder in self._recorders:
            recorder.write(topic, type_name, message, at_s=self._session.robot.now_s)


async def _repeat(work: Callable[[], Awaitable[None]], period_s: float) -> None:
    while True:
        # The robot may answer later.
        with suppress(MapspeakError):
            await work()
        await anyio.sleep(period_s)
