"""Keys to command from the page: only the server's own terminal shows them."""

import hashlib
import secrets
from collections.abc import Callable

import anyio

from mapspeak.memory.quoting import clean_line

LETTERS = "23456789abcdefghjkmnpqrstuvwxyz"
"""None that is taken for another."""
N_LETTERS = 12
"""About 59 bits: too many to guess, so that wrong tokens need lock nobody out."""
WRONG_S = 1.0
"""How long the answer to a wrong token takes."""
NOBODY = "a person"
MOST_NAME = 40


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
        typed = token.strip().lower().replace("-", "")
        if not secrets.compare_digest(typed.encode(), self._token.encode()):
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
