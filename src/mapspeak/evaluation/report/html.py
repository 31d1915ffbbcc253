"""HTML with all text escaped, and pages that load nothing from elsewhere."""

import base64
import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib import resources
from typing import NewType

Html = NewType("Html", str)
"""Markup that was made here; plain text is not accepted where it is asked for."""

VOID = frozenset({"img", "meta", "input", "br"})
INVISIBLE = re.compile(
    "[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u061c\u200b-\u200f\u202a-\u202e\u2060-\u2069\ufeff\ufff0-\uffff]"
    "|[\ud800-\udfff]"
)
"""Control characters, and characters that change the text direction: they are spelled out."""


def text(value: object) -> Html:
    """Return text as markup; invisible characters are spelled out."""
    return Html(escape(INVISIBLE.sub(lambda found: f"<U+{ord(found[0]):04X}>", str(value))))


def joined(parts: Iterable[Html]) -> Html:
    """Return pieces of markup one after the other."""
    return Html("".join(parts))


def element(name: str, attributes: Mapping[str, object], *children: Html) -> Html:
    """Return an element; the values of its attributes are escaped."""
    inside = "".join(f' {key}="{text(value)}"' for key, value in attributes.items())
    if name in VOID:
        return Html(f"<{name}{inside}>")
    return Html(f"<{name}{inside}>{joined(children)}</{name}>")


def paragraph(kind: str, said: str) -> Html:
    """Return text in a paragraph of a class."""
    return element("p", {"class": kind}, text(said))


def table(heading: Sequence[str], rows: Iterable[Sequence[Html]], *, kind: str) -> Html:
    """Return a table that scrolls sideways where the screen is narrow; cells come as <td>."""
    head = joined(element("th", {"scope": "col"}, text(cell)) for cell in heading)
    body = joined(element("tr", {}, *row) for row in rows)
    parts = (element("thead", {}, element("tr", {}, head)), element("tbody", {}, body))
    whole = element("table", {"class": kind}, *parts)
    return element("div", {"class": "wide", "tabindex": "0"}, whole)


def document(title: str, *body: Html) -> bytes:
    """Return a whole page in the style of the report, which loads and runs nothing."""
    style = resources.files(__package__).joinpath("page.css").read_text("utf-8")
    digest = base64.b64encode(hashlib.sha256(style.encode()).digest()).decode()
    policy = f"default-src 'none'; style-src 'sha256-{digest}'; base-uri 'none'; form-action 'none'"
    head = (
        element("meta", {"charset": "utf-8"}),
        element("meta", {"name": "viewport", "content": "width=device-width, initial-scale=1"}),
        element("meta", {"http-equiv": "Content-Security-Policy", "content": policy}),
        element("meta", {"name": "referrer", "content": "no-referrer"}),
        element("title", {}, text(title)),
        Html(f"<style>{style}</style>"),
    )
    page = element("html", {"lang": "en"}, element("head", {}, *head), element("body", {}, *body))
    return f"<!doctype html>\n{page}\n".encode(errors="replace")
