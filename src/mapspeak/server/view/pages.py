"""The viewer's page: linked to its files for a site, or as one file that needs nothing besides."""

import base64
import hashlib
from collections.abc import Sequence
from enum import StrEnum
from html import escape
from importlib import resources
from importlib.resources.abc import Traversable
from string import Template

from mapspeak.server.view.document import ViewPart


class PageKind(StrEnum):
    """What a page is for; the value is its class, by which its parts are shown or not."""

    LIVE = "live"
    CHAT = "chat"
    REPLAY = "replay"


SCRIPTS = {
    PageKind.LIVE: ("map.js", "calls.js", "commands.js", "live.js"),
    PageKind.CHAT: ("map.js", "calls.js", "app.js"),
    PageKind.REPLAY: ("map.js", "calls.js", "replay.js"),
}


def find_page_files() -> Traversable:
    """Return the folder of the viewer's own files."""
    return resources.files(__package__).joinpath("page")


def find_leaflet_files() -> Traversable:
    """Return the folder of Leaflet's files."""
    return resources.files("xstatic.pkg.leaflet").joinpath("data")


def link_page() -> bytes:
    """Return the live page, whose files lie beside it under `page/` and `leaflet/`."""
    scripts = ["leaflet/leaflet.js", *(f"page/{name}" for name in SCRIPTS[PageKind.LIVE])]
    styles = ("leaflet/leaflet.css", "page/view.css")
    head = [f'<link rel="stylesheet" href="{name}">' for name in styles]
    head += [f'<script src="{name}" defer></script>' for name in scripts]
    return _fill(PageKind.LIVE, "mapspeak: live", head, ())


def build_chat_page() -> bytes:
    """Return the page for a chat, as one file. Its host says what it may load."""
    style, script = _read_parts(PageKind.CHAT)
    head = [f"<style>{style}</style>"]
    return _fill(PageKind.CHAT, "mapspeak: map", head, [f"<script>{script}</script>"])


def build_replay_page(title: str, replay: ViewPart) -> bytes:
    """Return a replay as one file; pictures may lie beside it, and nothing else is loaded."""
    style, script = _read_parts(PageKind.REPLAY)
    policy = (
        f"default-src 'none'; img-src data: 'self' file:; style-src '{_hash(style)}'; "
        f"script-src '{_hash(script)}'; base-uri 'none'; form-action 'none'"
    )
    head = [
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
        '<meta name="referrer" content="no-referrer">',
        f"<style>{style}</style>",
    ]
    # No text in it can end the element early.
    told = replay.model_dump_json().replace("<", "\\u003c")
    tail = (
        f'<script type="application/json" id="document">{told}</script>',
        f"<script>{script}</script>",
    )
    return _fill(PageKind.REPLAY, title, head, tail)


def _fill(kind: PageKind, title: str, head: Sequence[str], tail: Sequence[str]) -> bytes:
    template = Template(find_page_files().joinpath("page.html").read_text("utf-8"))
    parts = {"head": "\n".join(head), "tail": "\n".join(tail)}
    page = template.substitute(parts, kind=kind, title=escape(title))
    return page.encode(errors="replace")


def _read_parts(kind: PageKind) -> tuple[str, str]:
    """Return all styles and all scripts of a page, each as one text."""
    own, leaflet = find_page_files(), find_leaflet_files()
    styles = (leaflet.joinpath("leaflet.css"), own.joinpath("view.css"))
    scripts = (leaflet.joinpath("leaflet.js"), *map(own.joinpath, SCRIPTS[kind]))
    style, script = ("\n".join(each.read_text("utf-8") for each in f) for f in (styles, scripts))
    return style, script


def _hash(inline: str) -> str:
    """Return the hash by which a page's policy allows this text and no other."""
    return f"sha256-{base64.b64encode(hashlib.sha256(inline.encode()).digest()).decode()}"
