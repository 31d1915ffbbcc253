"""How much disk the run-time packages take, and which take the most."""

import re
from collections.abc import Iterator
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

from benchmarks.figure import Figure

__all__ = ["find_sizes_mb", "measure"]

PINS = Path(__file__).parents[1] / "constraints" / "runtime.txt"
N_LARGEST = 8


def measure() -> Iterator[Figure]:
    """Return the size of all run-time packages, then of the largest, without byte code."""
    sizes_mb = find_sizes_mb()
    yield Figure(name="all packages", value=sum(sizes_mb.values()), unit="MB")
    for name in sorted(sizes_mb, key=sizes_mb.__getitem__, reverse=True)[:N_LARGEST]:
        yield Figure(name=name, value=sizes_mb[name], unit="MB")


def find_sizes_mb() -> dict[str, float]:
    """Return the installed size of each pinned run-time package, in megabytes (1e6 bytes)."""
    names = re.findall(r"^([\w.-]+)==", PINS.read_text(), re.MULTILINE)
    return {name: _size_mb(found) for name in names if (found := _find_distribution(name))}


def _find_distribution(name: str) -> Distribution | None:
    """Find a package; some are for other systems only."""
    try:
        return distribution(name)
    except PackageNotFoundError:
        return None


def _size_mb(package: Distribution) -> float:
    files = [file.locate() for file in package.files or () if file.suffix != ".pyc"]
    return sum(Path(str(file)).stat().st_size for file in files if Path(str(file)).is_file()) / 1e6
