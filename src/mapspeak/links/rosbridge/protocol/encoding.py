"""ROS messages as the bytes rosbridge sends: JSON, or CBOR with typed arrays (RFC 8746)."""

import base64
import json

import cbor2
import numpy as np
import orjson

from mapspeak.ros.messages.fields import Message

TAGS = {
    "u2": 69, "u4": 70, "u8": 71, "i1": 72, "i2": 77, "i4": 78, "i8": 79, "f4": 85, "f8": 86,
}  # fmt: skip
"""The typed arrays that rosbridge itself sends, all little-endian; uint8[] is a byte string."""


def to_json(message: Message) -> bytes:
    """Gives a message as JSON: uint8[] as base64 text, other arrays as lists, NaN as null."""
    try:
        return orjson.dumps(message, default=_plain, option=orjson.OPT_SERIALIZE_NUMPY)
    except TypeError:
        # Half a surrogate pair, or a number of more than 64 bits: only an id given by the other
        # end can hold them, and it wants it back.
        return json.dumps(message, default=_plain).encode()


def to_cbor(message: Message) -> bytes:
    """Gives a message as CBOR: uint8[] as bytes, numpy arrays as typed arrays."""
    return cbor2.dumps(message, default=_encode_array)


def _plain(value: object) -> object:
    if isinstance(value, bytes):
        return base64.b64encode(value).decode("ascii")
    if isinstance(value, np.ndarray):  # one that lies in memory in pieces
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is nothing that ROS sends.")


def _encode_array(encoder: cbor2.CBOREncoder, value: object) -> None:
    if isinstance(value, np.ndarray) and value.dtype.str[1:] in TAGS:
        little = value.astype(value.dtype.newbyteorder("<"), copy=False)
        encoder.encode(cbor2.CBORTag(TAGS[value.dtype.str[1:]], little.tobytes()))
        return
    raise TypeError(f"{type(value).__name__} is nothing that ROS sends.")
