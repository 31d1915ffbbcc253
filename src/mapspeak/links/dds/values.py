"""The values that fields hold: what fits, and what is refused before the robot gets it."""

import base64
import binascii
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapspeak.errors import LinkError

HINT = "Look the type up, and give the field what it holds."


def misfit(name: str, value: object, wanted: str) -> LinkError:
    """Gives the error for a value that a field cannot hold."""
    is_short = isinstance(value, int | float | str | None)
    shown = repr(value)[:60] if is_short else f"a {type(value).__name__}"
    return LinkError(f"The field {name!r} is to hold {wanted}, not {shown}.", hint=HINT)


@dataclass(frozen=True, slots=True)
class Primitive:
    """A kind of number.

    Attributes:
        code: As the module `struct` names it.
        dtype: As numpy names it.
        size: In bytes.
    """

    code: str
    dtype: str
    size: int

    @property
    def dtype_code(self) -> str:
        """As numpy names it behind a byte order."""
        return np.dtype(self.dtype).str[1:]

    def packing(self, order: str) -> struct.Struct:
        """Gives what reads and writes one such number; "<" is the least byte first."""
        return struct.Struct(f"{order}{self.code}")

    def checked(self, value: Any, name: str) -> int | float | bool:  # noqa: ANN401 - ROS JSON
        """Gives a value that fits.

        Raises:
            LinkError: It is of another kind, too large, or not finite.
        """
        if self.dtype == "bool":
            if not isinstance(value, bool | np.bool_) and value not in (0, 1):
                raise misfit(name, value, "true or false")
            return bool(value)
        if isinstance(value, bool | np.bool_) or not isinstance(value, self._kinds):
            raise misfit(name, value, f"a number ({self.dtype})")
        number: Any = value
        self._check_range(np.asarray(number), number, name)
        return float(number) if self._is_float else int(number)

    def _check_range(self, numbers: NDArray[Any], value: object, name: str) -> None:
        if numbers.size == 0:
            return
        low, high = numbers.min(), numbers.max()
        if not self._is_float:
            bounds = np.iinfo(self.dtype)
            if not bounds.min <= int(low) <= int(high) <= bounds.max:
                raise misfit(name, value, f"whole numbers from {bounds.min} to {bounds.max}")
            return
        limit = float(np.finfo(self.dtype).max)
        # Neither NaN nor infinity is within the limits.
        if not -limit <= low <= high <= limit:
            raise misfit(name, value, f"finite numbers ({self.dtype})")

    @property
    def _is_float(self) -> bool:
        return self.dtype.startswith("float")

    @property
    def _kinds(self) -> tuple[type, ...]:
        whole = (int, np.integer)
        return (*whole, float, np.floating) if self._is_float else whole

    def array(self, value: Any, name: str) -> NDArray[Any]:  # noqa: ANN401 - ROS JSON
        """Gives many values, the least byte first.

        Raises:
            LinkError: They are of another kind, too large, or not finite.
        """
        if self.dtype == "bool":
            return np.array([self.checked(each, name) for each in value], dtype=np.bool_)
        if not isinstance(value, np.ndarray):
            if not all(isinstance(each, self._kinds) and each is not True for each in value):
                raise misfit(name, value, f"a list of numbers ({self.dtype})")
            try:
                value = np.array(value, dtype=np.float64 if self._is_float else None)
            except (OverflowError, ValueError) as error:
                raise misfit(name, value, f"a list of numbers ({self.dtype})") from error
        if value.size and (value.ndim != 1 or value.dtype.kind not in self._array_kinds):
            raise misfit(name, value, f"a list of numbers ({self.dtype})")
        self._check_range(value, value, name)
        checked: NDArray[Any] = value.astype(np.dtype(self.dtype).newbyteorder("<"))
        return checked

    @property
    def _array_kinds(self) -> str:
        return "iuf" if self._is_float else "iu"


PRIMITIVES = {
    "bool": Primitive("?", "bool", 1),
    "byte": Primitive("B", "uint8", 1),
    "char": Primitive("B", "uint8", 1),
    "int8": Primitive("b", "int8", 1),
    "uint8": Primitive("B", "uint8", 1),
    "int16": Primitive("h", "int16", 2),
    "uint16": Primitive("H", "uint16", 2),
    "int32": Primitive("i", "int32", 4),
    "uint32": Primitive("I", "uint32", 4),
    "int64": Primitive("q", "int64", 8),
    "uint64": Primitive("Q", "uint64", 8),
    "float32": Primitive("f", "float32", 4),
    "float64": Primitive("d", "float64", 8),
}


def as_text(value: Any, name: str) -> bytes:  # noqa: ANN401 - ROS JSON
    """Gives a text as UTF-8.

    Raises:
        LinkError: It is none, or none that can be sent.
    """
    if not isinstance(value, str) or "\x00" in value:
        raise misfit(name, value, "a text")
    try:
        return value.encode()
    except UnicodeEncodeError as error:
        raise misfit(name, value, "a text in Unicode") from error


def as_array(value: Any, name: str, kind: Primitive) -> NDArray[Any]:  # noqa: ANN401 - ROS JSON
    """Gives the values of an array; uint8 also from bytes and, as in JSON, from base64.

    Raises:
        LinkError: They do not fit.
    """
    if kind.dtype == "uint8" and isinstance(value, str):
        try:
            value = base64.b64decode(value, validate=True)
        except (binascii.Error, ValueError) as error:
            raise misfit(name, value, "bytes in base64") from error
    if isinstance(value, bytes | bytearray | memoryview) and kind.size == 1:
        return np.frombuffer(value, dtype=kind.dtype)
    if not isinstance(value, list | tuple | np.ndarray):
        raise misfit(name, value, "a list")
    return kind.array(value, name)
