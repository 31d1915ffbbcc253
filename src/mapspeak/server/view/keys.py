"""Keys to command from the page, for a token of the server's own terminal or on a person's request.

A request is a file in the control folder. The person's command makes the key and leaves only its
digest, so that no file and no log holds a usable key. Each server that sees the request answers
with its page's address.
"""

import hashlib
import os
import secrets
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import anyio

from mapspeak.atomic import replace_file
from mapspeak.memory.quoting import clean_line

LETTERS = "23456789abcdefghjkmnpqrstuvwxyz"
"""None that is taken for another."""
N_LETTERS = 12
"""About 59 bits: too many to guess, so that wrong tokens need lock nobody out."""
WRONG_S = 1.0
"""How long the answer to a wrong token takes."""
NOBODY = "a person"
MOST_NAME = 40
FOLDER, REQUEST, ANSWER = "view", ".key", ".url"


class PageKeys:
    """A one-time token, printed on the server's terminal, and the keys that were given for it.

    A model that has a shell on the machine can ask the page for anything that needs no key.

    Args:
        tell: Shows a token on the terminal.
        wrong_s: How long the answer to a wrong token takes.
    """

    def __init__(self, tell: Callable[[str], None], *, wrong_s: float = WRONG_S) -> None:
        self._tell = tell
        self._wrong_s = wrong_s
        self._names: dict[str, str] = {}
        self._renew()

    async def unlock(self, token: str, name: str = "") -> str | None:
        """Return a key for the token, which is used up then; None for a wrong one."""
        # Half a letter of UTF-16, which JSON can carry, is in no token.
        typed = token.strip().lower().replace("-", "").encode(errors="replace")
        if not secrets.compare_digest(typed, self._token.encode()):
            await anyio.sleep(self._wrong_s)
            return None
        key = secrets.token_urlsafe(24)
        self.admit(digest(key), name)
        self._renew()
        return key

    def admit(self, key_digest: str, name: str = "") -> None:
        """Take a key from a trusted maker, by its digest."""
        self._names[key_digest] = clean_line(name).strip()[:MOST_NAME] or NOBODY

    def find_name(self, key: str) -> str | None:
        """Return the name of a key's owner; None for an unknown key."""
        return self._names.get(digest(key))

    def _renew(self) -> None:
        self._token = "".join(secrets.choice(LETTERS) for _ in range(N_LETTERS))
        parts = (self._token[at : at + 4] for at in range(0, N_LETTERS, 4))
        self._tell("-".join(parts))


def digest(key: str) -> str:
    """Return the digest of a key; a lookup by it leaks nothing of the key by its timing."""
    return hashlib.sha256(key.encode()).hexdigest()


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
            replace_file(told, f"{url}\n{robots}\n".encode())


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
        replace_file(file, f"{digest(key)}\n{person}\n".encode())
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
