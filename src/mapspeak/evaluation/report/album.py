"""Pictures on a page: each once, however often it was seen, or left in the folder and linked."""

import base64
import hashlib
import io
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import quote

from PIL import Image

from mapspeak.evaluation.report.markup import Html, element, joined, text

__all__ = ["Album", "count_picture_bytes", "find_picture"]

FORMATS = {"PNG": "image/png", "JPEG": "image/jpeg"}


def find_picture(pictures: Path, name: str) -> Path | None:
    """Return the file of a picture; None where it is missing, or the name leads elsewhere."""
    path = pictures / name
    is_inside = path.name == name and path.resolve().parent == pictures.resolve()
    return path if is_inside and path.is_file() else None


def count_picture_bytes(folders: Iterable[Path]) -> int:
    """Return the size of all pictures in some folders, each counted once."""
    sizes = {
        hashlib.sha256(data).digest(): len(data)
        for folder in folders
        for path in sorted(folder.glob("*"))
        if path.is_file()
        for data in [path.read_bytes()]
    }
    return sum(sizes.values())


@dataclass(slots=True)
class Album:
    """The pictures of one page.

    Attributes:
        is_inside: Pictures are part of the page; else they are linked.
        root: The folder that the page lies in.
    """

    is_inside: bool
    root: Path
    _kept: dict[str, Html] = field(default_factory=dict)

    def show(self, path: Path, caption: str) -> Html:
        """Return a picture of the folder as markup."""
        data = path.read_bytes()
        found = _measure(data)
        if found is None:
            return element("p", {"class": "none"}, text(f"{path.name} is no picture."))
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
