"""Who may command from the page: who has read the server's own terminal."""

import secrets
from collections.abc import Callable

MOST_TRIES = 20
"""Wrong tokens, after which none is taken any more until the server is started anew."""


class PageKeys:
    """A one-time token, printed on the server's terminal, and the keys that were given for it.

    A model that has a shell on the machine can ask the page for anything that needs no key.

    Args:
        tell: Shows a token to whoever has the terminal.
    """

    def __init__(self, tell: Callable[[str], None]) -> None:
        self._tell = tell
        self._keys: set[str] = set()
        self._n_wrong = 0
        self._renew()

    def unlock(self, token: str) -> str | None:
        """Return a key for the token, which is used up then; None for a wrong one."""
        if self._n_wrong >= MOST_TRIES or not _is_same(token.strip(), self._token):
            self._n_wrong += 1
            return None
        key = secrets.token_urlsafe(24)
        self._keys.add(key)
        self._renew()
        return key

    def is_known(self, key: str) -> bool:
        """Return True for a key that was given."""
        return any(_is_same(key, known) for known in self._keys)

    def _renew(self) -> None:
        self._token = f"{secrets.randbelow(10**8):08d}"
        self._tell(self._token)


def _is_same(given: str, known: str) -> bool:
    return secrets.compare_digest(given.encode(), known.encode())
