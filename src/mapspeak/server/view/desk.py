"""Requests of a person to running servers for their live page: files in the control folder.

The person's command makes the key and leaves only its digest, so that no file and no log holds a
usable key. Each server that sees the request answers with its page's address.
"""

import os
import secrets
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from mapspeak.server.view.keys import PageKeys, digest

FOLDER, REQUEST, ANSWER = "view", ".key", ".url"


@dataclass(frozen=True, slots=True)
class ViewDesk:
    """A server's side: takes each request once.

    Args:
        control: The folder in which operators and servers meet.
    """

    control: Path
    _taken: set[str] = field(default_factory=set)

    def find_requests(self) -> list[Path]:
        """Return the requests that were not answered yet."""
        with suppress(OSError):
            found = (self.control / FOLDER).glob(f"*{REQUEST}")
            return [path for path in found if path.name not in self._taken]
        return []

    def answer(self, request: Path, keys: PageKeys, *, robots: str, url: str) -> None:
        """Take the key of a request, and tell where the page is."""
        self._taken.add(request.name)
        # Other files may lie there: they are left alone.
        with suppress(OSError, ValueError):
            key_digest, _, name = request.read_text("utf-8").partition("\n")
            keys.admit(key_digest.strip(), name)
            told = request.with_name(f"{request.stem}-{os.getpid()}{ANSWER}")
            told.write_text(f"{url}\n{robots}\n", "utf-8")


@dataclass(frozen=True, slots=True)
class ViewRequest:
    """A person's side: one request, until it is withdrawn.

    Attributes:
        key: Lets its holder command from every page that answers.
    """

    file: Path
    key: str

    @classmethod
    def leave(cls, control: Path, person: str) -> "ViewRequest":
        """Ask all servers of a control folder.

        Raises:
            OSError: Nothing can be written there.
        """
        key = secrets.token_urlsafe(24)
        file = control / FOLDER / f"{os.getpid()}-{secrets.token_hex(4)}{REQUEST}"
        file.parent.mkdir(parents=True, exist_ok=True)
        # Renamed into place: no server sees half of it.
        half = file.with_suffix(".half")
        half.write_text(f"{digest(key)}\n{person}\n", "utf-8")
        half.replace(file)
        return cls(file, key)

    def answers(self) -> Iterator[tuple[str, str]]:
        """Return the address of each page that answered, and whose it is."""
        for path in sorted(self.file.parent.glob(f"{self.file.stem}-*{ANSWER}")):
            url, _, robots = path.read_text("utf-8").partition("\n")
            if robots.endswith("\n"):
                yield url, robots.strip()

    def withdraw(self) -> None:
        """Remove the request and its answers."""
        for path in (self.file, *self.file.parent.glob(f"{self.file.stem}-*{ANSWER}")):
            path.unlink(missing_ok=True)
