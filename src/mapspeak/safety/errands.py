"""Errands: several drives that one tool call wants, for which a person is asked once."""

from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Errand:
    """What a call of a tool wants to drive for, and no farther than what.

    Attributes:
        what: In words, as in "may the robot explore".
        n_drives: At most so many.
        duration_s: Within so much robot time from the first one on.
    """

    what: str
    n_drives: int
    duration_s: float

    @property
    def said(self) -> str:
        """The errand with its bounds, in words."""
        drives = "one drive" if self.n_drives == 1 else f"up to {self.n_drives} drives"
        return f"{self.what}, {drives} within {self.duration_s:g} s"


# State of a task, not of the module: what the present call is for.
_ERRAND: ContextVar[Errand | None] = ContextVar("errand", default=None)


def current_errand() -> Errand | None:
    """Gives the errand that drives are for now; None where each is for itself."""
    return _ERRAND.get()


@contextmanager
def on_errand(errand: Errand) -> Generator[None]:
    """Marks the drives that are begun in the `with` block as parts of an errand."""
    token = _ERRAND.set(errand)
    try:
        yield
    finally:
        _ERRAND.reset(token)


@dataclass(slots=True)
class _Approved:
    """An errand that a person has agreed to, as far as it is used up."""

    wish_id: str
    begun_s: float
    n_left: int


class Errands:
    """The errands that a person has agreed to, of all clients."""

    def __init__(self) -> None:
        self._approved: dict[tuple[str, Errand], _Approved] = {}

    def begin(self, errand: Errand, *, client: str, wish_id: str, robot_s: float) -> None:
        """Notes that a person has agreed; the first drive is yet to be taken."""
        self._approved[client, errand] = _Approved(wish_id, robot_s, errand.n_drives)

    def take_drive(self, errand: Errand, *, client: str, robot_s: float) -> str | None:
        """Uses up one drive and gives the id of the word that covers it; None where none does."""
        approved = self._approved.get((client, errand))
        if approved is None:
            return None
        is_in_time = 0 <= robot_s - approved.begun_s < errand.duration_s
        if not is_in_time or approved.n_left < 1:
            del self._approved[client, errand]
            return None
        approved.n_left -= 1
        return approved.wish_id

    def end_all(self) -> None:
        """Forgets them: after a stop a person is asked again."""
        self._approved.clear()
