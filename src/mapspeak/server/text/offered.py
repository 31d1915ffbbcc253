"""Sentences that lead to tools: they are said only where those tools are offered."""

import re
from collections.abc import Collection, Generator
from contextlib import contextmanager
from contextvars import ContextVar
from string import Formatter

SENTENCE = re.compile(r"(?<=[.!?]) ")

# State of a call, not of the module. None where nobody has said what is offered: all is.
_OFFERED: ContextVar[frozenset[str] | None] = ContextVar("offered", default=None)


@contextmanager
def offering(names: Collection[str]) -> Generator[None]:
    """Say in the `with` block only what leads to these tools."""
    token = _OFFERED.set(frozenset(names))
    try:
        yield
    finally:
        _OFFERED.reset(token)


def lead(template: str, **details: object) -> str:
    """Fill in a template without the sentences that lead to tools which are not offered.

    Args:
        template: Sentences; a field that is none of the details names a tool.
        details: What else is filled in.
    """
    return " ".join(filter(None, (_fill(each, details) for each in SENTENCE.split(template))))


def _fill(sentence: str, details: dict[str, object]) -> str:
    fields = {name for _, name, _, _ in Formatter().parse(sentence) if name}
    tools = fields - details.keys()
    offered = _OFFERED.get()
    if offered is not None and not tools <= offered:
        return ""
    return sentence.format_map({**{name: name for name in tools}, **details})
