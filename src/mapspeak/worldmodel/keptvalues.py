"""What a large memory was made into, kept beside it, so that a later session need not make it.

A file is a pickle with its arrays behind it, which are mapped into memory and read when needed:
all of one type and shape in a row, for there may be a hundred thousand, and those that are read
together are of one shape. It only stands for what was made earlier: what it holds is compared with
the present records and map. Reading it makes plain values of mapspeak and arrays, and the indexes
named here; it calls nothing.
"""

import contextlib
import gc
import hashlib
import io
import json
import math
import mmap
import pickle
import struct
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache, partial
from itertools import chain
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

import mapspeak
from mapspeak.atomic import replacing
from mapspeak.memory.search.meaningindex import TextVectors

_HEAD = struct.Struct("<16sIQQ")
"""A digest of the code; checksum of what follows; lengths of the list of types and the pickle."""
_ALIGNED = 64
_FOREIGN = {
    ("_codecs", "encode"),
    ("datetime", "datetime"),
    ("datetime", "timedelta"),
    ("datetime", "timezone"),
    ("numpy", "dtype"),
    ("numpy._core.multiarray", "scalar"),
}
_INDEXES = {
    "index": {"EntryIndex"},
    "kinds": {"KindIndex"},
    "meaningindex": {"MeaningIndex", "_Column"},
    "wordindex": {"LookAlikes", "Numbers", "Vocabulary", "WordIndex"},
}
"""Classes of `mapspeak.memory.search` that are no values, by their module."""
_UNREADABLE = (
    AttributeError,
    EOFError,
    ImportError,
    IndexError,
    KeyError,
    OSError,
    TypeError,
    ValueError,
    pickle.UnpicklingError,
    struct.error,
)
Kept = TypeVar("Kept")


def keep_value(path: Path, value: object) -> None:
    """Write a value to a file, which is replaced as a whole; a failure costs only time."""
    told = io.BytesIO()
    writer = _PlainWriter(told, protocol=5)
    writer.dump(value)
    types = json.dumps([(*kind, len(row)) for kind, row in writer.rows.items()]).encode()
    content = types + told.getbuffer()
    gap = bytes(-(_HEAD.size + len(content)) % _ALIGNED)
    head = _HEAD.pack(_digest_code(), zlib.crc32(content), len(types), len(content) - len(types))
    with contextlib.suppress(OSError), replacing(path) as file:
        file.writelines((head, content, gap))
        file.writelines(each.data for each in chain.from_iterable(writer.rows.values()))


def load_value(path: Path, kind: type[Kept], *, vectors: TextVectors | None = None) -> Kept | None:
    """Return the value of a file; None if it is missing, broken or written by other code.

    Args:
        vectors: What an index compares meanings with; one of another model is not read.
    """
    try:
        with path.open("rb") as file:
            content = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
        code, checksum, n_types, n_told = _HEAD.unpack_from(content)
        begin, end = _HEAD.size + n_types, _HEAD.size + n_types + n_told
        if code != _digest_code() or zlib.crc32(content[_HEAD.size : end]) != checksum:
            return None
        rows, start = [], end + -end % _ALIGNED
        for kind_of_array, shape, n in json.loads(bytes(content[_HEAD.size : begin])):
            n_bytes = n * math.prod(shape) * np.dtype(kind_of_array).itemsize
            row = np.frombuffer(content[start : start + n_bytes], dtype=kind_of_array)
            rows.append(row.reshape(n, *shape))
            start += n_bytes
        if start != len(content):
            return None
        with lasting():
            found = PlainReader(content[begin:end], rows, vectors=vectors).load()
    except _UNREADABLE:
        return None
    return found if isinstance(found, kind) else None


@contextlib.contextmanager
def lasting() -> Iterator[None]:
    """Spare the garbage collector from many values that are made here to stay.

    It would go through all of them again and again meanwhile, and now and then ever after.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        if was_enabled:
            gc.enable()


class _PlainWriter(pickle.Pickler):
    """Writes a value as its class and its fields, and vectors of texts as the model's name.

    Attributes:
        rows: The arrays of each type and shape, which are written behind the pickle.
    """

    def __init__(self, told: io.BytesIO, *, protocol: int) -> None:
        super().__init__(told, protocol=protocol)
        self.rows: dict[tuple[str, tuple[int, ...]], list[NDArray[Any]]] = {}
        self._number_of: dict[tuple[str, tuple[int, ...]], int] = {}

    def reducer_override(self, value: Any) -> Any:  # noqa: ANN401 - as pickle declares it
        """Return how a value is made again."""
        if isinstance(value, np.ndarray):
            kind = value.dtype.str, value.shape
            row = self.rows.setdefault(kind, [])
            row.append(np.ascontiguousarray(value))
            return find_array, (
                self._number_of.setdefault(kind, len(self._number_of)),
                len(row) - 1,
            )
        if isinstance(value, TextVectors):
            return TextVectors, (value.embedder.name,)
        if not isinstance(value, type) and _is_slotted(type(value)):
            return type(value), tuple(getattr(value, each.name) for each in fields(value))
        return NotImplemented


class PlainReader(pickle.Unpickler):
    """Reads values of mapspeak, times, arrays and indexes; refuses every other name."""

    def __init__(
        self,
        told: memoryview,
        rows: Sequence[NDArray[Any]],
        *,
        vectors: TextVectors | None = None,
    ) -> None:
        super().__init__(io.BytesIO(told))
        self._vectors = vectors
        self._find_array = partial(find_array, rows)

    def find_class(self, module: str, name: str) -> object:
        """Return what makes values of a name; raise UnpicklingError where it is no plain value."""
        root, _, rest = module.partition(".")
        if root != mapspeak.__name__:
            if (module, name) not in _FOREIGN:
                raise pickle.UnpicklingError(name)
            return super().find_class(module, name)
        if (module, name) == (TextVectors.__module__, TextVectors.__name__):
            return self._find_vectors
        if (module, name) == (__name__, find_array.__name__):
            return self._find_array
        found: object = super().find_class(module, name)
        is_index = name in _INDEXES.get(rest.removeprefix("memory.search."), ())
        if not isinstance(found, type) or not (
            is_index or is_dataclass(found) or issubclass(found, Enum)
        ):
            raise pickle.UnpicklingError(name)
        return _maker(found) if _is_slotted(found) else found

    def _find_vectors(self, name: str) -> TextVectors:
        if self._vectors is None or self._vectors.embedder.name != name:
            raise pickle.UnpicklingError(name)
        return self._vectors


def find_array(rows: Sequence[NDArray[Any]], row: int, number: int) -> NDArray[Any]:
    """Return one of the arrays that are in rows."""
    found: NDArray[Any] = rows[row][number]
    return found


def _is_slotted(kind: type) -> bool:
    return is_dataclass(kind) and "__slots__" in vars(kind)


def _maker(kind: type) -> Callable[..., object]:
    """Return what makes a value of its fields without checks: several times as fast as pickle."""
    new, setters = object.__new__, [getattr(kind, each.name).__set__ for each in fields(kind)]

    def make(*values: object) -> object:
        made: object = new(kind)
        for put, value in zip(setters, values, strict=True):
            put(made, value)
        return made

    return make


@cache
def _digest_code() -> bytes:
    """Return a digest of what makes things: our modules and words, and the version of NumPy."""
    root, digest = Path(mapspeak.__file__).parent, hashlib.blake2b(digest_size=16)
    digest.update(f"{mapspeak.__version__} {np.__version__}".encode())
    parts = ("memory", "spatial", "worldmodel")
    files = (each for part in parts for each in (root / part).rglob("*.*"))
    for file in sorted(each for each in files if each.suffix in (".py", ".txt", ".yaml")):
        digest.update(file.read_bytes())
    return digest.digest()
