"""Map files as Nav2's map_server reads them: a .yaml and a picture.

The rules are those of `nav2_map_server` since 2025: single precision, `occupied_thresh` and
`free_thresh` themselves belong to occupied and free, transparent pixels are unknown. (Releases
before that left out the equality and averaged transparency into the grey of trinary maps.)
"""

import math
import os
import stat
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path, PureWindowsPath
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import AliasEvent, CollectionEndEvent, CollectionStartEvent

from mapspeak.errors import MapError, say_cause
from mapspeak.geometry import Pose
from mapspeak.spatial.grid import FREE_MAX, UNKNOWN, OccupancyGrid

Grey = NDArray[np.uint8]

MAX_CELLS = 80_000_000
"""About 8,900 x 8,900 cells, or 450 x 450 m at 5 cm."""

_MAX_YAML_BYTES, _MOST_NESTED = 1_000_000, 20
_FREE, _OCCUPIED = 0, 100
UNKNOWN_GREY = 205
DEFAULT_OCCUPIED_THRESH, DEFAULT_FREE_THRESH = 0.65, 0.196
PICTURE_SUFFIXES = {".pgm", ".png", ".bmp", ".jpg", ".jpeg"}
_PICTURE_FORMATS = ("PPM", "PNG", "BMP", "JPEG")
_SWITCHES = {"0": False, "false": False, "no": False, "1": True, "true": True, "yes": True}


class MapMode(StrEnum):
    """Encoding of occupancy in the greys of a map's picture.

    Trinary: free, occupied or unknown. Scale: the same, and between the thresholds a probability.
    Raw: the grey itself is the occupancy, and anything above 100 is unknown.
    """

    TRINARY = "trinary"
    SCALE = "scale"
    RAW = "raw"


class MapOddity(StrEnum):
    """Kinds of doubts about a map file that loads, but hardly as its maker meant."""

    UNKNOWN_IS_FREE = "unknown_is_free"
    CROSSED_THRESHOLDS = "crossed_thresholds"
    NOTHING_FREE = "nothing_free"
    PICTURE_BESIDE = "picture_beside"


@dataclass(frozen=True, slots=True, kw_only=True)
class MapFileWarning:
    """A doubt about a map file.

    Attributes:
        n_cells: Number of cells with the grey of unknown that load as free.
        picture: The file that was read instead of the missing one that is named.
    """

    oddity: MapOddity
    free_thresh: float = DEFAULT_FREE_THRESH
    occupied_thresh: float = DEFAULT_OCCUPIED_THRESH
    picture: str = ""
    n_cells: int = 0
    share_ratio: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoadedMap:
    """A map from files; compared by identity.

    Attributes:
        name: The file's name without its ending.
    """

    grid: OccupancyGrid
    name: str
    warnings: tuple[MapFileWarning, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Description:
    """The .yaml beside a map's picture."""

    image: str
    resolution: float
    origin: Pose
    occupied_thresh: float = DEFAULT_OCCUPIED_THRESH
    free_thresh: float = DEFAULT_FREE_THRESH
    negate: bool = False
    mode: MapMode = MapMode.TRINARY


def load_map(path: Path, *, is_grey_unknown: bool = False) -> LoadedMap:
    """Read a map_server .yaml and the picture it names, or one beside it if that is missing.

    Args:
        path: The .yaml.
        is_grey_unknown: Treats the grey 205 as unknown, whatever the .yaml's threshold for free.

    Raises:
        MapError: A file is missing, damaged, too large, or has an impossible value.
    """
    description = _read_description(path)
    if is_grey_unknown:
        thresh = min(description.free_thresh, DEFAULT_FREE_THRESH)
        description = replace(description, free_thresh=thresh)
    picture = find_picture(path, description.image)
    loaded = _build_map(description, *_read_picture(picture), path)
    if picture == path.parent / description.image:
        return loaded
    beside = MapFileWarning(oddity=MapOddity.PICTURE_BESIDE, picture=picture.name)
    return replace(loaded, warnings=(beside, *loaded.warnings))


def find_picture(description: Path, image: str) -> Path:
    """Return the picture that a .yaml names; if missing, one of that name beside it.

    Maps that were copied from another machine often name a path of that machine.
    """
    beside = (
        description.with_name(PureWindowsPath(image).name or image),
        *(description.with_suffix(suffix) for suffix in sorted(PICTURE_SUFFIXES)),
    )
    named = description.parent / image
    return next((each for each in (named, *beside) if each.is_file()), named)


def load_picture(path: Path, *, resolution_m: float) -> LoadedMap:
    """Read a map's picture that has no .yaml: dark is occupied, 205 unknown, 254 and 255 free.

    Raises:
        MapError: The file is missing, damaged or too large, or the resolution is not positive.
    """
    grey, alpha = _read_picture(path)
    description = _Description(image=path.name, resolution=resolution_m, origin=Pose(0.0, 0.0))
    return _build_map(description, grey, alpha, path)


def _build_map(description: _Description, grey: Grey, alpha: Grey | None, path: Path) -> LoadedMap:
    """Return the grid of a picture's greys; row 0 is the lowest line of the picture."""
    occupancy_of = _occupancy_of_grey(description)
    cells = occupancy_of[grey]
    if alpha is not None and description.mode is not MapMode.RAW:
        cells[alpha < 255] = UNKNOWN
    grid = OccupancyGrid(
        cells=cells[::-1], resolution_m=description.resolution, origin=description.origin
    )
    n_unknown = int(np.count_nonzero(grey == UNKNOWN_GREY))
    mode, is_crossed = description.mode, description.free_thresh >= description.occupied_thresh
    has = {
        MapOddity.UNKNOWN_IS_FREE: mode is MapMode.TRINARY
        and n_unknown > 0
        and 0 <= occupancy_of[UNKNOWN_GREY] <= FREE_MAX,
        MapOddity.CROSSED_THRESHOLDS: is_crossed and mode is not MapMode.RAW,
        MapOddity.NOTHING_FREE: not grid.free.any(),
    }
    warnings = tuple(
        MapFileWarning(
            oddity=oddity,
            free_thresh=description.free_thresh,
            occupied_thresh=description.occupied_thresh,
            n_cells=n_unknown,
            share_ratio=n_unknown / max(grey.size, 1),
        )
        for oddity, is_true in has.items()
        if is_true
    )
    return LoadedMap(grid=grid, name=path.stem, warnings=warnings)


def _occupancy_of_grey(description: _Description) -> NDArray[np.int8]:
    """Return the occupancy of each of the 256 greys, in the single precision map_server uses."""
    shade = np.arange(256, dtype=np.float32) / np.float32(255)
    if description.mode is MapMode.RAW:
        greys = np.arange(256)
        return np.where(greys <= _OCCUPIED, greys, UNKNOWN).astype(np.int8)
    occupied_ratio = shade if description.negate else np.float32(1) - shade
    free_thresh = np.float32(description.free_thresh)
    is_occupied = occupied_ratio >= np.float32(description.occupied_thresh)
    is_free = occupied_ratio <= free_thresh
    between = np.full(256, UNKNOWN, dtype=np.float32)
    if description.mode is MapMode.SCALE and not (is_occupied | is_free).all():
        span = np.float32(description.occupied_thresh - description.free_thresh)
        between = np.floor((occupied_ratio - free_thresh) / span * np.float32(100) + 0.5)
    occupancy = np.where(is_free, _FREE, np.where(is_occupied, _OCCUPIED, between))
    return occupancy.astype(np.int8)


def _read_description(path: Path) -> _Description:
    if path.suffix.lower() in PICTURE_SUFFIXES:
        raise MapError(
            f"{path.name} is a picture, not the .yaml of a map.",
            hint="Give the .yaml beside it, or the picture with its resolution in metres per cell.",
        )
    document = _parse_yaml(path)
    values: dict[str, Any] = {}
    for key, (read, example) in _KEYS.items():
        if key in document:
            try:
                values[key] = read(document[key])
            except (TypeError, ValueError, LookupError, ArithmeticError) as error:
                line = document.lc.key(key)[0] + 1
                raise MapError(
                    f"{path.name} line {line}: {key} cannot be {document[key]!r}.",
                    hint=f"Write a line such as '{example}'.",
                ) from error
        elif key != "mode":
            raise MapError(
                f"{path.name} has no {key}.",
                hint=f"Add a line for it, such as '{example}'; map_server refuses it too.",
            )
    return _Description(**values)


def _text(said: object) -> str:
    if not (isinstance(said, str) and said):
        raise ValueError(said)
    return said


def _number(said: Any) -> float:  # noqa: ANN401 - anything a .yaml holds
    number = float(said)
    if not math.isfinite(number):
        raise ValueError(said)
    return number


def _length(said: object) -> float:
    if _number(said) <= 0:
        raise ValueError(said)
    return _number(said)


def _pose(said: Iterable[object]) -> Pose:
    x, y, yaw_rad = (_number(each) for each in said)
    return Pose(x, y, yaw_rad)


_KEYS: dict[str, tuple[Callable[[Any], object], str]] = {
    "image": (_text, "image: map.pgm"),
    "resolution": (_length, "resolution: 0.05"),
    "origin": (_pose, "origin: [-10.0, -10.0, 0.0]"),
    "occupied_thresh": (_number, "occupied_thresh: 0.65"),
    "free_thresh": (_number, "free_thresh: 0.196"),
    "negate": (lambda said: _SWITCHES[str(said).lower()], "negate: 0"),
    "mode": (lambda said: MapMode(str(said).lower()), "mode: trinary"),
}
"""Parser and example line for each key of the .yaml."""


def _parse_yaml(path: Path) -> CommentedMap:
    try:
        with _open_regular(path) as file:
            document = _load_flat(file.read(_MAX_YAML_BYTES).decode())
    except FileNotFoundError as error:
        raise MapError(
            f"There is no map file {path}.", hint="Check the path of the .yaml file."
        ) from error
    except OSError as error:
        raise MapError(
            f"{path} cannot be read: {error.strerror or error}.",
            hint="Give the path of a .yaml file that may be read.",
        ) from error
    except (ValueError, RecursionError, YAMLError) as error:
        mark = error.problem_mark if isinstance(error, MarkedYAMLError) else None
        line = "" if mark is None else f" line {mark.line + 1}"
        raise MapError(
            f"{path.name}{line} is not YAML.",
            hint="A map's .yaml holds lines such as 'resolution: 0.05', no aliases.",
        ) from error
    if not isinstance(document, CommentedMap):
        raise MapError(
            f"{path.name} does not describe a map: it has no keys.",
            hint="It needs image, resolution, origin, negate, occupied_thresh and free_thresh.",
        )
    return document


def _load_flat(text: str) -> object:
    """Refuse aliases and deep nesting: a few lines of them cost gigabytes or minutes."""
    depth = 0
    for event in YAML(pure=True).parse(text):
        depth += isinstance(event, CollectionStartEvent) - isinstance(event, CollectionEndEvent)
        if isinstance(event, AliasEvent) or depth > _MOST_NESTED:
            raise YAMLError("aliases or deep nesting")
    return YAML(typ="rt", pure=True).load(text)


def _read_picture(path: Path) -> tuple[Grey, Grey | None]:
    """Return the greys of a picture, and its alpha channel if it has one."""
    try:
        with _open_regular(path) as file, Image.open(file, formats=_PICTURE_FORMATS) as picture:
            if picture.width * picture.height > MAX_CELLS:
                raise _say_too_large(path, f"{picture.width:,} x {picture.height:,}")
            return _channels(picture)
    except FileNotFoundError as error:
        raise MapError(
            f"The map's picture {path} is missing.",
            hint="Put it there, or correct the line 'image:' of the .yaml.",
        ) from error
    except (Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        raise _say_too_large(path, "far more") from error
    except (OSError, SyntaxError, ValueError, EOFError) as error:
        raise MapError(
            f"The map's picture {path.name} cannot be read: {say_cause(error)}.",
            hint="It may be cut off or of another type; a .pgm or .png is wanted.",
        ) from error


def _say_too_large(path: Path, size: str) -> MapError:
    return MapError(
        f"The map's picture {path.name} has {size} pixels; the limit is {MAX_CELLS:,}.",
        hint="Cut the map to the part that is needed, or make it with a coarser resolution.",
    )


def _channels(picture: Image.Image) -> tuple[Grey, Grey | None]:
    """Return grey and alpha of any picture; colours count by their brightness (Rec. 601)."""
    if picture.mode.startswith("I"):
        wide = np.asarray(picture).astype(np.int64)
        return ((wide * 255 + 32767) // 65535).astype(np.uint8), None
    if picture.has_transparency_data:
        with_alpha = picture.convert("RGBA")
        return np.asarray(with_alpha.convert("L")), np.asarray(with_alpha.getchannel("A"))
    return np.asarray(picture.convert("L")), None


def _open_regular(path: Path) -> BinaryIO:
    """Open a file for reading, unless it is a pipe or a device, which might never end.

    Raises:
        OSError: It cannot be opened, or is not a regular file.
    """
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise OSError("it is not a regular file")
    return os.fdopen(descriptor, "rb")
