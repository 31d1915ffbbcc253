"""Runs the benchmarks: all of them, or those that are named.

A benchmark is a module of this package with a function `measure() -> Iterable[Figure]`; the first
line of its docstring says what it measures.
"""

import importlib
import json
import os
import pkgutil
import platform
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import version

import click
from rich.console import Console
from rich.table import Table

import benchmarks
from benchmarks.figure import Figure

__all__ = ["main"]

NOT_BENCHMARKS = {"figure", "mutations", "run", "talking", "typemaking"}


@click.command()
@click.argument("names", nargs=-1, metavar="[NAME]...")
@click.option("--json", "as_json", is_flag=True, help="Figures and machine as JSON.")
def main(names: tuple[str, ...], *, as_json: bool) -> None:
    """Run the benchmarks named, or all of them, and shows their figures."""
    wanted = names or list_benchmarks()
    if unknown := sorted(set(wanted) - set(list_benchmarks())):
        raise click.UsageError(
            f"No benchmark named {', '.join(unknown)}. There are: {', '.join(list_benchmarks())}."
        )
    figures = {name: measure(name) for name in wanted}
    show_json(figures) if as_json else show_table(figures)


def list_benchmarks() -> tuple[str, ...]:
    """Return the names of all benchmarks, in alphabetical order."""
    modules = {module.name for module in pkgutil.iter_modules(benchmarks.__path__)}
    return tuple(sorted(modules - NOT_BENCHMARKS))


def measure(name: str) -> list[Figure]:
    """Run one benchmark."""
    return list(importlib.import_module(f"benchmarks.{name}").measure())


def describe_machine() -> dict[str, str | int | None]:
    """Say where the figures hold: processor, system, and the libraries that do the work."""
    return {
        "machine": platform.machine(),
        "system": platform.platform(),
        "n_processors": os.cpu_count(),
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "opencv": version("opencv-python-headless"),
        "mapspeak": version("mapspeak"),
    }


def show_json(figures: Mapping[str, Sequence[Figure]]) -> None:
    """Write the figures for programs."""
    result = {
        "machine": describe_machine(),
        "benchmarks": {name: [asdict(figure) for figure in rows] for name, rows in figures.items()},
    }
    click.echo(json.dumps(result, indent=2))


def show_table(figures: Mapping[str, Sequence[Figure]]) -> None:
    """Write the figures for people."""
    table = Table("benchmark", "what", "value", "unit")
    table.columns[2].justify = "right"
    for name, rows in figures.items():
        for figure in rows:
            decimals = 1 if abs(figure.value) >= 10 else 3
            table.add_row(name, figure.name, f"{figure.value:,.{decimals}f}", figure.unit)
    Console().print(table)


if __name__ == "__main__":
    main()
