"""What is written about each map, and where; looked at before anything is done."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from PIL import Image, UnidentifiedImageError

from mapspeak.errors import ConfigError, say_cause
from mapspeak.server.mapcommand.selection import MapSelection, find_image, is_description
from mapspeak.spatial.areagraph import MapAnchor


class Output(StrEnum):
    """What can be written about a map; the value ends its file's name in a folder of results."""

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
        name: What it is called among the others.
        resolution_m: The side of a pixel, for a bare picture.
        anchor: Where on Earth the map lies, if anybody said so.
        outputs: The files to write.
    """

    file: Path
    name: str
    resolution_m: float | None
    anchor: MapAnchor | None
    outputs: Mapping[Output, Path]


def plan_jobs(
    selection: MapSelection,
    *,
    resolution_m: float | None,
    anchor: MapAnchor | None,
    outputs: Mapping[Output, Path],
) -> list[MapJob]:
    """Gives one job for each map, after looking whether all of them can be done.

    Args:
        selection: The maps.
        resolution_m: The side of a pixel, for bare pictures; a .yaml file says it itself.
        anchor: Where on Earth the maps lie.
        outputs: What to write: files when there is one map, else folders.

    Raises:
        ConfigError: A resolution is missing, it or the anchor is of no use, or a result would
            overwrite a map or another result.
    """
    _check_resolution(selection, resolution_m)
    for output, target in outputs.items():
        if len(selection.names) > 1 and target.suffix and not target.is_dir():
            raise ConfigError(
                f"There are {len(selection.names)} maps, and {target} is the name of one file.",
                hint=f"Name a folder, such as {target.with_suffix('')}: each map gets its own file "
                f"NAME{output} in it.",
            )
    if anchor is not None and not outputs.keys() & {Output.GEOJSON, Output.OSM}:
        raise ConfigError(
            "--anchor would change nothing: it is for --geojson and --osm.",
            hint="Say where one of them shall go, or leave --anchor out.",
        )
    jobs = [
        MapJob(
            file=file,
            name=name,
            resolution_m=resolution_m,
            anchor=anchor,
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
    """Looks that no result overwrites a map or another result, before anything is written."""
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
