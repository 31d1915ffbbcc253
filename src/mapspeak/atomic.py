"""Files that are replaced as a whole, and logs: a full disk or a crash leaves no half of one.

Of a log it leaves at most half a line, the last one.
"""

import contextlib
import errno
import fcntl
import glob
import os
import stat
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

_FOLDER_CANNOT_SYNC = (errno.EINVAL, errno.ENOTSUP)


@contextlib.contextmanager
def replacing(path: Path, *, ending: str = "") -> Iterator[BinaryIO]:
    """Let a new file be written; at the end of the block it takes a file's place, on the disk.

    It keeps the permissions of the old file and, as far as we may, its owner; a symbolic link is
    followed, and a missing folder made. A block that raises, or closes the new file, leaves the
    old one and nothing else. What earlier writers have left that were killed goes.

    Args:
        ending: Of the unfinished file's name, from a caller that keeps other writers away.

    Raises:
        OSError: It cannot be written.
    """
    target = Path(os.path.realpath(path))
    target.parent.mkdir(parents=True, exist_ok=True)
    unfinished = target.with_name(f".{target.name}.{ending or os.getpid()}")
    unfinished.unlink(missing_ok=True)
    if not ending:
        _remove_left(target)
    try:
        with _open_locked(unfinished) as file:
            with contextlib.suppress(FileNotFoundError):
                _take_after(target.stat(), unfinished)
            yield file
            if file.closed:
                return
            file.flush()
            # Else a machine that loses power may keep the name and lose the content.
            os.fsync(file.fileno())
        unfinished.replace(target)
    finally:
        unfinished.unlink(missing_ok=True)
    sync_folder(target.parent)


def replace_file(path: Path, content: bytes, *, ending: str = "") -> None:
    """Put a new content in a file's place; see `replacing`."""
    with replacing(path, ending=ending) as file:
        file.write(content)


def _open_locked(unfinished: Path) -> BinaryIO:
    """Return a new file that is locked while its writer lives and writes it."""
    while True:
        file = unfinished.open("xb")
        fcntl.flock(file, fcntl.LOCK_EX)
        if os.fstat(file.fileno()).st_nlink:
            return file
        # Another writer took it for one that was left before it was locked.
        file.close()


def _remove_left(target: Path) -> None:
    """Remove unfinished files that no writer holds; of another machine no process id tells that."""
    for left in target.parent.glob(f".{glob.escape(target.name)}.[0-9]*"):
        with contextlib.suppress(OSError), left.open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            left.unlink()


def _take_after(status: os.stat_result, new: Path) -> None:
    if sys.platform != "win32":
        with contextlib.suppress(PermissionError):
            os.chown(new, status.st_uid, status.st_gid)
    new.chmod(stat.S_IMODE(status.st_mode))


def append_line(path: Path, line: bytes, *, most_bytes: int) -> None:
    """Append a line to a log, opened anew, so that a file that was moved is noticed.

    Half a line that a crash has left is ended first; a missing folder is made.

    Args:
        most_bytes: A file that has grown larger is renamed to "NAME.1", in place of the one before.

    Raises:
        OSError: It cannot be written, or not as a whole.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o600)
    try:
        if os.pread(descriptor, 1, max(os.fstat(descriptor).st_size - 1, 0)) not in (b"\n", b""):
            line = b"\n" + line
        if os.write(descriptor, line + b"\n") != len(line) + 1:
            raise OSError(errno.ENOSPC, "there is no room")
        if os.fstat(descriptor).st_size > most_bytes:
            # Of several servers one renames the file; the others find that it is another by then.
            fcntl.flock(descriptor, fcntl.LOCK_EX)
            with contextlib.suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(descriptor), path.stat()):
                    path.replace(f"{path}.1")
    finally:
        os.close(descriptor)


def sync_folder(folder: Path) -> None:
    """Make the new name of a file durable, if the system supports it."""
    if sys.platform == "win32":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in _FOLDER_CANNOT_SYNC:
            raise
    finally:
        os.close(descriptor)
