"""Messages as bytes: the encoding CDR of DDS, read and written after the fields of a type.

ROS 2 uses its first version (PLAIN_CDR of the OMG's DDS-XTYPES, chapter 7.4.1): each number at a
multiple of its size, counted from behind four bytes that tell the byte order.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mapspeak.errors import LinkError
from mapspeak.links.dds.values import PRIMITIVES, Primitive, as_array, as_text, misfit
from mapspeak.ros.definitions import Field, TypeBook
from mapspeak.ros.messages import Message, bare_type

HEADER_BYTES = 4
LITTLE_ENDIAN = b"\x00\x01\x00\x00"
BIG_ENDIAN_MARK = 0
PLACEHOLDER = Field(name="structure_needs_at_least_one_member", type="uint8")
"""What ROS 2 puts in a message without fields."""

Read = Callable[[memoryview, int], tuple[Any, int]]
"""Takes the bytes behind the header and a position; gives the value and the position behind it."""
Write = Callable[[bytearray, Any, str], None]
"""Takes the bytes so far, a value, and the name of its field."""


class Codec:
    """Reads and writes the messages of all types that it is told of.

    Args:
        book: Describes the types.
    """

    def __init__(self, book: TypeBook) -> None:
        self._book = book
        self._readers: dict[tuple[str, str], Read] = {}
        self._writers: dict[str, Write] = {}

    def decode(self, type_name: str, data: bytes, *, skip: int = 0) -> dict[str, Any]:
        """Gives a message; arrays of numbers are numpy arrays upon these bytes, uint8[] is bytes.

        Args:
            type_name: Such as "nav_msgs/OccupancyGrid".
            data: With its header of four bytes.
            skip: So many bytes before the message are something else; a multiple of eight.

        Raises:
            LinkError: These bytes are no such message, or nobody knows the type.
        """
        if len(data) < HEADER_BYTES or data[0] != 0 or data[1] not in (0, 1):
            raise LinkError(
                f"A {type_name} is written in a way that we cannot read.",
                hint="It is no plain CDR: look which middleware the robot uses.",
            )
        order = ">" if data[1] == BIG_ENDIAN_MARK else "<"
        try:
            message, end = self._reader(bare_type(type_name), order)(
                memoryview(data)[HEADER_BYTES:], skip
            )
        except (ValueError, IndexError, UnicodeDecodeError) as error:
            raise _no_such_message(type_name) from error
        # Less than a whole word may follow, as padding.
        if not 0 <= len(data) - HEADER_BYTES - end < HEADER_BYTES:
            raise _no_such_message(type_name)
        decoded: dict[str, Any] = message
        return decoded

    def encode(self, type_name: str, message: Message) -> bytes:
        """Gives the bytes of a message with their header; fields left out are zero or empty.

        Raises:
            LinkError: A field does not exist, does not hold what it should, or is not finite.
        """
        out = bytearray()
        self._writer(bare_type(type_name))(out, message, "")
        return LITTLE_ENDIAN + bytes(out)

    def _fields_of(self, type_name: str) -> tuple[Field, ...]:
        if not self._book.knows(type_name):
            raise LinkError(
                f"We do not know what a {type_name} looks like.",
                hint="Robots of ROS 2 Jazzy and later tell it; for older ones take rosbridge, "
                "or give its definition where a tool asks for one.",
            )
        return self._book[type_name].fields or (PLACEHOLDER,)

    # --- reading

    def _reader(self, type_name: str, order: str) -> Read:
        known = self._readers.get((type_name, order))
        if known is None:
            known = self._build_reader(type_name, order)
            self._readers[type_name, order] = known
        return known

    def _build_reader(self, type_name: str, order: str) -> Read:
        fields = self._fields_of(type_name)
        parts = [(field.name, self._field_reader(field, order)) for field in fields]
        is_empty = fields == (PLACEHOLDER,)

        def read(data: memoryview, position: int) -> tuple[dict[str, Any], int]:
            message = {}
            for name, read_part in parts:
                message[name], position = read_part(data, position)
            return ({} if is_empty else message), position

        return read

    def _field_reader(self, field: Field, order: str) -> Read:
        if field.length is not None and field.type in PRIMITIVES:
            return _array_reader(PRIMITIVES[field.type], field, order)
        read = self._value_reader(field.type, order)
        if field.length is None:
            return read
        return _list_reader(read, field, order)

    def _value_reader(self, type_name: str, order: str) -> Read:
        if type_name == "string":
            return _string_reader(order)
        if type_name in PRIMITIVES:
            return _number_reader(PRIMITIVES[type_name], order)
        return self._reader(type_name, order)

    # --- writing

    def _writer(self, type_name: str) -> Write:
        known = self._writers.get(type_name)
        if known is None:
            known = self._writers[type_name] = self._build_writer(type_name)
        return known

    def _build_writer(self, type_name: str) -> Write:
        fields = self._fields_of(type_name)
        parts = [(field.name, self._field_writer(field)) for field in fields]
        names = {field.name for field in fields}
        defaults = {field.name: self._book.default(field) for field in fields}

        def write(out: bytearray, message: Any, name: str) -> None:  # noqa: ANN401 - ROS JSON
            if not isinstance(message, Mapping):
                raise misfit(name or type_name, message, f"a {type_name}")
            for given in message:
                if given not in names:
                    raise LinkError(
                        f"{type_name} has no field {str(given)[:80]!r}.",
                        hint=f"Its fields are: {', '.join(sorted(names))}.",
                    )
            for each, write_part in parts:
                write_part(out, message.get(each, defaults[each]), each)

        return write

    def _field_writer(self, field: Field) -> Write:
        if field.length is not None and field.type in PRIMITIVES:
            return _array_writer(PRIMITIVES[field.type], field)
        write = self._value_writer(field.type)
        return write if field.length is None else _list_writer(write, field)

    def _value_writer(self, type_name: str) -> Write:
        if type_name == "string":
            return _write_string
        if type_name in PRIMITIVES:
            return _number_writer(PRIMITIVES[type_name])
        return self._writer(type_name)


def _no_such_message(type_name: str) -> LinkError:
    return LinkError(
        f"What came is no {type_name}.",
        hint="The robot may use another version of that type than we know.",
    )


def _number_reader(kind: Primitive, order: str) -> Read:
    size, unpack = kind.size, kind.packing(order).unpack_from

    def read(data: memoryview, position: int) -> tuple[Any, int]:
        position = -(-position // size) * size
        if position + size > len(data):
            raise IndexError
        return unpack(data, position)[0], position + size

    return read


def _string_reader(order: str) -> Read:
    read_length = _number_reader(PRIMITIVES["uint32"], order)

    def read(data: memoryview, position: int) -> tuple[str, int]:
        length, position = read_length(data, position)
        end = position + length
        if length == 0 or end > len(data):
            raise IndexError
        return str(data[position : end - 1], "utf-8"), end

    return read


def _array_reader(kind: Primitive, field: Field, order: str) -> Read:
    size, dtype = kind.size, np.dtype(f"{order}{kind.dtype_code}")
    read_length = _length_reader(field, order)

    def read(data: memoryview, position: int) -> tuple[Any, int]:
        length, position = read_length(data, position)
        if length:
            position = -(-position // size) * size
        end = position + length * size
        if end > len(data):
            raise IndexError
        if kind.dtype == "uint8":
            return bytes(data[position:end]), end
        values = np.frombuffer(data[position:end], dtype=dtype)
        return (values.tolist() if kind.dtype == "bool" else values), end

    return read


def _list_reader(read_one: Read, field: Field, order: str) -> Read:
    read_length = _length_reader(field, order)

    def read(data: memoryview, position: int) -> tuple[list[Any], int]:
        length, position = read_length(data, position)
        # No value is shorter than a byte: a length from a damaged message costs nothing.
        if length > len(data) - position:
            raise IndexError
        values = []
        for _ in range(length):
            value, position = read_one(data, position)
            values.append(value)
        return values, position

    return read


def _length_reader(field: Field, order: str) -> Read:
    if not field.length:
        return _number_reader(PRIMITIVES["uint32"], order)
    length = field.length
    return lambda _data, position: (length, position)


def _number_writer(kind: Primitive) -> Write:
    size, pack = kind.size, kind.packing("<").pack

    def write(out: bytearray, value: Any, name: str) -> None:  # noqa: ANN401 - ROS JSON
        out += bytes(-len(out) % size) + pack(kind.checked(value, name))

    return write


_write_length = _number_writer(PRIMITIVES["uint32"])


def _write_string(out: bytearray, value: Any, name: str) -> None:  # noqa: ANN401 - ROS JSON
    text = as_text(value, name)
    _write_length(out, len(text) + 1, name)
    out += text + b"\x00"


def _array_writer(kind: Primitive, field: Field) -> Write:
    def write(out: bytearray, value: Any, name: str) -> None:  # noqa: ANN401 - ROS JSON
        values = as_array(value, name, kind)
        _write_count(out, len(values), field)
        if len(values):
            out += bytes(-len(out) % kind.size) + values.tobytes()

    return write


def _list_writer(write_one: Write, field: Field) -> Write:
    def write(out: bytearray, value: Any, name: str) -> None:  # noqa: ANN401 - ROS JSON
        if not isinstance(value, list | tuple):
            raise misfit(name, value, "a list")
        _write_count(out, len(value), field)
        for each in value:
            write_one(out, each, name)

    return write


def _write_count(out: bytearray, n_values: int, field: Field) -> None:
    if field.length and n_values != field.length:
        raise misfit(field.name, n_values, f"{field.length} values")
    if field.most is not None and n_values > field.most:
        raise misfit(field.name, n_values, f"at most {field.most} values")
    if not field.length:
        _write_length(out, n_values, field.name)
