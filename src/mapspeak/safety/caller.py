"""Who is calling, told to the guard without every function in between handing it on."""

from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Caller:
    """Whose call is being carried out.

    Attributes:
        client: The client's session; empty where mapspeak acts by itself.
        tool: The tool it called.
    """

    client: str = ""
    tool: str = ""


NOBODY = Caller()

# State of a task, not of the module: each call sees its own, also in the threads it starts.
_CALLER: ContextVar[Caller] = ContextVar("caller", default=NOBODY)


def current_caller() -> Caller:
    """Gives whose call this is; nobody's where mapspeak acts by itself."""
    return _CALLER.get()


@contextmanager
def calling(caller: Caller) -> Generator[None]:
    """Marks what is done in the `with` block as done for a caller."""
    token = _CALLER.set(caller)
    try:
        yield
    finally:
        _CALLER.reset(token)
