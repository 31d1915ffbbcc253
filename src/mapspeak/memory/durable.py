"""A file that is replaced atomically, and is on the disk when a write returns.

A crash at any moment leaves either the old file or the new one.
"""

import contextlib
import errno
import os
import stat
from collections.abc import Iterator
from pathlib import Path

from filelock import FileLock, Timeout

from mapspeak.atomic import replacing
from mapspeak.errors import SemanticMapError

MAX_BYTES = 20_000_000
"""A larger file is taken for something else than a semantic map."""

_POLL_S = 0.005


Fingerprint = tuple[int, int, int, int, int]
"""Distinguishes states of a file without reading it.

The last item is the time of change (ctime): unlike that of modification, no program can set it
back, so `cp -p` and `touch -r` are noticed.
"""


class DurableFile:
    """A file that several processes read and replace; all faults are `SemanticMapError`s.

    Args:
        path: Where it is; a symbolic link is followed. It need not exist yet.
    """

    def __init__(self, path: Path, *, lock_timeout_s: float) -> None:
        self.path = path
        self._lock_timeout_s = lock_timeout_s

    def fingerprint(self) -> Fingerprint | None:
        """Return the file's present state; None without a file."""
        with self._explained("look at"):
            status = self._status()
            return None if status is None else _fingerprint_of(status)

    def read(self) -> tuple[bytes, Fingerprint | None]:
        """Return the content and its state; empty and None without a file."""
        with self._explained("read"):
            status = self._status()
            if status is None:
                return b"", None
            self._require_ordinary(status)
            with self.path.open("rb") as file:
                # Taken before reading: a change meanwhile shows as another fingerprint later.
                fingerprint = _fingerprint_of(os.fstat(file.fileno()))
                return file.read(MAX_BYTES + 1), fingerprint

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Keep other writers that use this class away for the time of a `with` block."""
        target = self._target()
        lock_path = target.with_name(f".{target.name}.lock")
        with self._explained("lock"):
            target.parent.mkdir(parents=True, exist_ok=True)
            lock = FileLock(lock_path)
            try:
                lock.acquire(timeout=self._lock_timeout_s, poll_interval=_POLL_S)
            except Timeout as error:
                message = f"Another program has held {lock_path} for {self._lock_timeout_s:g} s."
                hint = "Write again; if it stays so, end the other program that writes this map."
                raise SemanticMapError(message, hint=hint) from error
        try:
            yield
        finally:
            lock.release()

    def replace(self, content: bytes, *, expected: Fingerprint | None) -> Fingerprint | None:
        """Put a new content in place, for a caller that holds the lock.

        Returns:
            The new state; None, with nothing done, if the file is not in the expected state.
        """
        target = self._target()
        self._require_small(len(content))
        with self._explained("write"):
            status = self._status()
            if status is not None and not os.access(target, os.W_OK):
                raise PermissionError(errno.EACCES, "the file is read-only")
            with replacing(target, ending="tmp") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
                after = _fingerprint_of(os.fstat(file.fileno()))
                if self.fingerprint() != expected:
                    file.close()
                    return None
            renamed = self.fingerprint()
            # A new name counts as a change; or another file is there already.
            return renamed if renamed and renamed[:-1] == after[:-1] else after

    def _target(self) -> Path:
        with self._explained("find"):
            return Path(os.path.realpath(self.path))

    def _status(self) -> os.stat_result | None:
        try:
            return self.path.stat()
        except FileNotFoundError:
            return None

    def _require_ordinary(self, status: os.stat_result) -> None:
        if not stat.S_ISREG(status.st_mode):
            kind = "a folder" if stat.S_ISDIR(status.st_mode) else "no ordinary file"
            hint = "Name a YAML file, such as semantic_map.yaml in that folder."
            raise SemanticMapError(f"{self.path} is {kind}.", hint=hint)
        self._require_small(status.st_size)

    def _require_small(self, n_bytes: int) -> None:
        if n_bytes > MAX_BYTES:
            message = f"{self.path} has {n_bytes / 1e6:.1f} MB; at most {MAX_BYTES / 1e6:.0f} MB."
            raise SemanticMapError(message, hint="Split the map, or remove waypoints from it.")

    @contextlib.contextmanager
    def _explained(self, verb: str) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            reason = error.strerror or str(error)
            message = f"Cannot {verb} {self.path}: {reason}."
            hint = (
                "Check that the file and its folder exist, may be written to, and have room; "
                "in a container, mount the folder, not the file alone."
            )
            raise SemanticMapError(message, hint=hint) from error


def _fingerprint_of(status: os.stat_result) -> Fingerprint:
    times = status.st_mtime_ns, status.st_ctime_ns
    return (status.st_dev, status.st_ino, status.st_size, *times)
