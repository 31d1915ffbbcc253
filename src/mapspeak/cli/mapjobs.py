"""The maps to show and the files to write about each, checked before anything is written."""

import hashlib
import os
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import NoReturn

from PIL import Image, UnidentifiedImageError

from mapspeak.errors import ConfigError, say_cause
from mapspeak.geometry import Point
from mapspeak.spatial.areagraph import MapAnchor
from mapspeak.spatial.mapfiles import PICTURE_SUFFIXES, find_picture

DESCRIPTION_SUFFIXES = {".yaml", ".yml"}

_LONGEST_DESCRIPTION = 65536
_PATTERN_SIGN = re.compile(r"[*?[]")
_IMAGE_LINE = re.compile(r"""^(?:\{ *)?["']?image["']? *: *["']?([^"'#,}\n]+)""", re.MULTILINE)


@dataclass(frozen=True, slots=True, kw_only=True)
class MapSelection:
    """The maps that were asked for.

    Attributes:
        names: A unique name for each map file, from its path below the given folder.
        is_one_file: True when one file was asked for, and no folder or pattern.
    """

    names: Mapping[Path, str]
    is_one_file: bool

    @property
    def pictures(self) -> tuple[Path, ...]:
        """The bare pictures, which do not say how large their pixels are."""
        return tuple(file for file in self.names if not is_description(file))


def find_maps(asked: Iterable[Path]) -> MapSelection:
    """Return the map files among files, folders and patterns such as `maps/**/map.yaml`.

    In a folder, .yaml files that name an image and a resolution are maps; so are pictures called
    map that have no .yaml.

    Raises:
        ConfigError: One of them does not exist, or holds no map.
    """
    asked = tuple(asked)
    found: dict[str, Path] = {}
    bases: list[str] = []
    for path in asked:
        base, files = _resolve(path)
        bases.append(_spelled_one_way(base))
        found |= {_spelled_one_way(file): file for file in files}
    is_one_file = len(asked) == 1 and tuple(found.values()) == asked
    names = _names(list(found.values()), os.path.commonpath(bases))
    return MapSelection(names=names, is_one_file=is_one_file)


def _resolve(asked: Path) -> tuple[Path, list[Path]]:
    """Return the folder that names are relative to, and the map files."""
    try:
        if asked.is_dir():
            return asked, _maps_in(asked)
        if asked.exists():
            return asked.parent, [asked]
        if _PATTERN_SIGN.search(str(asked)):
            return _resolve_pattern(asked)
    except OSError as error:
        raise ConfigError(
            f"{error.filename or asked} cannot be looked at: {error.strerror}.",
            hint="Check who may read it.",
        ) from error
    raise ConfigError(f"There is no file {asked}.", hint="Give a map's .yaml or picture.")


def _resolve_pattern(asked: Path) -> tuple[Path, list[Path]]:
    parts = asked.parts
    first = next(i for i, part in enumerate(parts) if _PATTERN_SIGN.search(part))
    base = Path(*parts[:first])
    try:
        matches = sorted(base.glob(str(Path(*parts[first:]))))
    except ValueError as error:
        raise ConfigError(
            f"{asked} is no pattern: {error}.", hint='A pattern is such as "maps/**/map.yaml".'
        ) from error
    found: list[Path] = []
    for path in matches:
        if path.is_dir():
            found += _find_in(path)
        elif path.suffix.lower() in DESCRIPTION_SUFFIXES | PICTURE_SUFFIXES:
            found.append(path)
    if not found:
        raise ConfigError(f"No map matches {asked}.", hint='A pattern is such as "maps/**/*.yaml".')
    return base, found


def _maps_in(folder: Path) -> list[Path]:
    found = _find_in(folder)
    if not found:
        raise ConfigError(
            f"The folder {folder} holds no map that can be seen.",
            hint="Maps are .yaml files that name an image, or pictures called map.png or map.pgm.",
        )
    return found


def _find_in(folder: Path) -> list[Path]:
    files = _files_under(folder)
    described = {
        file: image
        for file in files
        if is_description(file) and (image := find_image(file)) is not None
    }
    named = {image.resolve() for image in described.values()}
    own = {file.with_suffix("") for file in described}
    return [
        file
        for file in files
        if file in described
        or (
            _is_picture_of_a_map(file)
            and not {file.resolve(), file.with_suffix("")} & (named | own)
        )
    ]


def _files_under(folder: Path) -> list[Path]:
    def give_up(error: OSError) -> NoReturn:
        raise error

    walk = os.walk(folder, onerror=give_up)
    files = (Path(where) / name for where, _, names in walk for name in names)
    return sorted(file for file in files if file.is_file())


def is_description(file: Path) -> bool:
    """Return True for a .yaml; anything else is taken for a bare picture."""
    return file.suffix.lower() in DESCRIPTION_SUFFIXES


def _is_picture_of_a_map(file: Path) -> bool:
    return file.suffix.lower() in PICTURE_SUFFIXES and file.stem == "map"


def find_image(description: Path) -> Path | None:
    """Return the picture that a map's .yaml names, or None for another kind of .yaml.

    For a file that cannot be read, return the file: its fault is reported when it is shown.
    """
    try:
        with description.open(encoding="utf-8", errors="replace") as file:
            text = file.read(_LONGEST_DESCRIPTION)
    except OSError:
        return description
    line = _IMAGE_LINE.search(text)
    # Files of other programs name an image, too, but no resolution.
    return find_picture(description, line[1].strip()) if line and "resolution" in text else None


def _names(files: list[Path], base: str) -> dict[Path, str]:
    """Return each file a name from its path; the same one however many others there are.

    Where paths differ only in ways that such a name does not show, a digest of the path does.
    """
    relative = {file: Path(os.path.relpath(file, base)) for file in files}
    plain = {file: "_".join(path.with_suffix("").parts) for file, path in relative.items()}
    uses = Counter(name.casefold() for name in plain.values())
    return {
        file: name if uses[name.casefold()] == 1 else f"{name}-{_digest(relative[file])}"
        for file, name in plain.items()
    }


def _spelled_one_way(path: Path) -> str:
    """Return the absolute path without following links: two links are two maps."""
    return os.path.normpath(path.absolute())


def _digest(path: Path) -> str:
    return hashlib.sha256(os.fsencode(path.as_posix())).hexdigest()[:8]


class Output(StrEnum):
    """An output written for a map; the value ends its file's name in a folder of results."""

    PICTURE = ".png"
    FACTS = ".json"
    LABELS = "_rooms.png"
    GRAPH = "_graph.json"
    GEOJSON = ".geojson"
    OSM = ".osm"


@dataclass(frozen=True, slots=True, kw_only=True)
class MapJob:
    """One map, and where its results go.

    Attributes:
        file: The .yaml or the bare picture.
    """

    file: Path
    name: str
    outputs: Mapping[Output, Path]


@dataclass(frozen=True, slots=True, kw_only=True)
class MapOptions:
    """The options that are the same for all maps.

    Attributes:
        resolution_m: The side of a pixel, for bare pictures; a .yaml file says it itself.
        anchor: Where on Earth the maps lie, if given.
        start: Where paths are measured from, if they are wanted.
        is_grey_unknown: Take the grey 205 for unknown, whatever the .yaml says.
    """

    resolution_m: float | None
    anchor: MapAnchor | None
    start: Point | None
    is_grey_unknown: bool


def plan_jobs(
    selection: MapSelection, options: MapOptions, outputs: Mapping[Output, Path]
) -> list[MapJob]:
    """Return one job for each map, after checking that all of them can be done.

    Args:
        outputs: What to write: files when there is one map, else folders.

    Raises:
        ConfigError: A resolution is missing, it or the anchor is of no use, or a result would
            overwrite a map or another result.
    """
    _check_resolution(selection, options.resolution_m)
    for output, target in outputs.items():
        if len(selection.names) > 1 and target.suffix and not target.is_dir():
            raise ConfigError(
                f"There are {len(selection.names)} maps, and {target} is the name of one file.",
                hint=f"Name a folder, such as {target.with_suffix('')}: each map gets its own file "
                f"NAME{output} in it.",
            )
    if options.anchor is not None and not outputs.keys() & {Output.GEOJSON, Output.OSM}:
        raise ConfigError(
            "--anchor would change nothing: it is for --geojson and --osm.",
            hint="Say where one of them shall go, or leave --anchor out.",
        )
    jobs = [
        MapJob(
            file=file,
            name=name,
            outputs={
                output: target / f"{name}{output}" if _is_folder(target, selection) else target
                for output, target in outputs.items()
            },
        )
        for file, name in selection.names.items()
    ]
    _check_targets(jobs)
    return jobs


def _check_resolution(selection: MapSelection, resolution_m: float | None) -> None:
    pictures = selection.pictures
    if resolution_m is None and pictures:
        if not _is_picture(pictures[0]):
            raise ConfigError(
                f"{pictures[0]} is no picture, and no map's .yaml file.",
                hint="Give a map's .yaml file, or its .pgm or .png.",
            )
        others = f" and {len(pictures) - 1} more" if len(pictures) > 1 else ""
        raise ConfigError(
            f"{pictures[0]}{others}: a bare picture, and nothing says how large its pixels are.",
            hint="Give --resolution in metres per pixel, such as 0.05, or the map's .yaml file.",
        )
    if resolution_m is not None and not pictures:
        raise ConfigError(
            f"--resolution {resolution_m:g} would change nothing: it is for bare pictures.",
            hint="A map's .yaml says it itself: correct its line 'resolution:', or give its image.",
        )


def _is_picture(file: Path) -> bool:
    try:
        with Image.open(file):
            return True
    except UnidentifiedImageError:
        return False
    except (Image.DecompressionBombError, Image.DecompressionBombWarning):
        return True
    except OSError as error:
        raise ConfigError(
            f"{file} cannot be read: {say_cause(error)}.", hint="Check who may read it."
        ) from error


def _is_folder(target: Path, selection: MapSelection) -> bool:
    is_one = len(selection.names) == 1
    return not is_one or target.is_dir() or not (selection.is_one_file or target.suffix)


def _check_targets(jobs: list[MapJob]) -> None:
    """Check that no result overwrites a map or another result, before anything is written."""
    maps = {path.resolve() for job in jobs for path in _inputs(job.file)}
    written: set[Path] = set()
    for path in (path for job in jobs for path in job.outputs.values()):
        place = path.resolve()
        if place in maps:
            raise ConfigError(
                f"{path} is one of the maps and would be overwritten.",
                hint="Nothing was written. Choose another place for the results.",
            )
        if place in written:
            raise ConfigError(
                f"Two results would go to {path}.",
                hint="Nothing was written. Give each kind of result a file of its own.",
            )
        written.add(place)


def _inputs(file: Path) -> Iterator[Path]:
    yield file
    image = find_image(file) if is_description(file) else None
    if image is not None:
        yield image
