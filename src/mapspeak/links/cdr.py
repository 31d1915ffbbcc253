"""Messages as bytes: CDR, the encoding of DDS, by the code that rosbags makes of a definition."""

import base64
import struct
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.serde import SerdeError
from rosbags.typesys.store import Typestore

from mapspeak.errors import LinkError
from mapspeak.ros.definitions.checking import check_message
from mapspeak.ros.definitions.types import (
    NOTHING,
    Field,
    MessageType,
    TypeBook,
    describe_field,
    look_up,
)
from mapspeak.ros.messages.fields import Message

HEADER_BYTES = 4
"""They tell the byte order and precede the encoded message."""
MOST_BYTES = 100_000_000
"""The largest message that is read or written; a map of 16 million cells has 16 MB."""
MOST_MESSAGES = 1_000_000
"""Within one message: each takes a hundred times its bytes."""
MOST_FIELDS = 1_000
"""Of a type and all types within; rosbags writes code for each, 1 ms long, and for each value of
a fixed array of texts or messages."""
TEXT_BYTES, COUNT_BYTES = 5, 4
"""An empty text, and an empty list."""
DTYPES = {
    kind: np.dtype(code)
    for kind, code in {
        "bool": "?", "byte": "u1", "char": "u1", "int8": "i1", "uint8": "u1", "int16": "<i2",
        "uint16": "<u2", "int32": "<i4", "uint32": "<u4", "int64": "<i8", "uint64": "<u8",
        "float32": "<f4", "float64": "<f8",
    }.items()
}  # fmt: skip
"""The kinds of numbers."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Layout:
    """A type that the store was told of.

    Attributes:
        inner: The layouts of the messages within, by their types.
        least_bytes: Of a message.
        n_fields: Of this and of each type within, by their names in the store.
    """

    name: str
    fields: tuple[Field, ...]
    inner: Mapping[str, "_Layout"]
    least_bytes: int
    n_fields: Mapping[str, int]


class Codec:
    """Reads and writes the messages of all types in a book.

    Args:
        store: Of an earlier state of the book: code is made anew only for types that differ.
    """

    def __init__(self, book: TypeBook, store: "Store | None" = None) -> None:
        self._book = book
        self.store = store or Store()
        self._layouts: dict[str, _Layout] = {}

    def decode(self, type_name: str, data: bytes, *, is_exact: bool = True) -> dict[str, Any]:
        """Return a message; arrays of numbers are numpy arrays upon these bytes, uint8[] is bytes.

        Args:
            type_name: Such as "nav_msgs/OccupancyGrid".
            data: With its header of four bytes.
            is_exact: Nothing may follow the message: more fields belong to another version.
        """
        layout = self._find(type_name)
        if len(data) > MOST_BYTES:
            raise LinkError(
                f"A {type_name} of {len(data)} bytes was not read; {MOST_BYTES} are the most.",
                hint="Let the robot publish less at once.",
            )
        try:
            return self.store.decode(layout.name, data, is_exact=is_exact)
        except (SerdeError, struct.error, ValueError, IndexError) as error:
            raise LinkError(
                f"What came is no {type_name}.",
                hint="The robot may use another version of that type than we know, or a "
                "middleware that does not write plain CDR.",
            ) from error

    def encode(self, type_name: str, message: Message) -> bytes:
        """Return the bytes of a message with their header; fields left out hold their defaults."""
        layout = self._find(type_name)
        filled = self._book.fill(type_name, check_message(self._book, type_name, message))
        shaped = self._shape(layout, filled)
        return bytes(self.store.serialize_cdr(shaped, layout.name, little_endian=True))

    def _find(self, type_name: str, above: tuple[str, ...] = ()) -> _Layout:
        """Return the layout of a type; the store is told of it where it does not know it yet."""
        if type_name not in self._layouts:
            message = look_up(self._book, type_name, above=above)
            kinds = dict.fromkeys(field.type for field in message.fields if field.is_message)
            inner = {kind: self._find(kind, (*above, message.name)) for kind in kinds}
            self._layouts[type_name] = self.store.lay_out(message, inner)
        return self._layouts[type_name]

    def _shape(self, layout: _Layout, message: Mapping[str, Any]) -> SimpleNamespace:
        """Return a message with all its fields as rosbags wants it."""
        values = [self._shape_field(layout, field, message[field.name]) for field in layout.fields]
        numbered = enumerate(values or [0])
        return SimpleNamespace(**{_numbered(number): value for number, value in numbered})

    def _shape_field(self, layout: _Layout, field: Field, value: Any) -> Any:  # noqa: ANN401 - ROS JSON
        if field.is_message:
            inner = layout.inner[field.type]
            if field.length is None:
                return self._shape(inner, value)
            return [self._shape(inner, each) for each in value]
        if field.type == "string":
            return value
        if field.length is None:
            return value % 256 if field.type == "byte" else value
        return _as_array(field, value)


class KnownTypes(ABC):
    """The types that are known, as the robot has them."""

    def __init__(self, book: TypeBook) -> None:
        self._book = book
        self._codec = Codec(book)

    @abstractmethod
    def knows(self, type_name: str) -> bool:
        """Return True for a type whose messages can be encoded and decoded."""

    def encode(self, type_name: str, message: Message) -> bytes:
        """Return the bytes of a message; the fields it leaves out hold their defaults."""
        return self._codec.encode(type_name, message)

    def decode(self, type_name: str, data: bytes) -> dict[str, Any]:
        """Return the message in some bytes."""
        return self._codec.decode(type_name, data)

    def _use(self, book: TypeBook) -> None:
        # In this order: another thread may encode a type as soon as the book knows it.
        self._codec = Codec(book, self._codec.store)
        self._book = book


class Store(Typestore):
    """What rosbags was told of, in all versions.

    Types and fields have numbers for names: what a robot calls them is kept out of the code.
    The thread that listens may meet a new type while another one is written.
    """

    def __init__(self) -> None:
        super().__init__()
        self._lock = threading.Lock()
        self._layouts: dict[object, _Layout] = {}
        self._n_messages_left = 0

    def decode(self, name: str, data: bytes, *, is_exact: bool) -> dict[str, Any]:
        """Return a message by its type's name here; raise `SerdeError`."""
        self._n_messages_left = MOST_MESSAGES
        message: Any
        if is_exact:
            message = self.deserialize_cdr(memoryview(data), name)
        else:
            definition = self.get_msgdef(name)
            read = definition.deserialize_cdr_le if data[1] else definition.deserialize_cdr_be
            message, _ = read(memoryview(data)[HEADER_BYTES:], 0, definition.cls, self)
        decoded: dict[str, Any] = message
        return decoded

    def lay_out(self, message: MessageType, inner: Mapping[str, _Layout]) -> _Layout:
        """Return the layout of a type, given those of the types within."""
        key = (message.fields, tuple(layout.name for layout in inner.values()))
        with self._lock:
            if key not in self._layouts:
                self._layouts[key] = self._make_layout(message, inner)
            return self._layouts[key]

    def _make_layout(self, message: MessageType, inner: Mapping[str, _Layout]) -> _Layout:
        name = f"type{len(self._layouts)}"
        fields = message.fields or (NOTHING,)
        n_fields = {name: sum(map(_count_code, fields))}
        for each in inner.values():
            n_fields |= each.n_fields
        least_bytes = sum(_least_bytes(field, inner) for field in fields)
        if sum(n_fields.values()) > MOST_FIELDS or least_bytes > MOST_BYTES:
            raise LinkError(
                f"{message.name[:80]} is too large a type: more than {MOST_FIELDS} fields or "
                f"{MOST_BYTES} bytes.",
                hint="Take rosbridge for it.",
            )
        described = [
            (
                _numbered(number),
                describe_field(
                    field, inner[field.type].name if field.is_message else _kind_of(field)
                ),
            )
            for number, field in enumerate(fields)
        ]
        self.fielddefs[name] = ([], described)
        self.types[name] = self._factory(message.fields)
        return _Layout(
            name=name,
            fields=message.fields,
            inner=inner,
            least_bytes=least_bytes,
            n_fields=n_fields,
        )

    def _factory(self, fields: tuple[Field, ...]) -> Any:  # noqa: ANN401 - stands for a class
        names = [field.name for field in fields]
        conversions = [(field.name, _conversion(field)) for field in fields]
        converted = [(name, convert) for name, convert in conversions if convert is not None]

        def make(*values: Any) -> dict[str, Any]:  # noqa: ANN401 - ROS JSON
            self._n_messages_left -= 1
            if self._n_messages_left < 0:
                raise SerdeError(f"more than {MOST_MESSAGES} messages")
            message = dict(zip(names, values, strict=False))
            for name, convert in converted:
                message[name] = convert(message[name])
            return message

        return make


def _numbered(number: int) -> str:
    return f"field{number}"


def _kind_of(field: Field) -> str:
    return "uint8" if field.type in ("byte", "char") else field.type


def _is_array(field: Field) -> bool:
    return field.length is not None and field.type in DTYPES


def _conversion(field: Field) -> Callable[[NDArray[Any]], Any] | None:
    if not _is_array(field) or field.type not in ("bool", "byte", "char", "uint8"):
        return None
    return np.ndarray.tolist if field.type == "bool" else np.ndarray.tobytes


def _count_code(field: Field) -> int:
    """Return for how many fields rosbags writes code: a fixed array is spelled out."""
    return 1 if _is_array(field) else field.length or 1


def _least_bytes(field: Field, inner: Mapping[str, _Layout]) -> int:
    if field.length == 0:
        return COUNT_BYTES
    if field.is_message:
        one = inner[field.type].least_bytes
    else:
        one = DTYPES[field.type].itemsize if field.type in DTYPES else TEXT_BYTES
    return one * (field.length or 1)


def _as_array(field: Field, value: Any) -> NDArray[Any]:  # noqa: ANN401 - ROS JSON
    dtype = DTYPES[field.type]
    if isinstance(value, str):
        value = base64.b64decode(value, validate=True)
    if isinstance(value, bytes | bytearray | memoryview):
        return np.frombuffer(value, dtype=dtype)
    if field.type == "byte":
        value = np.asarray(value, dtype=np.int16)
    if isinstance(value, np.ndarray):
        return np.ascontiguousarray(value.astype(dtype, copy=False))
    return np.array(value, dtype=dtype)
