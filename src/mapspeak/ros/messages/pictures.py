"""Camera pictures of ROS messages, raw in every usual encoding or compressed, as PNG or JPEG."""

import io
import struct
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from mapspeak.errors import LinkError
from mapspeak.ros.messages.fields import (
    Message,
    bytes_of,
    misfit,
    read_header,
    text_of,
    whole_of,
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
    form, data = text_of(message, "format"), bytes_of(message.get("data"))
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
            # A JPEG file of several pictures, of which every reader shows the first.
            kind = "JPEG" if kind == "MPO" else kind
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


PREFIX = struct.Struct("<iff")
"""The header of compressedDepth before the PNG: a kind, and two terms of the quantisation."""
MILLIMETRE_M = 0.001

Depth = NDArray[np.float64]


def shade_depth(depth_m: Depth) -> NDArray[np.uint8]:
    """Return grey levels, shape (rows, cols): near 255, far 55, 0 where nothing was measured."""
    is_measured = np.isfinite(depth_m)
    shades = np.zeros(depth_m.shape, dtype=np.uint8)
    if not is_measured.any():
        return shades
    near_m, far_m = depth_m[is_measured].min(), depth_m[is_measured].max()
    share = (depth_m[is_measured] - near_m) / max(far_m - near_m, 1e-9)
    shades[is_measured] = np.rint(255.0 - 200.0 * share).astype(np.uint8)
    return shades


def read_compressed_depth(data: bytes, form: str) -> Depth:
    """Read image_transport's compressedDepth: metres, NaN where nothing was measured."""
    if "rvl" in form.lower():
        raise LinkError(
            "The camera compresses depth with RVL, which cannot be read.",
            hint="Set its compressedDepth format to png, or subscribe to the raw depth topic.",
        )
    levels = None
    if len(data) > PREFIX.size:
        packed = np.frombuffer(data, dtype=np.uint8, offset=PREFIX.size)
        levels = cv2.imdecode(packed, cv2.IMREAD_UNCHANGED)
    if levels is None or levels.ndim != 2:
        raise LinkError(
            f"The camera's compressed depth picture of {len(data)} bytes is damaged.",
            hint="Take another, or subscribe to the raw depth topic.",
        )
    known = np.where(levels > 0, levels, np.nan).astype(np.float64)
    if "32FC1" not in form:
        return known * MILLIMETRE_M
    _, scale, shift = PREFIX.unpack_from(data)
    with np.errstate(all="ignore"):
        depth_m = scale / (known - shift)
    return np.where(np.isfinite(depth_m) & (depth_m > 0.0), depth_m, np.nan)


LARGEST_SIDE_PX = 20_000
LARGEST_STEP = 2**31

Pixels = NDArray[np.uint8]

SAMPLES = {
    "mono8": (1, 8), "8UC1": (1, 8), "rgb8": (3, 8), "bgr8": (3, 8), "8UC3": (3, 8),
    "rgba8": (4, 8), "bgra8": (4, 8), "8UC4": (4, 8),
    "mono16": (1, 16), "rgb16": (3, 16), "bgr16": (3, 16), "rgba16": (4, 16), "bgra16": (4, 16),
    "bayer_rggb8": (1, 8), "bayer_bggr8": (1, 8), "bayer_gbrg8": (1, 8), "bayer_grbg8": (1, 8),
    "bayer_rggb16": (1, 16), "bayer_bggr16": (1, 16), "bayer_gbrg16": (1, 16),
    "bayer_grbg16": (1, 16),
    "yuv422": (2, 8), "uyvy": (2, 8), "yuv422_yuy2": (2, 8), "yuyv": (2, 8),
    "16UC1": (1, 16), "32FC1": (1, 32),
}  # fmt: skip
"""Samples per pixel, and bits per sample (sensor_msgs/image_encodings.hpp)."""

DEMOSAICING = {
    "rggb": cv2.COLOR_BayerRGGB2RGB,
    "bggr": cv2.COLOR_BayerBGGR2RGB,
    "gbrg": cv2.COLOR_BayerGBRG2RGB,
    "grbg": cv2.COLOR_BayerGRBG2RGB,
}
YUV = {
    "yuv422": cv2.COLOR_YUV2RGB_UYVY,
    "uyvy": cv2.COLOR_YUV2RGB_UYVY,
    "yuv422_yuy2": cv2.COLOR_YUV2RGB_YUY2,
    "yuyv": cv2.COLOR_YUV2RGB_YUY2,
}


def read_pixels(message: Message) -> Pixels:
    """Read grey levels, shape (rows, cols), or RGB, shape (rows, cols, 3)."""
    encoding = text_of(message, "encoding")
    samples = _read_samples(message, encoding)
    if encoding == "mono16":
        return _stretch(samples[:, :, 0])
    if samples.dtype == np.uint16:
        samples = (samples >> 8).astype(np.uint8)
    if encoding.startswith("bayer_"):
        return _demosaic(samples[:, :, 0], encoding)
    if encoding in YUV:
        return _convert_yuv(samples, encoding)
    if samples.shape[2] == 1:
        return np.ascontiguousarray(samples[:, :, 0], dtype=np.uint8)
    # cv_bridge takes the encodings without a colour name for BGR, as OpenCV does.
    is_rgb = encoding.startswith("rgb")
    rgb = samples[:, :, :3] if is_rgb else samples[:, :, 2::-1]
    return np.ascontiguousarray(rgb, dtype=np.uint8)


def read_depth(message: Message) -> Depth:
    """Read 16UC1 (millimetres) or 32FC1 (metres): metres, NaN where nothing was measured."""
    encoding = text_of(message, "encoding")
    if encoding not in ("16UC1", "32FC1"):
        raise misfit("encoding", encoding, "16UC1 or 32FC1")
    depth = _read_samples(message, encoding)[:, :, 0].astype(np.float64)
    depth_m = depth * MILLIMETRE_M if encoding == "16UC1" else depth
    return np.where(np.isfinite(depth_m) & (depth_m > 0.0), depth_m, np.nan)


def _read_samples(message: Message, encoding: str) -> NDArray[Any]:
    """Return an array of shape (rows, cols, samples), without padding, in native byte order."""
    if encoding not in SAMPLES:
        raise LinkError(
            f"The camera's encoding {encoding[:40]!r} is not known.",
            hint="Subscribe to its compressed topic instead, or let it publish rgb8 or bgr8.",
        )
    n_samples, n_bits = SAMPLES[encoding]
    width_px = whole_of(message, "width", low=1, high=LARGEST_SIDE_PX)
    height_px = whole_of(message, "height", low=1, high=LARGEST_SIDE_PX)
    row_length = width_px * n_samples * n_bits // 8
    # Some drivers leave the step at zero, and mean rows without padding.
    step = whole_of(message, "step", low=0, high=LARGEST_STEP) or row_length
    data = bytes_of(message.get("data"))
    # The last row may come without its padding.
    needed = step * (height_px - 1) + row_length
    if step < row_length or len(data) < needed:
        raise LinkError(
            f"The camera's {width_px}x{height_px} picture in {encoding} has rows of {step} bytes "
            f"and {len(data)} bytes; it needs {row_length} and {needed}.",
            hint="The message is damaged or its driver is wrong: take another picture.",
        )
    rows = np.frombuffer(data[:needed].ljust(step * height_px, b"\0"), dtype=np.uint8)
    packed = np.ascontiguousarray(rows.reshape(height_px, step)[:, :row_length])
    samples = packed.view(_sample_type(message, encoding, n_bits))
    native = samples.astype(samples.dtype.newbyteorder("="))
    return native.reshape(height_px, width_px, n_samples)


def _sample_type(message: Message, encoding: str, n_bits: int) -> str:
    """Return numpy's name for one sample; both bool and uint8 are seen for the byte order."""
    flag = message.get("is_bigendian")
    order = ">" if isinstance(flag, int) and flag else "<"
    return f"{order}{'f' if encoding == '32FC1' else 'u'}{n_bits // 8}"


def _stretch(levels: NDArray[Any]) -> Pixels:
    """Spread 16-bit grey over 8 bits: most such cameras use a part of the range only."""
    wide = levels.astype(np.float64)
    low, high = wide.min(), wide.max()
    shades: Pixels = np.rint((wide - low) * (255.0 / max(high - low, 1.0))).astype(np.uint8)
    return shades


def _demosaic(mosaic: NDArray[Any], encoding: str) -> Pixels:
    pattern = encoding.removeprefix("bayer_")[:4]
    if min(mosaic.shape) < 4:
        raise LinkError(
            f"The camera's Bayer picture has {mosaic.shape[1]}x{mosaic.shape[0]} pixels.",
            hint="It must be at least 4x4: check the camera's settings.",
        )
    grey = np.ascontiguousarray(mosaic, dtype=np.uint8)
    return np.asarray(cv2.cvtColor(grey, DEMOSAICING[pattern]), dtype=np.uint8)


def _convert_yuv(samples: NDArray[Any], encoding: str) -> Pixels:
    if samples.shape[1] % 2:
        raise LinkError(
            f"The camera's {encoding} picture is {samples.shape[1]} pixels wide, an odd number.",
            hint="Check the camera's settings, or subscribe to its compressed topic.",
        )
    pairs = np.ascontiguousarray(samples, dtype=np.uint8)
    return np.asarray(cv2.cvtColor(pairs, YUV[encoding]), dtype=np.uint8)
