"""The folder of pictures: each a file whose name says when it was taken."""

import contextlib
import hashlib
import os
import re
import sys
from collections.abc import Collection
from datetime import UTC, datetime
from pathlib import Path

from mapspeak.errors import SemanticMapError

__all__ = ["PictureFolder", "picture_name", "sync_folder"]

_SUFFIXES = {b"\xff\xd8\xff": "jpg", b"\x89PNG\r\n\x1a\n": "png"}
_OURS = re.compile(r"\d{8}T\d{6}Z-[0-9a-f]{12}\.(?:jpg|png)(?:\.tmp)?")


def picture_name(content: bytes, taken_at: datetime) -> str:
    """Gives the name for a picture, such as 20261122T091205Z-3fa9c1d2e4b5.jpg.

    Raises:
        SemanticMapError: It is neither JPEG nor PNG.
    """
    suffix = next((s for start, s in _SUFFIXES.items() if content.startswith(start)), None)
    if suffix is None:
        message = "The picture is neither JPEG nor PNG."
        raise SemanticMapError(message, hint="Encode it as one of them.")
    digest = hashlib.blake2b(content, digest_size=6).hexdigest()
    return f"{taken_at.astimezone(UTC):%Y%m%dT%H%M%SZ}-{digest}.{suffix}"


class PictureFolder:
    """The files of the pictures; whoever changes them holds the writers' lock of the database."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def find(self, name: str | None) -> Path | None:
        """Gives the file of a picture; None where there is none, or it is none of this folder."""
        if not name or Path(name).name != name:
            return None
        path = self.path / name
        return path if path.is_file() else None

    def put(self, name: str, content: bytes) -> None:
        """Writes a picture; it is on the disk when this returns."""
        target = self.path / name
        if target.exists() and target.stat().st_size == len(content):
            return
        self.path.mkdir(parents=True, exist_ok=True)
        temporary = target.with_name(f"{name}.tmp")
        with temporary.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(target)
        sync_folder(self.path)

    def remove_all_but(self, kept: Collection[str]) -> int:
        """Removes the pictures of ours that nobody names, and gives how many."""
        if not self.path.is_dir():
            return 0
        unknown = [
            entry.name
            for entry in os.scandir(self.path)
            if entry.name not in kept and _OURS.fullmatch(entry.name)
        ]
        for name in unknown:
            (self.path / name).unlink(missing_ok=True)
        return len(unknown)


def sync_folder(folder: Path) -> None:
    """Makes the new name of a file last, where the system can."""
    if sys.platform == "win32":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        with contextlib.suppress(OSError):
            os.fsync(descriptor)
    finally:
        os.close(descriptor)
