"""Camera pictures of ROS messages, raw or compressed, as PNG or JPEG files."""

import io
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from mapspeak.errors import LinkError
from mapspeak.ros.messages.fields import Dialect, Message, read_header, text_of, write_header
from mapspeak.ros.messages.pixels import (
    LARGEST_SIDE_PX,
    bytes_of,
    read_compressed_depth,
    read_depth,
    read_pixels,
    shade_depth,
)

JPEG_QUALITY = 85
MEDIA_TYPES = {"JPEG": "image/jpeg", "PNG": "image/png"}


@dataclass(frozen=True, slots=True, kw_only=True)
class EncodedPicture:
    """A picture as a file.

    Attributes:
        media_type: "image/jpeg" or "image/png".
        is_depth: Its grey levels are shaded depth.
    """

    data: bytes
    media_type: str
    width_px: int
    height_px: int
    frame_id: str
    stamp_s: float
    is_depth: bool = False


def read_image(message: Message) -> EncodedPicture:
    """Read sensor_msgs/Image: colours become JPEG; grey levels and depth become PNG.

    Depth is shaded from near (bright) to far (dark); black is where nothing was measured.
    """
    encoding = text_of(message, "encoding")
    if encoding in ("16UC1", "32FC1"):
        return replace(_encode(shade_depth(read_depth(message)), message), is_depth=True)
    return _encode(read_pixels(message), message)


def read_compressed_image(message: Message) -> EncodedPicture:
    """Read sensor_msgs/CompressedImage: JPEG and PNG pass as they are, depth is shaded."""
    frame_id, stamp_s = read_header(message)
    form, data = text_of(message, "format"), bytes_of(message)
    if "compressedDepth" in form:
        return replace(
            _encode(shade_depth(read_compressed_depth(data, form)), message), is_depth=True
        )
    kind, mode, (width_px, height_px) = _identify(data, form)
    if mode.startswith("I"):  # 16 bits: no model sees those
        return replace(_encode(shade_depth(_decode_wide(data)), message), is_depth=True)
    return EncodedPicture(
        data=data,
        media_type=MEDIA_TYPES[kind],
        width_px=width_px,
        height_px=height_px,
        frame_id=frame_id,
        stamp_s=stamp_s,
    )


def write_compressed_image(picture: EncodedPicture, *, dialect: Dialect) -> dict[str, Any]:
    """Write sensor_msgs/CompressedImage; the data as bytes."""
    return {
        "header": write_header(picture.frame_id, picture.stamp_s, dialect=dialect),
        "format": picture.media_type.removeprefix("image/"),
        "data": picture.data,
    }


def _encode(pixels: NDArray[np.uint8], message: Message) -> EncodedPicture:
    """Make a file of grey levels, shape (rows, cols), or of colours, shape (rows, cols, 3)."""
    frame_id, stamp_s = read_header(message)
    is_grey = pixels.ndim == 2
    if is_grey:
        _, encoded = cv2.imencode(".png", pixels)
    else:
        bgr = cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR)
        _, encoded = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return EncodedPicture(
        data=encoded.tobytes(),
        media_type="image/png" if is_grey else "image/jpeg",
        width_px=pixels.shape[1],
        height_px=pixels.shape[0],
        frame_id=frame_id,
        stamp_s=stamp_s,
    )


def _identify(data: bytes, form: str) -> tuple[str, str, tuple[int, int]]:
    """Return kind, mode and size by what the file says; `format` is filled in many ways."""
    hint = "Subscribe to a raw image topic instead, or let the camera publish JPEG or PNG."
    if not data:
        raise LinkError("The camera's compressed picture is empty.", hint=hint)
    try:
        with Image.open(io.BytesIO(data), formats=("JPEG", "PNG")) as picture:
            kind, mode, size = picture.format or "", picture.mode, picture.size
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise LinkError(
            f"The camera's compressed picture ({form[:40]!r}) is neither JPEG nor PNG.", hint=hint
        ) from error
    # Only the header has been looked at; a picture that was cut off lacks its end mark.
    end_mark = b"\xff\xd9" if kind == "JPEG" else b"IEND"
    if end_mark not in data[-512:]:
        raise LinkError(
            f"The camera's {kind} picture of {len(data)} bytes is cut off.", hint="Take another."
        )
    if not (0 < size[0] <= LARGEST_SIDE_PX and 0 < size[1] <= LARGEST_SIDE_PX):
        raise LinkError(f"The camera's picture has {size[0]}x{size[1]} pixels.", hint=hint)
    return kind, mode, size


def _decode_wide(data: bytes) -> NDArray[np.float64]:
    pixels = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
    if pixels is None or pixels.ndim != 2:
        raise LinkError("The camera's 16-bit picture is damaged.", hint="Take another.")
    return np.where(pixels > 0, pixels, np.nan).astype(np.float64)
