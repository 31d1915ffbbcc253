"""What one frame of the semantic map file must say; turned into a `MapFrame`, and back."""

import math
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from mapspeak.memory.frames import MapFrame
from mapspeak.memory.quoting import quote_name
from mapspeak.memory.store.schema import PoseEntry, length_text
from mapspeak.memory.store.tree import Data, ListNode, MappingNode, Node, TextError

_EXAMPLE = "- {id: F2, map: house, pose: {x: 1.20, y: -3.40, yaw_deg: 90.0}}"


class _FrameEntry(BaseModel):
    """One item of the list `frames`, strictly: with an overlooked `pos` it would lie nowhere."""

    model_config = ConfigDict(extra="forbid")

    id: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,16}$")]
    map: str | None = None
    robot: str | None = None
    walls: str | None = None
    pose: PoseEntry | None = None
    reference: Annotated[str | None, Field(alias="in")] = None

    def to_frame(self) -> MapFrame:
        return MapFrame(
            id=self.id,
            map_id=self.map,
            robot=self.robot,
            walls=self.walls,
            pose=None if self.pose is None else self.pose.to_pose(),
            reference=self.reference,
        )


def read_frames(root: MappingNode | None) -> tuple[tuple[MapFrame, Node], ...]:
    """Return the frames of a file's top mapping, and where each stands in the text.

    Raises:
        TextError: One of them does not say what it must, or two have the same id.
    """
    node = root.find_value("frames") if root else None
    if node is None or not node.data:
        return ()
    if not isinstance(node, ListNode):
        message = "The key 'frames' is not a list."
        raise TextError(message, hint=f"Write each frame like `{_EXAMPLE}`.", offset=node.start)
    frames: dict[str, tuple[MapFrame, Node]] = {}
    for item in node.items:
        try:
            frame = _FrameEntry.model_validate(item.data).to_frame()
        except ValidationError as error:
            raise _fault_in(item, error) from error
        if frame.id in frames:
            raise TextError(
                f"Two frames have the id '{frame.id}'.",
                hint="Give one of them another id.",
                offset=item.start,
                other_offset=frames[frame.id][1].start,
            )
        frames[frame.id] = (frame, item)
    return tuple(frames.values())


def frame_from(data: Data) -> MapFrame:
    """Return the frame that an entry describes.

    Raises:
        ValidationError: The entry does not say what it must.
    """
    return _FrameEntry.model_validate(data).to_frame()


def frame_data(frame: MapFrame) -> dict[str, Data]:
    """Return what an entry says of a frame: millimetres, fractions of a degree."""
    entries: dict[str, Data] = {
        "id": frame.id,
        "map": frame.map_id,
        "robot": frame.robot,
        "walls": frame.walls,
        "pose": None
        if frame.pose is None
        else {
            "x": length_text(frame.pose.x),
            "y": length_text(frame.pose.y),
            # Finer than a record's: a hundred metres away it still is a millimetre.
            "yaw_deg": f"{math.degrees(frame.pose.yaw_rad) + 0.0:.4f}",
        },
        "in": frame.reference,
    }
    return {key: value for key, value in entries.items() if value}


def _fault_in(item: Node, error: ValidationError) -> TextError:
    first = error.errors()[0]
    key = str(first["loc"][0]) if first["loc"] else ""
    value = item.find_value(key) if isinstance(item, MappingNode) else None
    said = "no such key" if first["type"] == "extra_forbidden" else first["msg"]
    what = f"The frame's {quote_name(key)}: {said}." if key else "This is not a frame."
    place = value or item
    return TextError(what, hint=f"Write it like `{_EXAMPLE}`.", offset=place.start)
