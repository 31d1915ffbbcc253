"""HTML that cannot be broken by what stands in it: text becomes markup in one place only."""

import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import NewType

__all__ = ["Html", "element", "joined", "table", "text"]

Html = NewType("Html", str)
"""Markup that was made here; plain text is not accepted where it is asked for."""

VOID = frozenset({"img", "meta", "input", "br"})
INVISIBLE = re.compile(
    "[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u061c\u200b-\u200f\u202a-\u202e\u2060-\u2069\ufeff\ufff0-\uffff]"
    "|[\ud800-\udfff]"
)
"""Control characters, and those that turn the direction of what follows: they are spelled out."""


def text(value: object) -> Html:
    """Return text as markup; what nobody could see in it is spelled out."""
    return Html(escape(INVISIBLE.sub(lambda found: f"<U+{ord(found[0]):04X}>", str(value))))


def joined(parts: Iterable[Html]) -> Html:
    """Return pieces of markup one after the other."""
    return Html("".join(parts))


def element(name: str, attributes: Mapping[str, object], *children: Html) -> Html:
    """Return an element.

    Args:
        name: Of the tag.
        attributes: Their values are escaped; True stands for a bare attribute, None for none.
        children: What stands in it.
    """
    inside = "".join(_attribute(key, value) for key, value in attributes.items())
    if name in VOID:
        return Html(f"<{name}{inside}>")
    return Html(f"<{name}{inside}>{''.join(children)}</{name}>")


def _attribute(key: str, value: object) -> str:
    if value is None:
        return ""
    return f" {key}" if value is True else f' {key}="{text(value)}"'


def table(heading: Sequence[str], rows: Iterable[Sequence[Html]], *, kind: str = "") -> Html:
    """Return a table that scrolls sideways where the screen is narrow; cells come as <td>."""
    head = joined(element("th", {"scope": "col"}, text(cell)) for cell in heading)
    body = joined(element("tr", {}, *row) for row in rows)
    whole = element(
        "table",
        {"class": kind or None},
        element("thead", {}, element("tr", {}, head)),
        element("tbody", {}, body),
    )
    return element("div", {"class": "wide", "tabindex": "0"}, whole)
