"""Pieces of a page: HTML that cannot be broken by its texts, a map below a way, and pictures."""

import base64
import hashlib
import io
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import NewType
from urllib.parse import quote

import numpy as np
from PIL import Image

from mapspeak.geometry import Pose
from mapspeak.spatial import OccupancyGrid
from mapspeak.spatial.grid import FloatArray

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
    """Return an element; the values of its attributes are escaped."""
    inside = "".join(f' {key}="{text(value)}"' for key, value in attributes.items())
    if name in VOID:
        return Html(f"<{name}{inside}>")
    return Html(f"<{name}{inside}>{''.join(children)}</{name}>")


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


GREYS = (244, 255, 60)
"""Unknown, free, occupied."""
UNKNOWN, FREE, OCCUPIED = range(3)
MARGIN_CELLS = 4
LONGEST_PX = 1200


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Sheet:
    """A map as a picture with y up; a pixel's side is some cells of the part that it shows."""

    png: bytes
    width_px: int
    height_px: int
    grid: OccupancyGrid
    cells_per_px: int

    @property
    def px_per_m(self) -> float:
        """Pixels per metre."""
        return 1.0 / (self.grid.resolution_m * self.cells_per_px)

    def pixels_at(self, points: FloatArray) -> FloatArray:
        """Return (u, v) of shape (n, 2), as real numbers, for points in metres of shape (n, 2)."""
        cells = self.grid.fractional_cells_at(points) / self.cells_per_px
        return np.stack([cells[:, 1], self.height_px - cells[:, 0]], axis=1)

    def heading_deg(self, pose: Pose) -> float:
        """Return a heading as SVG turns things: clockwise from the picture's right."""
        return -math.degrees(pose.yaw_rad - self.grid.origin.yaw_rad)


def draw_sheet(grid: OccupancyGrid) -> Sheet | None:
    """Draw what is known of a map; None where nothing is."""
    rows, cols = np.nonzero(~grid.unknown)
    if not rows.size:
        return None
    part = grid.crop(_span(rows, grid.n_rows), _span(cols, grid.n_cols))
    step = math.ceil(max(part.n_rows, part.n_cols) / LONGEST_PX)
    tones = np.full(part.cells.shape, UNKNOWN, dtype=np.uint8)
    tones[part.free] = FREE
    tones[part.occupied] = OCCUPIED
    seen = np.flipud(tones[::step, ::step])
    height_px, width_px = seen.shape
    picture = Image.fromarray(np.ascontiguousarray(seen))
    picture.putpalette([grey for grey in GREYS for _ in range(3)])
    file = io.BytesIO()
    picture.save(file, "PNG", optimize=True)
    return Sheet(
        png=file.getvalue(),
        width_px=int(width_px),
        height_px=int(height_px),
        grid=part,
        cells_per_px=step,
    )


def _span(known: np.ndarray[tuple[int, ...], np.dtype[np.intp]], n_cells: int) -> slice:
    first, last = int(known.min()), int(known.max())
    return slice(max(first - MARGIN_CELLS, 0), min(last + 1 + MARGIN_CELLS, n_cells))


FORMATS = {"PNG": "image/png", "JPEG": "image/jpeg"}


def find_picture(pictures: Path, name: str) -> Path | None:
    """Return the file of a picture; None where it is missing, or the name leads elsewhere."""
    path = pictures / name
    is_inside = path.name == name and path.resolve().parent == pictures.resolve()
    return path if is_inside and path.is_file() else None


def count_picture_bytes(folders: Iterable[Path]) -> int:
    """Return the size of all pictures in some folders, each counted once."""
    paths = (path for folder in folders for path in folder.glob("*") if path.is_file())
    pictures = (path.read_bytes() for path in paths)
    return sum({hashlib.sha256(data).digest(): len(data) for data in pictures}.values())


@dataclass(slots=True)
class Album:
    """The pictures of one page.

    Attributes:
        is_inside: Pictures are part of the page; else they are linked.
    """

    is_inside: bool
    root: Path
    _kept: dict[str, Html] = field(default_factory=dict)

    def show(self, path: Path, caption: str) -> Html:
        """Return a picture of the folder as markup."""
        data = path.read_bytes()
        found = _measure(data)
        if found is None:
            return paragraph("none", f"{path.name} is no picture.")
        media_type, width, height = found
        if self.is_inside:
            name = self.keep(data, media_type, width, height)
            box = {"class": "seen", "viewBox": f"0 0 {width} {height}", "role": "img"}
            used = element("use", {"href": f"#{name}"})
            return element("svg", {**box, "aria-label": caption}, used)
        where = quote(path.relative_to(self.root).as_posix())
        size = {"width": width, "height": height, "loading": "lazy"}
        return element("img", {"class": "seen", "src": where, **size, "alt": caption})

    def keep(self, data: bytes, media_type: str, width: int, height: int) -> str:
        """Take a picture in, if it is not there yet, and return the id that it is used by."""
        name = f"p-{hashlib.sha256(data).hexdigest()[:16]}"
        if name not in self._kept:
            inside = f"data:{media_type};base64,{base64.b64encode(data).decode()}"
            size = {"width": width, "height": height}
            self._kept[name] = element("image", {"id": name, **size, "href": inside})
        return name

    def definitions(self) -> Html:
        """Return everything that was taken in; it is shown nowhere, only used."""
        kept = joined(self._kept.values())
        unseen = {"class": "album", "width": 0, "height": 0, "aria-hidden": "true"}
        return element("svg", unseen, element("defs", {}, kept))


def _measure(data: bytes) -> tuple[str, int, int] | None:
    """Return media type, width and height in pixels; None for what is neither PNG nor JPEG."""
    try:
        with Image.open(io.BytesIO(data), formats=tuple(FORMATS)) as picture:
            return FORMATS[str(picture.format)], picture.width, picture.height
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None
