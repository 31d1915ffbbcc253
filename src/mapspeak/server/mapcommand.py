"""`mapspeak map`: a map file shown as a robot's map is shown, with no robot."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from PIL import Image

from mapspeak.errors import ConfigError
from mapspeak.server.drawing import draw_rooms
from mapspeak.server.facts import MapFacts, RegionFacts
from mapspeak.spatial.mapfiles import LoadedMap, load_map, load_picture
from mapspeak.spatial.rooms import RoomMap, find_rooms

__all__ = ["MapOutputs", "find_maps", "show_map"]

DESCRIPTION_SUFFIXES = (".yaml", ".yml")
PICTURE_SUFFIXES = (".png", ".pgm", ".bmp")


@dataclass(frozen=True, slots=True, kw_only=True)
class MapOutputs:
    """Where the results of one map go; None where they were not asked for.

    Attributes:
        picture: The annotated PNG.
        facts: The JSON file.
        labels: The 16-bit PNG, of the size and orientation of the map file; 0 is no region.
    """

    picture: Path | None
    facts: Path | None
    labels: Path | None

    @classmethod
    def of(
        cls,
        file: Path,
        picture: Path | None,
        facts: Path | None,
        labels: Path | None,
        *,
        are_folders: bool,
    ) -> Self:
        """Gives the outputs of one file among one or several."""
        if not are_folders:
            return cls(picture=picture, facts=facts, labels=labels)
        # Maps of one folder tree are often all called map.yaml: their folder tells them apart.
        name = f"{file.parent.name}_{file.stem}"
        return cls(
            picture=_inside(picture, f"{name}.png"),
            facts=_inside(facts, f"{name}.json"),
            labels=_inside(labels, f"{name}_rooms.png"),
        )


def find_maps(files: Iterable[Path]) -> list[Path]:
    """Gives the map files among files and folders, in a fixed order.

    In a folder, .yaml files are maps, and where there are none its pictures named map.

    Raises:
        ConfigError: One of them does not exist, or a folder holds no map.
    """
    found: list[Path] = []
    for file in files:
        if not file.exists():
            raise ConfigError(f"There is no file {file}.", hint="Give a map's .yaml or picture.")
        found += _maps_in(file) if file.is_dir() else [file]
    return found


def show_map(file: Path, *, resolution_m: float | None, outputs: MapOutputs) -> str:
    """Writes what was asked for, and gives a map's facts in a few lines."""
    loaded = _load(file, resolution_m)
    rooms = find_rooms(loaded.grid)
    facts = MapFacts.of(loaded, rooms)
    _write(outputs.facts, (facts.model_dump_json(indent=2) + "\n").encode())
    if outputs.picture is not None:
        _write(outputs.picture, draw_rooms(rooms).png)
    if outputs.labels is not None:
        _write_labels(outputs.labels, rooms)
    return _summary(facts)


def _load(file: Path, resolution_m: float | None) -> LoadedMap:
    if file.suffix.lower() in DESCRIPTION_SUFFIXES:
        return load_map(file)
    if resolution_m is None:
        raise ConfigError(
            f"{file} is a bare picture, and nothing says how large its pixels are.",
            hint="Give --resolution in metres per pixel, such as 0.05, or the map's .yaml file.",
        )
    return load_picture(file, resolution_m=resolution_m)


def _maps_in(folder: Path) -> list[Path]:
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    described = [path for path in files if path.suffix.lower() in DESCRIPTION_SUFFIXES]
    pictures = [p for p in files if p.suffix.lower() in PICTURE_SUFFIXES and p.stem == "map"]
    found = described or pictures
    if not found:
        raise ConfigError(
            f"The folder {folder} holds no map.", hint="Maps are .yaml files, or map.png, map.pgm."
        )
    return found


def _inside(folder: Path | None, name: str) -> Path | None:
    return None if folder is None else folder / name


def _write(path: Path | None, content: bytes) -> None:
    if path is None:
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    except OSError as error:
        raise ConfigError(
            f"{path} cannot be written: {error.strerror}.", hint="Choose another place for it."
        ) from error


def _write_labels(path: Path, rooms: RoomMap) -> None:
    picture = Image.fromarray(np.flipud(rooms.labels).astype(np.uint16))
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        picture.save(path, format="PNG")
    except OSError as error:
        raise ConfigError(
            f"{path} cannot be written: {error.strerror}.", hint="Choose another place for it."
        ) from error


def _summary(facts: MapFacts) -> str:
    cells = f"{facts.n_cols} x {facts.n_rows} cells of {facts.resolution_m:g} m"
    size = f"{facts.width_m:.1f} x {facts.height_m:.1f} m"
    seen = f"{facts.free_area_m2:.1f} m2 free, {100 * facts.unknown_ratio:.0f} % unknown"
    return "\n".join(
        [
            f"{facts.name}: {cells}, {size}, {seen}.",
            *(f"  warning: {warning}" for warning in facts.warnings),
            *(_region_line(region) for region in facts.regions),
        ]
    )


def _region_line(region: RegionFacts) -> str:
    return (
        f"  {region.id:4} {region.kind:10} {region.floor_area_m2:7.1f} m2  "
        f"{region.length_m:.1f} x {region.width_m:.1f} m  at {region.centre.x:.2f}, "
        f"{region.centre.y:.2f}  doors {' '.join(region.doors) or 'none'}"
    )
