"""Depth pictures: compressed ones read, and any of them shaded so that a reader sees it."""

import struct

import cv2
import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import LinkError

PREFIX = struct.Struct("<iff")
"""What compressedDepth puts before the PNG: a kind, and two terms of the quantisation."""
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
    """Read image_transport's compressedDepth: metres, NaN where nothing was measured.

    Raises:
        LinkError: It is damaged, or compressed with RVL.
    """
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
