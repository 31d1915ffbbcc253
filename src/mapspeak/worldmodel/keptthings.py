"""The things of a large memory, kept beside it, so that a later session need not join its views.

The file is a pickle with its arrays behind it, which are mapped into memory and read when needed.
It only stands for what `find_things` found earlier, which compares every record and the map with
the present ones. Reading the file makes plain values of mapspeak and arrays; it calls nothing else.
"""

import contextlib
import gc
import hashlib
import io
import mmap
import os
import pickle
import struct
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import is_dataclass
from enum import Enum
from functools import cache
from pathlib import Path

import numpy as np

import mapspeak
from mapspeak.memory.things.finding import Things

_HEAD = struct.Struct("<16sIQQ")
"""A digest of the code; checksum and length of the pickle; the number of arrays behind it."""
_FOREIGN = {
    ("_codecs", "encode"),
    ("datetime", "datetime"),
    ("datetime", "timedelta"),
    ("datetime", "timezone"),
    ("numpy", "dtype"),
    ("numpy", "ndarray"),
    ("numpy._core.multiarray", "scalar"),
    ("numpy._core.numeric", "_frombuffer"),
}
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


def keep_things(path: Path, found: Things) -> None:
    """Write things to a file, which is replaced as a whole; a failure costs only time."""
    arrays: list[pickle.PickleBuffer] = []
    told = pickle.dumps(found, protocol=5, buffer_callback=arrays.append)
    raw = [each.raw() for each in arrays]
    sizes = np.array([each.nbytes for each in raw], dtype=np.int64).tobytes()
    unfinished = path.with_name(f"{path.name}.{os.getpid()}.tmp")
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            with unfinished.open("wb") as file:
                file.write(_HEAD.pack(_digest_code(), zlib.crc32(told), len(told), len(raw)))
                file.writelines((sizes, told, *raw))
                file.flush()
                os.fsync(file.fileno())
            unfinished.replace(path)
        finally:
            unfinished.unlink(missing_ok=True)


def load_things(path: Path) -> Things | None:
    """Return the things of a file; None if it is missing, broken or written by other code."""
    try:
        with path.open("rb") as file:
            content = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
        code, checksum, n_bytes, n_arrays = _HEAD.unpack_from(content)
        begin = _HEAD.size + 8 * n_arrays
        sizes = np.frombuffer(content[_HEAD.size : begin], dtype=np.int64)
        told = content[begin : begin + n_bytes]
        if code != _digest_code() or zlib.crc32(told) != checksum:
            return None
        ends = begin + n_bytes + np.cumsum(sizes)
        if ends[-1] != len(content):
            return None
        spans = zip((ends - sizes).tolist(), ends.tolist(), strict=True)
        with _without_collection():
            found = PlainReader(told, (content[start:end] for start, end in spans)).load()
    except _UNREADABLE:
        return None
    return found if isinstance(found, Things) else None


@contextlib.contextmanager
def _without_collection() -> Iterator[None]:
    """Pause the garbage collector, which would go through many new values again and again."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


class PlainReader(pickle.Unpickler):
    """Reads values of mapspeak, times and arrays; refuses every other name."""

    def __init__(self, told: memoryview, arrays: Iterable[memoryview]) -> None:
        super().__init__(io.BytesIO(told), buffers=arrays)

    def find_class(self, module: str, name: str) -> object:
        """Return the class of a name; raise UnpicklingError where it is no plain value."""
        is_ours = module.partition(".")[0] == mapspeak.__name__
        if not is_ours and (module, name) not in _FOREIGN:
            raise pickle.UnpicklingError(name)
        found: object = super().find_class(module, name)
        if is_ours and not (
            isinstance(found, type) and (is_dataclass(found) or issubclass(found, Enum))
        ):
            raise pickle.UnpicklingError(name)
        return found


@cache
def _digest_code() -> bytes:
    """Return a digest of what makes things: our modules and words, and the version of NumPy."""
    root, digest = Path(mapspeak.__file__).parent, hashlib.blake2b(digest_size=16)
    digest.update(f"{mapspeak.__version__} {np.__version__}".encode())
    files = (each for part in ("memory", "spatial") for each in (root / part).rglob("*.*"))
    for file in sorted(each for each in files if each.suffix in (".py", ".txt", ".yaml")):
        digest.update(file.read_bytes())
    return digest.digest()
