"""Camera pictures of ROS messages: every usual encoding becomes a file a model can see."""

import base64
import io
import struct
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from mapspeak.errors import LinkError
from mapspeak.ros.messages.fields import Dialect, write_header
from mapspeak.ros.messages.pictures import (
    EncodedPicture,
    read_compressed_image,
    read_depth,
    read_image,
)

HEADER = {"stamp": {"secs": 3, "nsecs": 0}, "frame_id": "camera"}
ORANGE = (230, 120, 20)


def image_message(
    encoding: str, samples: NDArray[np.generic], *, padding: int = 0, is_bigendian: bool = False
) -> dict[str, object]:
    """Lays samples of shape (rows, cols, ...) out as a camera driver does."""
    if is_bigendian:
        samples = samples.astype(samples.dtype.newbyteorder(">"))
    rows = [row.tobytes() + b"\xaa" * padding for row in samples]
    return {
        "header": HEADER,
        "height": samples.shape[0],
        "width": samples.shape[1],
        "encoding": encoding,
        "is_bigendian": int(is_bigendian),
        "step": len(rows[0]),
        "data": base64.b64encode(b"".join(rows)).decode(),
    }


def painted(*colour: int, dtype: type = np.uint8, n: int = 8) -> NDArray[np.generic]:
    return np.tile(np.array(colour, dtype=dtype), (n, n, 1))


def mosaic(pattern: str) -> NDArray[np.uint8]:
    """Gives what a sensor behind a colour filter sees of an orange wall."""
    tile = np.array([ORANGE["rgb".index(sign)] for sign in pattern], dtype=np.uint8).reshape(2, 2)
    return np.tile(tile, (8, 8))


def yuv(order: str) -> NDArray[np.uint8]:
    rgb = np.tile(np.array(ORANGE, dtype=np.uint8), (8, 8, 1))
    # ITU-R BT.601 with a reduced range, which is what OpenCV undoes.
    r, g, b = (float(value) for value in rgb[0, 0])
    y = 16 + 0.257 * r + 0.504 * g + 0.098 * b
    u = 128 - 0.148 * r - 0.291 * g + 0.439 * b
    v = 128 + 0.439 * r - 0.368 * g - 0.071 * b
    pair = {"uyvy": (u, y, v, y), "yuyv": (y, u, y, v)}[order]
    return np.tile(np.rint(pair).astype(np.uint8).reshape(2, 2), (8, 4, 1))


def opened(picture: EncodedPicture) -> Image.Image:
    image = Image.open(io.BytesIO(picture.data))
    image.load()
    assert image.size == (picture.width_px, picture.height_px)
    assert picture.media_type == f"image/{(image.format or '').lower()}"
    return image


@pytest.mark.parametrize(
    ("encoding", "samples"),
    [
        ("rgb8", painted(*ORANGE)),
        ("bgr8", painted(*ORANGE[::-1])),
        ("8UC3", painted(*ORANGE[::-1])),
        ("rgba8", painted(*ORANGE, 255)),
        ("bgra8", painted(*ORANGE[::-1], 255)),
        ("rgb16", painted(*(value * 256 for value in ORANGE), dtype=np.uint16)),
        ("bayer_rggb8", mosaic("rggb")),
        ("bayer_bggr8", mosaic("bggr")),
        ("bayer_gbrg8", mosaic("gbrg")),
        ("bayer_grbg8", mosaic("grbg")),
        ("bayer_rggb16", mosaic("rggb").astype(np.uint16) * 256),
        ("yuv422", yuv("uyvy")),
        ("yuv422_yuy2", yuv("yuyv")),
    ],
)
@pytest.mark.parametrize("padding", [0, 5])
def test_an_orange_wall_is_orange_in_every_encoding(
    encoding: str, samples: NDArray[np.generic], padding: int
) -> None:
    picture = opened(read_image(image_message(encoding, samples, padding=padding)))
    assert picture.mode == "RGB"
    assert picture.getpixel((3, 4)) == pytest.approx(ORANGE, abs=6)


def test_grey_levels_stay_what_they_are() -> None:
    levels = np.arange(64, dtype=np.uint8).reshape(8, 8)
    picture = opened(read_image(image_message("mono8", levels, padding=3)))
    assert np.array_equal(np.asarray(picture), levels)


@pytest.mark.parametrize("is_bigendian", [False, True])
def test_dim_16_bit_grey_is_spread_over_what_can_be_seen(is_bigendian: bool) -> None:  # noqa: FBT001
    levels = np.linspace(1000, 2000, 64, dtype=np.uint16).reshape(8, 8)
    picture = opened(read_image(image_message("mono16", levels, is_bigendian=is_bigendian)))
    assert picture.getpixel((0, 0)) == 0
    assert picture.getpixel((7, 7)) == 255


@pytest.mark.parametrize("is_bigendian", [False, True])
@pytest.mark.parametrize(
    ("encoding", "samples"),
    [
        ("16UC1", np.array([[0, 1000], [2500, 4000]], dtype=np.uint16)),
        ("32FC1", np.array([[np.nan, 1.0], [2.5, 4.0]], dtype=np.float32)),
    ],
)
def test_depth_is_metres_in_either_byte_order(
    encoding: str,
    samples: NDArray[np.generic],
    is_bigendian: bool,  # noqa: FBT001
) -> None:
    message = image_message(encoding, samples, padding=2, is_bigendian=is_bigendian)
    depth_m = read_depth(message)
    assert depth_m == pytest.approx(np.array([[np.nan, 1.0], [2.5, 4.0]]), nan_ok=True)
    shaded = opened(read_image(message))
    assert [shaded.getpixel(at) for at in ((0, 0), (1, 0), (0, 1), (1, 1))] == [0, 255, 155, 55]


@pytest.mark.parametrize("kind", ["jpeg", "png"])
def test_a_compressed_picture_passes_as_it_is(kind: str) -> None:
    encoded = io.BytesIO()
    Image.new("RGB", (20, 10), ORANGE).save(encoded, format=kind)
    sent = EncodedPicture(
        data=encoded.getvalue(),
        media_type=f"image/{kind}",
        width_px=20,
        height_px=10,
        frame_id="camera",
        stamp_s=3.0,
    )
    header = write_header("camera", 3.0, dialect=Dialect.ROS2)
    message = {"header": header, "format": kind, "data": encoded.getvalue()}
    assert read_compressed_image(message) == sent


def compressed(form: str, data: bytes) -> dict[str, object]:
    return {"header": HEADER, "format": form, "data": base64.b64encode(data).decode()}


def png_of(levels: NDArray[np.integer[Any]]) -> bytes:
    _, encoded = cv2.imencode(".png", levels)
    return encoded.tobytes()


def test_of_several_pictures_in_one_file_the_first_passes() -> None:
    encoded = io.BytesIO()
    left, right = Image.new("RGB", (8, 6)), Image.new("RGB", (8, 6))
    left.save(encoded, format="MPO", save_all=True, append_images=[right])
    message = {"header": HEADER, "format": "jpeg", "data": encoded.getvalue()}
    picture = read_compressed_image(message)
    assert (picture.media_type, picture.width_px, picture.height_px) == ("image/jpeg", 8, 6)


def test_compressed_depth_is_shaded_from_near_to_far() -> None:
    png = png_of(np.array([[0, 1000], [2500, 4000]], dtype=np.uint16))
    message = compressed("16UC1; compressedDepth png", struct.pack("<iff", 0, 0.0, 0.0) + png)
    shaded = opened(read_compressed_image(message))
    assert [shaded.getpixel(at) for at in ((0, 0), (1, 0), (0, 1), (1, 1))] == [0, 255, 155, 55]


def test_compressed_depth_of_real_numbers_is_unquantised() -> None:
    # image_transport stores scale / depth + shift.
    inverse = np.array([[0, 4100], [2100, 1100]], dtype=np.uint16)
    prefix = struct.pack("<iff", 0, 4000.0, 100.0)
    shaded = opened(
        read_compressed_image(compressed("32FC1; compressedDepth", prefix + png_of(inverse)))
    )
    assert shaded.getpixel((1, 0)) == 255  # 1 m
    assert shaded.getpixel((1, 1)) == 55  # 4 m
    assert shaded.getpixel((0, 1)) == pytest.approx(255 - 200 / 3, abs=1)  # 2 m


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"encoding": "nv12"}, "nv12"),
        ({"encoding": 7}, "encoding"),
        ({"width": 0}, "width"),
        ({"width": 10**9}, "width"),
        ({"step": 5}, "rows of 5 bytes"),
        ({"height": 9}, "needs"),
        ({"data": "%%%"}, "data"),
        ({"data": [1, 2, 300]}, "data"),
        ({"header": {}}, "stamp|frame_id"),
    ],
)
def test_a_picture_that_does_not_fit_itself_is_refused(
    changes: dict[str, object], said: str
) -> None:
    with pytest.raises(LinkError, match=said) as refusal:
        read_image({**image_message("rgb8", painted(*ORANGE)), **changes})
    assert refusal.value.hint


@pytest.mark.parametrize(
    ("form", "data", "said"),
    [
        ("jpeg", b"", "empty"),
        ("jpeg", b"no picture at all", "neither JPEG nor PNG"),
        ("h264", b"\x00\x00\x00\x01\x67", "h264"),
        ("16UC1; compressedDepth rvl", b"\x00" * 64, "RVL"),
        ("16UC1; compressedDepth png", b"\x00" * 64, "damaged"),
        ("16UC1; compressedDepth png", b"", "damaged"),
        ("png", png_of(np.zeros((64, 64), dtype=np.uint8))[:-20], "cut off"),
    ],
)
def test_a_compressed_picture_nobody_can_read_is_refused(form: str, data: bytes, said: str) -> None:
    with pytest.raises(LinkError, match=said) as refusal:
        read_compressed_image(compressed(form, data))
    assert refusal.value.hint
